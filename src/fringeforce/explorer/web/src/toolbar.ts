/** Buttons above the pictures: history, link, theme, presets, and what is shown. */

import { isDark } from "./colours";
import { byId, element } from "./dom";
import { PRESETS } from "./presets";
import { NAMES } from "./stress";
import type { Component, Store } from "./store";

interface Acts {
  preset: (key: string) => void;
  view: () => void;
}

export class Toolbar {
  private readonly presets = new Map<string, HTMLButtonElement>();
  private readonly components = new Map<string, HTMLButtonElement>();
  private readonly mesh = pressed("Mesh", "The elements, moved by the load");

  constructor(
    private readonly store: Store,
    private readonly acts: Acts,
  ) {
    this.history();
    this.link();
    this.theme();
    for (const { key, name, hint } of PRESETS) {
      const button = pressed(name, hint);
      button.dataset.preset = key;
      button.addEventListener("click", () => acts.preset(key));
      this.presets.set(key, button);
    }
    byId("presets").append(...this.presets.values());
    for (const [key, name] of Object.entries(NAMES)) {
      const button = pressed(name, "");
      button.dataset.component = key;
      button.addEventListener("click", () => this.view({ component: key as Component }));
      this.components.set(key, button);
    }
    this.mesh.addEventListener("click", () => this.view({ mesh: !store.view.mesh }));
    byId("components").append(...this.components.values(), this.mesh);
    byId("edges").addEventListener("click", () => this.view({ compare: !store.view.compare }));
    byId("noise").addEventListener("click", () => store.change({ seed: store.state.seed + 1 }));
  }

  /** Show what is chosen. */
  show(): void {
    const { store } = this;
    byId<HTMLButtonElement>("undo").disabled = !store.canUndo;
    byId<HTMLButtonElement>("redo").disabled = !store.canRedo;
    for (const [key, button] of this.presets) press(button, key === store.state.preset);
    for (const [key, button] of this.components) press(button, key === store.view.component);
    press(this.mesh, store.view.mesh);
    press(byId("edges"), store.view.compare);
    byId("panel-edges").hidden = !store.view.compare;
    byId("theme").textContent = isDark() ? "Light" : "Dark";
  }

  private view(part: Partial<Store["view"]>): void {
    Object.assign(this.store.view, part);
    this.acts.view();
  }

  private history(): void {
    byId("undo").addEventListener("click", () => this.store.undo());
    byId("redo").addEventListener("click", () => this.store.redo());
    addEventListener("keydown", (event) => {
      if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
      // text that is being typed has an undo of its own
      if (event.target instanceof HTMLInputElement && event.target.type !== "range") return;
      event.preventDefault();
      if (event.shiftKey) this.store.redo();
      else this.store.undo();
    });
  }

  private link(): void {
    byId("share").addEventListener("click", async () => {
      const address = new URL(this.store.hash, location.href).href;
      history.replaceState(null, "", address);
      try {
        await navigator.clipboard.writeText(address);
        byId("link").textContent = "Link copied.";
      } catch {
        byId("link").textContent = "The address bar now holds the link.";
      }
    });
  }

  private theme(): void {
    const root = document.documentElement;
    const kept = localStorage.getItem("theme");
    if (kept) root.dataset.theme = kept;
    byId("theme").addEventListener("click", () => {
      root.dataset.theme = isDark() ? "light" : "dark";
      localStorage.setItem("theme", root.dataset.theme);
      this.acts.view();
    });
  }
}

function pressed(name: string, hint: string): HTMLButtonElement {
  return element("button", { type: "button", "aria-pressed": "false", title: hint }, name);
}

function press(button: HTMLElement, on: boolean): void {
  button.setAttribute("aria-pressed", `${on}`);
}
