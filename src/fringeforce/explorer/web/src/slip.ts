/** How near each tactel is to slipping: tangential over normal force against the friction. */

import { set, shape } from "./dom";
import { LEFT, type Layout, RIGHT } from "./layout";
import { type Model, niceAbove } from "./model";
import type { Moment } from "./ring";

const HEIGHT = 120;
const TOP = 10;
const BOTTOM = 24;

export class Slip {
  private readonly svg = shape("svg", { class: "slip", role: "img", "aria-label": "Nothing read yet." });
  private readonly ground = shape("g");
  private readonly limit = shape("line", { class: "limit" });
  private readonly bars = shape("g");
  private drawn = "";

  constructor(container: HTMLElement) {
    this.svg.append(this.ground, this.bars, this.limit);
    container.append(this.svg);
  }

  draw(model: Model, moment: Moment, place: Layout, friction: number): void {
    const n = model.tactels.length;
    const high = niceAbove(1.4 * friction);
    const y = (ratio: number) => TOP + (1 - Math.min(ratio / high, 1.04)) * (HEIGHT - TOP - BOTTOM);
    const signature = `${model.id} ${place.width} ${high}`;
    if (signature !== this.drawn) {
      set(this.svg, { width: place.width, height: HEIGHT, viewBox: `0 0 ${place.width} ${HEIGHT}` });
      this.ground.replaceChildren(...grid(model, place, high, y));
      this.bars.replaceChildren(...Array.from({ length: n }, () => shape("rect", {})));
      this.drawn = signature;
    }
    const wide = Math.max(2, Math.min(18, ((place.width - LEFT - RIGHT) / n) * 0.5));
    const words: string[] = [];
    [...this.bars.children].forEach((bar, i) => {
      const touching = moment.touching.includes(i);
      const slipping = moment.slipping.includes(i);
      const ratio = touching ? Math.abs(moment.forces[n + i]) / Math.max(moment.forces[i], 1e-9) : 0;
      const top = y(ratio);
      set(bar, {
        class: slipping ? "slipping" : "holding",
        x: place.across(model.tactels[i]) - wide / 2,
        y: top,
        width: wide,
        height: Math.max(y(0) - top, 0),
      });
      if (touching) words.push(`tactel ${i + 1}: ${ratio.toFixed(2)}${slipping ? ", near slip" : ""}`);
    });
    set(this.limit, { x1: LEFT, x2: place.width - RIGHT, y1: y(friction), y2: y(friction) });
    const told = words.join("; ") || "nothing touches";
    set(this.svg, { "aria-label": `Tangential over normal force, friction ${friction}. ${told}.` });
  }
}

function grid(model: Model, place: Layout, high: number, y: (ratio: number) => number): SVGElement[] {
  const found = [0, high / 2, high].flatMap((ratio) => [
    shape("line", { class: ratio ? "grid" : "zero", x1: LEFT, x2: place.width - RIGHT, y1: y(ratio), y2: y(ratio) }),
    shape("text", { class: "label", x: LEFT - 6, y: y(ratio) + 4, "text-anchor": "end" }, `${Number(ratio.toPrecision(3))}`),
  ]);
  const every = Math.ceil(24 / (place.scale * (model.tactels[1] - model.tactels[0] || 1)));
  model.tactels.forEach((x, i) => {
    if (i % every) return;
    const at = { class: "label", x: place.across(x), y: HEIGHT - 8, "text-anchor": "middle" };
    found.push(shape("text", at, `${i + 1}`));
  });
  return found;
}
