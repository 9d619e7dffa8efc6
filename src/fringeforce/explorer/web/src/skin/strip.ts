/** The strip from the side, with the fingers that press on it. */

import { byId, set, shape, sized } from "../dom";
import { type Layout, layout } from "../layout";
import { clamped } from "../numbers";
import { type Finger, FRICTION, LIMITS, worded } from "./fingers";
import type { SkinModel } from "./model";
import type { SkinStore } from "./store";

const AIR = 96;
/** Radius of a circle [px] for a radius [mm]: large ones are drawn smaller, or they would hide others. */
const drawn = (radius: number) => 9 + 3.4 * radius;
/** Newtons for a pixel that a finger is dragged down. */
const HARDER = 0.02;
const STEPS = { place: 0.1, force: 0.1 };

interface Drag {
  number: number;
  x: number;
  y: number;
  from: Finger;
}

export class StripView {
  private readonly svg = shape("svg", { role: "group", "aria-label": "Strip from the side" });
  private readonly ground = shape("g");
  private readonly marks = shape("g");
  private place: Layout | null = null;
  private drag: Drag | null = null;

  constructor(private readonly store: SkinStore) {
    this.svg.append(this.ground, this.marks);
    byId("strip").append(this.svg);
    this.svg.addEventListener("pointerdown", (event) => this.pressed(event));
    this.svg.addEventListener("pointermove", (event) => this.moved(event));
    for (const end of ["pointerup", "pointercancel"] as const) this.svg.addEventListener(end, () => this.released());
    this.svg.addEventListener("keydown", (event) => this.key(event));
  }

  draw(model: SkinModel, width: number): void {
    const { length } = model.facts.strip;
    const place = layout(width, length);
    this.place = place;
    const [cover, clear] = model.facts.layers.map((thickness) => thickness * place.scale);
    sized(this.svg, width, AIR + cover + clear);
    const left = place.across(-length / 2);
    const box = (kind: string, y: number, height: number) =>
      shape("rect", { class: kind, x: left, y, width: length * place.scale, height });
    const [first, last] = [-0.5, 0.5].map((side) => place.across(side * model.extent));
    this.ground.replaceChildren(
      box("cover", AIR, cover),
      box("clear", AIR + cover, clear),
      shape("line", { class: "skin", x1: first, x2: last, y1: AIR, y2: AIR }),
    );
    const { fingers } = this.store.state;
    const focused = document.activeElement?.getAttribute("data-finger");
    while (this.marks.childElementCount > fingers.length) this.marks.lastElementChild?.remove();
    while (this.marks.childElementCount < fingers.length) this.marks.append(made(this.marks.childElementCount));
    fingers.forEach((finger, i) => this.put(this.marks.children[i], finger, i));
    if (focused) (this.marks.children[Number(focused)] as SVGElement | undefined)?.focus({ preventScroll: true });
  }

  private put(group: Element, finger: Finger, number: number): void {
    if (!this.place) return;
    const [circle, pull, name] = [...group.children];
    const x = this.place.across(finger.x * 1e-3);
    const radius = drawn(finger.radius);
    const y = AIR - radius + finger.normal;
    set(circle, { cx: x, cy: y, r: radius });
    set(pull, { x1: x, x2: x + finger.tangential * 40, y1: AIR - 3, y2: AIR - 3 });
    set(name, { x, y: y + 4 });
    set(group, {
      class: number === this.store.selected ? "finger selected" : "finger",
      "aria-label": `Finger ${number + 1}: ${worded(finger)}`,
    });
  }

  private pressed(event: PointerEvent): void {
    if (!this.place) return;
    const group = (event.target as Element).closest("[data-finger]");
    let number = Number(group?.getAttribute("data-finger") ?? -1);
    if (!group) {
      if (!this.store.add({ x: this.millimetres(event) }, false)) return;
      number = this.store.selected;
    }
    this.store.selected = number;
    this.drag = { number, x: event.clientX, y: event.clientY, from: this.store.state.fingers[number] };
    this.svg.setPointerCapture(event.pointerId);
    this.store.change({}, false);
    (this.marks.children[number] as SVGElement | undefined)?.focus({ preventScroll: true });
    event.preventDefault();
  }

  private moved(event: PointerEvent): void {
    if (!this.drag || !this.place) return;
    const { number, x, y, from } = this.drag;
    const along = ((event.clientX - x) / this.place.scale) * 1e3;
    const normal = clamped(from.normal + (event.clientY - y) * HARDER, ...LIMITS.normal);
    this.store.touch(number, { x: from.x + along, normal }, false);
  }

  private released(): void {
    if (this.drag) this.store.commit();
    this.drag = null;
  }

  private key(event: KeyboardEvent): void {
    const number = Number((event.target as Element).getAttribute("data-finger") ?? -1);
    const finger = this.store.state.fingers[number];
    if (!finger) return;
    this.store.selected = number;
    const side = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const force = { "+": 1, "=": 1, "-": -1, ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (side && event.shiftKey) {
      const tangential = finger.tangential + side * STEPS.force * FRICTION;
      this.store.touch(number, { tangential });
    } else if (side) this.store.touch(number, { x: finger.x + side * STEPS.place });
    else if (force) this.store.touch(number, { normal: finger.normal + force * STEPS.force });
    else if (event.key === "Delete" || event.key === "Backspace") this.store.remove(number);
    else return;
    event.preventDefault();
  }

  private millimetres(event: PointerEvent): number {
    const [box, place] = [this.svg.getBoundingClientRect(), this.place as Layout];
    return ((event.clientX - box.left - place.across(0)) / place.scale) * 1e3;
  }
}

function made(number: number): SVGElement {
  const group = shape("g", { class: "finger", "data-finger": number, tabindex: 0, role: "button" });
  group.append(shape("circle"), shape("line"), shape("text", { "text-anchor": "middle" }, `${number + 1}`));
  return group;
}
