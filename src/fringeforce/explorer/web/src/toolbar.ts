/** Buttons above the pictures: history, link, theme, presets, and what is shown. */

import { commands, press, pressed, showCommands } from "./commands";
import { byId } from "./dom";
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
    commands(store, () => store.hash, acts.view);
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
    showCommands(store);
    for (const [key, button] of this.presets) press(button, key === store.state.preset);
    for (const [key, button] of this.components) press(button, key === store.view.component);
    press(this.mesh, store.view.mesh);
    press(byId("edges"), store.view.compare);
    byId("panel-edges").hidden = !store.view.compare;
  }

  private view(part: Partial<Store["view"]>): void {
    Object.assign(this.store.view, part);
    this.acts.view();
  }
}
