/** Buttons above the pictures: history, link, theme, presets, and what is shown. */

import { Choice, commands, press, showCommands } from "./commands";
import { button, byId } from "./dom";
import { PRESETS } from "./presets";
import { NAMES } from "./stress";
import { type Component, COMPONENTS, type Store } from "./store";

interface Acts {
  preset: (key: string) => void;
  view: () => void;
}

export class Toolbar {
  private readonly presets: Choice<string>;
  private readonly components: Choice<Component>;
  private readonly mesh: HTMLButtonElement;

  constructor(
    private readonly store: Store,
    private readonly acts: Acts,
  ) {
    commands(store, () => store.hash, acts.view);
    this.presets = new Choice(byId("presets"), "preset", PRESETS, acts.preset);
    const stresses = COMPONENTS.map((key) => ({ key, name: NAMES[key], hint: "" }));
    this.components = new Choice(byId("components"), "component", stresses, (component) => this.view({ component }));
    const title = "The elements, moved by the load";
    this.mesh = button("Mesh", () => this.view({ mesh: !store.view.mesh }), { title });
    byId("components").append(this.mesh);
    byId("edges").addEventListener("click", () => this.view({ compare: !store.view.compare }));
    byId("noise").addEventListener("click", () => store.change({ seed: store.state.seed + 1 }));
  }

  /** Show what is chosen. */
  show(): void {
    const { store } = this;
    showCommands(store);
    this.presets.show(store.state.preset);
    this.components.show(store.view.component);
    press(this.mesh, store.view.mesh);
    press(byId("edges"), store.view.compare);
    byId("panel-edges").hidden = !store.view.compare;
  }

  private view(part: Partial<Store["view"]>): void {
    Object.assign(this.store.view, part);
    this.acts.view();
  }
}
