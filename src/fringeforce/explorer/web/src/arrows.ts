/** Force arrows: every tactel has a normal and a tangential slider, and the tail can be dragged. */

import { set, shape } from "./dom";
import { LEFT, type Layout } from "./layout";
import type { Model } from "./model";
import { clamped, hundredths, largest } from "./numbers";
import type { Store } from "./store";

export const MOST = 50;
const STEP = 0.05;
const LEAP = 0.5;
const SCALES = [0.5, 1, 2, 4, 8, 16, 32, 64];
const REACH = 104;

type Direction = "normal" | "tangential";

interface Arrow {
  group: SVGGElement;
  shaft: SVGLineElement;
  head: SVGPathElement;
  share: SVGLineElement;
  tail: SVGGElement;
  foot: SVGGElement;
}

interface Drag {
  tactel: number;
  direction: Direction | "both";
}

export class Arrows {
  readonly group = shape("g", { class: "arrows" });
  private readonly measure = shape("g", { class: "measure" });
  private readonly hint = shape("text", { class: "hint", "text-anchor": "middle" });
  private readonly value = shape("text", { class: "value", "text-anchor": "middle" });
  /** Whether a force was ever taken in hand. */
  private used = false;
  private arrows: Arrow[] = [];
  private drag: Drag | null = null;
  private full = 2;
  private place: Layout | null = null;
  private model: Model | null = null;

  constructor(
    private readonly store: Store,
    private readonly surface: number,
    private readonly onGesture: () => void,
  ) {
    this.group.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"]) {
      this.group.addEventListener(end, () => this.release());
    }
  }

  draw(model: Model, place: Layout): void {
    this.model = model;
    this.place = place;
    const { normal, tangential } = this.store.state;
    if (this.arrows.length !== normal.length) this.build(normal.length);
    if (!this.drag) this.rescale(largest([...normal, ...tangential]));
    this.gauge();
    normal.forEach((force, i) => this.put(i, force, tangential[i]));
    this.tell(normal, tangential);
  }

  /** Loads that are chosen set the scale; a drag leaves it, unless it ends where the scale does. */
  private rescale(peak: number): void {
    if (!this.store.state.preset && peak < 0.95 * this.full) return;
    this.full = SCALES.find((scale) => scale >= peak * 1.1 && scale >= 2) ?? 64;
  }

  /** The forces of the tactel in hand, or where to take one. */
  private tell(normal: number[], tangential: number[]): void {
    if (!this.place || !this.model) return;
    const { tactels } = this.model;
    this.hint.replaceChildren(this.used ? "" : "Drag a dot: up presses harder, sideways shears.");
    const middle = this.place.across((tactels[0] + tactels[tactels.length - 1]) / 2);
    set(this.hint, { x: middle, y: this.surface - REACH - 4 });
    if (!this.drag) {
      this.value.replaceChildren();
      return;
    }
    const i = this.drag.tactel;
    const words = `${normal[i].toFixed(2)} N down, ${Math.abs(tangential[i]).toFixed(2)} N ${tangential[i] < 0 ? "left" : "right"}`;
    this.value.replaceChildren(words);
    set(this.value, { x: this.place.across(tactels[i]), y: this.surface - REACH - 12 });
  }

  private get perNewton(): number {
    return REACH / this.full;
  }

  /** How long an arrow of half the scale is, beside the strip. */
  private gauge(): void {
    const name = `${this.full / 2} N`;
    if (this.measure.dataset.name === name) return;
    this.measure.dataset.name = name;
    const [x, top] = [LEFT - 10, this.surface - REACH / 2];
    const ends = [top, this.surface].map((y) => shape("line", { x1: x - 4, x2: x + 4, y1: y, y2: y }));
    this.measure.replaceChildren(
      shape("line", { x1: x, x2: x, y1: top, y2: this.surface }),
      ...ends,
      shape("text", { class: "label", x: x - 7, y: top + REACH / 4 + 4, "text-anchor": "end" }, name),
    );
  }

  private build(n: number): void {
    this.arrows = Array.from({ length: n }, (_, i) => this.made(i));
    const arrows = this.arrows.map((arrow) => arrow.group);
    this.group.replaceChildren(this.measure, ...arrows, this.hint, this.value);
  }

  private made(tactel: number): Arrow {
    const shaft = shape("line", { class: "shaft" });
    const head = shape("path", { class: "head", d: "M0 0L-4.5 -9L4.5 -9Z" });
    const share = shape("line", { class: "share" });
    const tail = this.handle(tactel, "normal", shape("circle", { class: "dot", r: 6 }));
    const foot = this.handle(tactel, "tangential", shape("path", { class: "dot", d: "M0 -5L5 0L0 5L-5 0Z" }));
    const group = shape("g", {}, share, shaft, head, foot, tail);
    return { group, shaft, head, share, tail, foot };
  }

  private handle(tactel: number, direction: Direction, dot: SVGElement): SVGGElement {
    const reach = shape("circle", { class: "reach", r: direction === "normal" ? 12 : 8 });
    const slider = shape(
      "g",
      {
        class: `handle ${direction}`,
        role: "slider",
        tabindex: 0,
        "aria-label": `Tactel ${tactel + 1}, ${direction} force`,
        "aria-valuemin": -MOST,
        "aria-valuemax": MOST,
        "aria-orientation": direction === "normal" ? "vertical" : "horizontal",
      },
      reach,
      dot,
    );
    slider.addEventListener("keydown", (event) => this.press(event, tactel, direction));
    slider.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      slider.focus({ preventScroll: true });
      this.group.setPointerCapture(event.pointerId);
      this.drag = { tactel, direction: direction === "normal" ? "both" : direction };
      this.used = true;
    });
    return slider;
  }

  private put(tactel: number, normal: number, tangential: number): void {
    if (!this.place || !this.model) return;
    const arrow = this.arrows[tactel];
    const k = this.perNewton;
    const tip = [this.place.across(this.model.tactels[tactel]), this.surface];
    const tail = [tip[0] - tangential * k, tip[1] - normal * k];
    const size = Math.hypot(normal, tangential) * k;
    const angle = (Math.atan2(tangential, normal) * -180) / Math.PI;
    set(arrow.shaft, { x1: tail[0], y1: tail[1], x2: tip[0], y2: tip[1] });
    set(arrow.head, {
      transform: `translate(${tip[0]} ${tip[1]}) rotate(${angle})`,
      visibility: size > 5 ? "visible" : "hidden",
    });
    const foot = [tip[0] + tangential * k, this.surface + 9];
    set(arrow.share, { x1: tip[0], x2: foot[0], y1: foot[1], y2: foot[1] });
    set(arrow.tail, { transform: `translate(${tail[0]} ${tail[1]})`, ...worded(normal) });
    set(arrow.foot, { transform: `translate(${foot[0]} ${foot[1]})`, ...worded(tangential) });
  }

  private move(event: PointerEvent): void {
    if (!this.drag || !this.place || !this.model) return;
    const { tactel, direction } = this.drag;
    const frame = (this.group.ownerSVGElement as SVGSVGElement).getBoundingClientRect();
    const tip = this.place.across(this.model.tactels[tactel]);
    const across = (event.clientX - frame.left - tip) / this.perNewton;
    const up = (this.surface - (event.clientY - frame.top)) / this.perNewton;
    if (direction === "both") this.force(tactel, up, event.shiftKey ? undefined : -across);
    else this.force(tactel, undefined, across);
  }

  private release(): void {
    if (!this.drag) return;
    this.drag = null;
    this.value.replaceChildren();
    this.store.commit();
    this.onGesture();
  }

  /** Set one or both forces of a tactel while a gesture lasts. */
  private force(tactel: number, normal?: number, tangential?: number): void {
    const { state } = this.store;
    const change = (values: number[], value: number | undefined, low: number) =>
      value === undefined
        ? values
        : values.map((old, i) => (i === tactel ? hundredths(clamped(value, low, this.full)) : old));
    this.store.change(
      {
        preset: "",
        normal: change(state.normal, normal, 0),
        tangential: change(state.tangential, tangential, -this.full),
      },
      false,
    );
  }

  private press(event: KeyboardEvent, tactel: number, direction: Direction): void {
    const steps: Record<string, number> = {
      ArrowUp: STEP,
      ArrowRight: STEP,
      ArrowDown: -STEP,
      ArrowLeft: -STEP,
      PageUp: LEAP,
      PageDown: -LEAP,
    };
    const old = this.store.state[direction][tactel];
    let next: number;
    if (event.key in steps) next = old + steps[event.key];
    else if (event.key === "Home") next = 0;
    else if (event.key === "End") next = this.full;
    else return;
    event.preventDefault();
    this.used = true;
    const values = this.store.state[direction].slice();
    values[tactel] = hundredths(clamped(next, -MOST, MOST));
    this.store.change({ preset: "", [direction]: values });
  }
}

function worded(value: number): Record<string, string> {
  const text = value.toFixed(2);
  return { "aria-valuenow": text, "aria-valuetext": `${text} newtons` };
}
