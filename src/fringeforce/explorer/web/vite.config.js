import { readFileSync } from "node:fs";
import { defineConfig } from "vite";

/** A page with the parts that all pages share put in where it names them. */
function joined(page) {
  return page.replace(/^( *)<!-- (\w+) -->\n/gm, (_, indent, name) => {
    const part = readFileSync(new URL(`parts/${name}.html`, import.meta.url), "utf8");
    return part.replace(/^(?=.)/gm, indent);
  });
}

// relative addresses, because the page lives under a token that nobody knows beforehand;
// names without hashes, because the bundle is committed and its changes should be readable
export default defineConfig({
  plugins: [{ name: "parts", transformIndexHtml: { order: "pre", handler: joined } }],
  base: "./",
  build: {
    outDir: "../static",
    emptyOutDir: true,
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    target: "es2022",
    cssCodeSplit: false,
    rollupOptions: {
      input: { explorer: "index.html", pad: "pad.html", skin: "skin.html" },
      output: {
        entryFileNames: "[name].js",
        chunkFileNames: "shared.js",
        assetFileNames: "explorer[extname]",
      },
    },
  },
});
