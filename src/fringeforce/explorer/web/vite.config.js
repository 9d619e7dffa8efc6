import { defineConfig } from "vite";

// relative addresses, because the page lives under a token that nobody knows beforehand;
// names without hashes, because the bundle is committed and its changes should be readable
export default defineConfig({
  base: "./",
  build: {
    outDir: "../static",
    emptyOutDir: true,
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    target: "es2022",
    cssCodeSplit: false,
    rollupOptions: {
      input: { explorer: "index.html", pad: "pad.html" },
      output: {
        entryFileNames: "[name].js",
        chunkFileNames: "shared.js",
        assetFileNames: "explorer[extname]",
      },
    },
  },
});
