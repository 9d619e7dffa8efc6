/** Forces over the last seconds, a line for each tactel. */

import uPlot from "uplot";
import { inked } from "./colours";
import { element } from "./dom";
import { LEFT, RIGHT } from "./layout";
import type { Moment } from "./ring";

const HEIGHT = 130;
/** Seconds without a moment after which a line is not drawn on. */
const GAP = 0.5;
const FONT = "11px system-ui, sans-serif";
/** After Okabe and Ito, darkened or lightened by the style sheet; then again with dashes. */
const INKS = ["line-1", "line-2", "line-3", "line-4", "line-5", "line-6", "line-7"];
const DASHES = [undefined, [6, 3], [2, 2], [8, 3, 2, 3], [12, 4]];

export class History {
  private plot: uPlot | null = null;
  private made = "";
  private lines = 0;

  constructor(
    private readonly container: HTMLElement,
    private readonly title: string,
  ) {}

  build(lines: number): void {
    this.lines = lines;
    this.made = "";
  }

  /** Show some of the forces of each moment, from one of them on. */
  draw(width: number, theme: string, span: Moment[], from: number, count: number, seconds: number): void {
    const moments = span.flatMap((moment, k) => (after(span[k - 1], moment) > GAP ? [null, moment] : [moment]));
    const data: (number | null)[][] = [moments.map((moment, k) => (moment ?? moments[k - 1])?.time ?? 0)];
    for (let k = from; k < from + count; k++) {
      data.push(moments.map((moment) => (moment && Number.isFinite(moment.forces[k]) ? moment.forces[k] : null)));
    }
    const signature = `${width} ${theme} ${this.lines}`;
    if (signature !== this.made || !this.plot) {
      this.plot?.destroy();
      this.plot = new uPlot(this.settings(width, seconds), data as uPlot.AlignedData, this.container);
      this.made = signature;
    } else {
      this.plot.setData(data as uPlot.AlignedData);
    }
  }

  legend(count: number): HTMLElement[] {
    return Array.from({ length: count }, (_, k) => {
      const dashed = k < INKS.length ? "solid" : "dashed";
      return element("span", { class: `line ${INKS[k % INKS.length]} ${dashed}` }, `${k + 1}`);
    });
  }

  private settings(width: number, seconds: number): uPlot.Options {
    const axis = {
      stroke: inked("ink-soft"),
      font: FONT,
      grid: { stroke: inked("line"), width: 1 },
      ticks: { show: false },
    };
    return {
      width,
      height: HEIGHT,
      padding: [8, RIGHT, 0, 0],
      legend: { show: false },
      cursor: { show: false },
      select: { show: false, left: 0, top: 0, width: 0, height: 0 },
      scales: {
        x: { time: false, range: (_, __, high) => [high - seconds, high] },
        y: { range: (_, low, high) => [Math.min(low, -0.02), Math.max(high * 1.05, 0.1)] },
      },
      axes: [
        { ...axis, size: 24, values: (_, ticks) => ticks.map((tick) => (tick < 0 ? "" : `${tick} s`)) },
        { ...axis, size: LEFT - 14, label: this.title, labelSize: 14, labelFont: FONT, labelGap: 0, gap: 3 },
      ],
      series: [
        {},
        ...Array.from({ length: this.lines }, (_, k) => ({
          stroke: inked(INKS[k % INKS.length]),
          width: 1.5,
          dash: DASHES[Math.floor(k / INKS.length) % DASHES.length],
          points: { show: false },
        })),
      ],
    };
  }
}

function after(before: Moment | undefined, moment: Moment): number {
  return before ? moment.time - before.time : 0;
}
