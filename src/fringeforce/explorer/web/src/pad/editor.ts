/** The selected contact in numbers. */

import { byId, element, set } from "../dom";
import { type Contact, FINGER, LIMITS, mostTwist } from "./contacts";
import type { PadStore } from "./store";

interface Row {
  field: HTMLInputElement;
  slider: HTMLInputElement;
}

type Key = keyof Contact | "friction";

const NAMES: [Key, string, string, number][] = [
  ["normal", "Normal force", "N", 0.5],
  ["radius", "Radius", "mm", 0.1],
  ["x", "Place x", "mm", 0.1],
  ["y", "Place y", "mm", 0.1],
  ["shearX", "Shear along x", "N", 0.1],
  ["shearY", "Shear along y", "N", 0.1],
  ["twist", "Twist", "N mm", 0.5],
  ["friction", "Friction of all", "", 0.05],
];

export class Editor {
  private readonly rows = new Map<Key, Row>();
  private readonly radius = element("span");
  private readonly title = byId("contact-title");
  private readonly add = byId<HTMLButtonElement>("add");
  private readonly remove = byId<HTMLButtonElement>("remove");

  constructor(private readonly store: PadStore) {
    byId("editor").append(...NAMES.map((about) => this.made(...about)));
    this.add.addEventListener("click", () => store.add(FINGER));
    this.remove.addEventListener("click", () => store.remove(store.view.selected));
  }

  show(): void {
    const { state, view, reach, selected } = this.store;
    this.title.textContent = selected ? `Contact ${view.selected + 1} of ${state.contacts.length}` : "No contact";
    this.remove.disabled = !selected;
    for (const [key, { field, slider }] of this.rows) {
      const value = key === "friction" ? state.friction : selected?.[key];
      const [low, high] = limits(key, selected ?? FINGER, state.friction, reach);
      const text = value === undefined ? "" : `${Number(value.toFixed(2))}`;
      for (const input of [field, slider]) {
        input.disabled = value === undefined;
        set(input, { min: low, max: high });
        if (document.activeElement !== input && input.value !== text) input.value = text;
      }
    }
  }

  /** Fingers on a skin are spheres, and do not twist. */
  suit(skin: boolean): void {
    (byId("contact-twist").parentElement as HTMLElement).hidden = skin;
    this.radius.textContent = skin ? "Radius of the fingertip" : "Radius of the patch";
  }

  private made(key: Key, name: string, unit: string, step: number): HTMLElement {
    const id = `contact-${key}`;
    const field = element("input", { id, type: "number", step: "any" });
    const slider = element("input", { type: "range", step, "aria-label": `${name}, slider` });
    const label = element("label", { for: id }, key === "radius" ? this.radius : name);
    if (unit) label.append(element("small", {}, ` ${unit}`));
    slider.addEventListener("input", () => this.set(key, slider.valueAsNumber, false));
    slider.addEventListener("change", () => this.store.commit());
    field.addEventListener("change", () => {
      field.setAttribute("aria-invalid", `${!field.validity.valid}`);
      if (field.reportValidity() && Number.isFinite(field.valueAsNumber)) this.set(key, field.valueAsNumber, true);
    });
    this.rows.set(key, { field, slider });
    return element("div", { class: "control" }, label, field, slider);
  }

  private set(key: Key, value: number, commit: boolean): void {
    if (key === "friction") this.store.rub(value);
    else this.store.touch(this.store.view.selected, { [key]: value }, commit);
  }
}

function limits(key: Key, contact: Contact, friction: number, half: [number, number]): [number, number] {
  if (key === "x") return [-half[0], half[0]];
  if (key === "y") return [-half[1], half[1]];
  if (key === "normal" || key === "radius" || key === "friction") return [...LIMITS[key]];
  const most = key === "twist" ? mostTwist(contact, friction) : friction * contact.normal;
  const shown = Math.ceil(most * 100) / 100;
  return [-shown, shown];
}
