/** How near each tactel is to slipping: tangential over normal force against the friction. */

import { set, shape, sized } from "./dom";
import { BOTTOM, levels, tactelNumbers, TOP } from "./ground";
import { LEFT, type Layout, RIGHT } from "./layout";
import type { Model } from "./model";
import { clamped, niceAbove } from "./numbers";
import type { Moment } from "./ring";

const HEIGHT = 120;

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
      sized(this.svg, place.width, HEIGHT);
      this.ground.replaceChildren(...levels([0, high / 2, high], y, place), ...tactelNumbers(model, HEIGHT, place));
      this.bars.replaceChildren(...Array.from({ length: n }, () => shape("rect", {})));
      this.drawn = signature;
    }
    const wide = clamped(((place.width - LEFT - RIGHT) / n) * 0.5, 2, 18);
    const words: string[] = [];
    [...this.bars.children].forEach((bar, i) => {
      const touching = moment.touching.includes(i);
      const slipping = moment.slipping.includes(i);
      const ratio = touching ? Math.abs(moment.forces[2 * i + 1]) / Math.max(moment.forces[2 * i], 1e-9) : 0;
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
