/** Forces over the last seconds, a line for each tactel. */

import { element } from "./dom";
import { Plot } from "./plots";
import type { Moment } from "./ring";

const HEIGHT = 130;
/** Seconds without a moment after which a line is not drawn on. */
const GAP = 0.5;
/** After Okabe and Ito, darkened or lightened by the style sheet; then again with dashes. */
const INKS = ["line-1", "line-2", "line-3", "line-4", "line-5", "line-6", "line-7"];
const DASHES = [undefined, [6, 3], [2, 2], [8, 3, 2, 3], [12, 4]];

export class History {
  private plot: Plot | null = null;
  private lines = 0;

  /** Of every so many numbers of the forces, from the first given on, over so many seconds. */
  constructor(
    private readonly container: HTMLElement,
    private readonly title: string,
    private readonly first: number,
    private readonly every: number,
    private readonly seconds: number,
  ) {}

  /** Make ready for a number of tactels. */
  build(lines: number): void {
    this.lines = lines;
    this.plot?.forget();
    this.plot = new Plot(this.container, {
      height: HEIGHT,
      label: this.title,
      curves: Array.from({ length: lines }, (_, k) => ({
        label: `${k + 1}`,
        ink: INKS[k % INKS.length],
        dash: DASHES[Math.floor(k / INKS.length) % DASHES.length],
      })),
      range: (low, high) => [Math.min(low, -0.02), Math.max(high * 1.05, 0.1)],
      across: {
        range: (_, high) => [high - this.seconds, high],
        tick: (time) => (time < 0 ? "" : `${time} s`),
      },
    });
  }

  draw(width: number, span: Moment[]): void {
    const moments = span.flatMap((moment, k) => (after(span[k - 1], moment) > GAP ? [null, moment] : [moment]));
    const times = moments.map((moment, k) => (moment ?? moments[k - 1])?.time ?? 0);
    const forces = Array.from({ length: this.lines }, (_, k) => {
      const at = this.first + k * this.every;
      return moments.map((moment) => (moment && Number.isFinite(moment.forces[at]) ? moment.forces[at] : null));
    });
    this.plot?.draw(width, [times, ...forces]);
  }

  legend(): HTMLElement[] {
    return Array.from({ length: this.lines }, (_, k) => {
      const dashed = k < INKS.length ? "solid" : "dashed";
      return element("span", { class: `line ${INKS[k % INKS.length]} ${dashed}` }, `${k + 1}`);
    });
  }
}

function after(before: Moment | undefined, moment: Moment): number {
  return before ? moment.time - before.time : 0;
}
