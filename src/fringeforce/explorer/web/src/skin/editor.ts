/** The selected finger in numbers. */

import { byId, element, set } from "../dom";
import { type Finger, FINGER, FRICTION, LIMITS } from "./fingers";
import type { SkinStore } from "./store";

const NAMES: [keyof Finger, string, string, number][] = [
  ["normal", "Normal force", "N", 0.05],
  ["tangential", "Shear", "N", 0.05],
  ["x", "Place", "mm", 0.05],
  ["radius", "Radius", "mm", 0.1],
];

export class Editor {
  private readonly rows = new Map<keyof Finger, HTMLInputElement[]>();

  constructor(private readonly store: SkinStore) {
    byId("editor").append(...NAMES.map((about) => this.made(...about)));
    byId("add").addEventListener("click", () => store.add({}));
    byId("remove").addEventListener("click", () => store.remove(store.selected));
  }

  show(): void {
    const { state, selected, half, finger } = this.store;
    byId("contact-title").textContent = finger ? `Finger ${selected + 1} of ${state.fingers.length}` : "No finger";
    byId<HTMLButtonElement>("remove").disabled = !finger;
    for (const [key, inputs] of this.rows) {
      const [min, max] = limits(key, finger ?? FINGER, half);
      for (const input of inputs) {
        input.disabled = !finger;
        set(input, { min, max });
        const text = finger ? `${Number(finger[key].toFixed(2))}` : "";
        if (document.activeElement !== input && input.value !== text) input.value = text;
      }
    }
  }

  private made(key: keyof Finger, name: string, unit: string, step: number): HTMLElement {
    const id = `finger-${key}`;
    const field = element("input", { id, type: "number", step: "any" });
    const slider = element("input", { type: "range", step, "aria-label": `${name}, slider` });
    const label = element("label", { for: id }, name, element("small", {}, ` ${unit}`));
    slider.addEventListener("input", () => this.store.touch(this.store.selected, { [key]: slider.valueAsNumber }, false));
    slider.addEventListener("change", () => this.store.commit());
    field.addEventListener("change", () => {
      if (field.reportValidity() && Number.isFinite(field.valueAsNumber)) {
        this.store.touch(this.store.selected, { [key]: field.valueAsNumber });
      }
    });
    this.rows.set(key, [field, slider]);
    return element("div", { class: "control" }, label, field, slider);
  }
}

function limits(key: keyof Finger, finger: Finger, half: number): [number, number] {
  if (key === "x") return [-half, half];
  if (key !== "tangential") return [...LIMITS[key]];
  const most = Math.floor(FRICTION * finger.normal * 100) / 100;
  return [-most, most];
}
