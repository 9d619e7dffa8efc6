/** Forces read from a line, beside the true ones where they are known, with bars of two standard deviations. */

import { set, shape, sized } from "./dom";
import { BOTTOM, levels, tactelNumbers, TOP } from "./ground";
import type { Layout } from "./layout";
import type { Estimate, Model } from "./model";
import { clamped, niceAbove } from "./numbers";

type Truth = { normal: number[]; tangential: number[] };

const HEIGHT = 150;

interface Marks {
  bar: SVGLineElement;
  dot: SVGElement;
  truth: SVGLineElement;
}

export class Readings {
  private readonly svg = shape("svg", { class: "readings", role: "img", "aria-label": "No reading yet." });
  private readonly frame = shape("g");
  private readonly marks = shape("g");
  private pairs: [Marks, Marks][] = [];
  private drawn = "";
  private high = 0;
  private low = 0;

  constructor(container: HTMLElement) {
    this.svg.append(this.frame, this.marks);
    container.append(this.svg);
  }

  /** Show forces on a scale that holds the true ones, or the lowest and highest given. */
  draw(
    model: Model, state: Truth | null, reading: Estimate | null, place: Layout,
    [least, most]: [number, number] = extremes(state),
  ): void {
    const n = model.tactels.length;
    if (this.pairs.length !== n) this.build(n);
    const peak = Math.max(most, 0.1);
    const deep = Math.min(least, 0);
    [this.high, this.low] = [niceAbove(peak * 1.12), deep < 0 ? -niceAbove(-deep * 1.12) : -0.1 * niceAbove(peak * 1.12)];
    const signature = `${model.id} ${place.width} ${this.high} ${this.low}`;
    if (signature !== this.drawn) {
      sized(this.svg, place.width, HEIGHT);
      this.frame.replaceChildren(...this.grid(model, place));
      this.drawn = signature;
    }
    const shift = Math.min(5, place.scale * 0.0002);
    this.pairs.forEach((pair, i) => {
      const x = place.across(model.tactels[i]);
      this.put(pair[0], x - shift, state?.normal[i], reading, 2 * i, n);
      this.put(pair[1], x + shift, state?.tangential[i], reading, 2 * i + 1, n);
    });
    set(this.svg, { "aria-label": spoken(n, state, reading) });
  }

  private y(force: number): number {
    const share = (this.high - force) / (this.high - this.low);
    return TOP + clamped(share, -0.1, 1.1) * (HEIGHT - TOP - BOTTOM);
  }

  private put(m: Marks, x: number, truth: number | undefined, reading: Estimate | null, i: number, n: number): void {
    set(m.truth, { visibility: truth === undefined ? "hidden" : "visible" });
    const level = this.y(truth ?? 0);
    set(m.truth, { x1: x - 6, x2: x + 6, y1: level, y2: level });
    const value = reading?.forces[i];
    const usable = value !== undefined && Number.isFinite(value) && reading?.forces.length === 2 * n;
    for (const mark of [m.bar, m.dot]) set(mark, { visibility: usable ? "visible" : "hidden" });
    if (!usable || !reading) return;
    const spread = 2 * reading.std[i];
    set(m.bar, { x1: x, x2: x, y1: this.y(value - spread), y2: this.y(value + spread) });
    set(m.dot, { transform: `translate(${x} ${this.y(value)})` });
  }

  private build(n: number): void {
    const marks = (kind: string, dot: SVGElement): Marks => ({
      bar: shape("line", { class: `bar ${kind}` }),
      dot,
      truth: shape("line", { class: "truth" }),
    });
    this.pairs = Array.from({ length: n }, () => [
      marks("normal", shape("circle", { class: "point normal", r: 3.5 })),
      marks("tangential", shape("path", { class: "point tangential", d: "M0 -4.4L4.4 0L0 4.4L-4.4 0Z" })),
    ]);
    this.marks.replaceChildren(
      ...this.pairs.flatMap((pair) => pair.flatMap(({ truth, bar, dot }) => [truth, bar, dot])),
    );
  }

  private grid(model: Model, place: Layout): SVGElement[] {
    const step = niceAbove((this.high - this.low) / 6);
    const lowest = Math.ceil(this.low / step);
    const count = Math.floor(this.high / step + 1e-9) - lowest + 1;
    const values = Array.from({ length: count }, (_, k) => (lowest + k) * step);
    const middle = { class: "label", x: 10, y: HEIGHT / 2, transform: `rotate(-90 10 ${HEIGHT / 2})`, "text-anchor": "middle" };
    return [
      ...levels(values, (force) => this.y(force), place),
      ...tactelNumbers(model, HEIGHT, place),
      shape("text", middle, "N"),
    ];
  }
}

function extremes(state: Truth | null): [number, number] {
  const forces = state ? [...state.normal, ...state.tangential] : [];
  return [Math.min(...forces, 0), Math.max(...forces, 0)];
}

function spoken(n: number, state: Truth | null, reading: Estimate | null): string {
  if (!reading) return "No reading yet.";
  const of = (truth: number | undefined) => (truth === undefined ? "" : ` of ${truth.toFixed(2)}`);
  const parts = Array.from({ length: n }, (_, i) => {
    const [normal, tangential] = [reading.forces[2 * i], reading.forces[2 * i + 1]];
    return `tactel ${i + 1}: normal ${normal?.toFixed(2)}${of(state?.normal[i])}, tangential ${tangential?.toFixed(2)}${of(state?.tangential[i])}`;
  });
  return `Forces read${state ? ", of the true ones" : ""}, in newtons. ${parts.join("; ")}.`;
}
