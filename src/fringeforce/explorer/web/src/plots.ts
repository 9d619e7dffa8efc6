/** Curves along the strip, below the pictures and on the same scale. */

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { inked } from "./colours";
import { LEFT, RIGHT } from "./layout";

type Data = (number | null)[][] | Float32Array[];

export interface Curve {
  label: string;
  ink: string;
  width?: number;
  dash?: number[];
  points?: boolean;
}

interface Options {
  height: number;
  unit: string;
  curves: Curve[];
  band?: [upper: number, lower: number];
  range?: (low: number, high: number) => [number, number];
}

const FONT = "11px system-ui, sans-serif";

/** A plot over x in millimetres; it is made again when its width or the theme changes. */
export class AlongStrip {
  private plot: uPlot | null = null;
  private made = "";

  constructor(
    private readonly container: HTMLElement,
    private readonly options: Options,
  ) {}

  draw(width: number, theme: string, data: Data): void {
    const signature = `${width} ${theme}`;
    if (signature !== this.made || !this.plot) {
      this.plot?.destroy();
      this.plot = new uPlot(this.settings(width), data as uPlot.AlignedData, this.container);
      this.made = signature;
    } else {
      this.plot.setData(data as uPlot.AlignedData);
    }
  }

  /** Make the plot again at the next drawing, as when its range has changed. */
  forget(): void {
    this.made = "";
  }

  private settings(width: number): uPlot.Options {
    const { height, unit, curves, band, range } = this.options;
    const axis = {
      stroke: inked("ink-soft"),
      font: FONT,
      grid: { stroke: inked("line"), width: 1 },
      ticks: { show: false },
    };
    return {
      width,
      height,
      padding: [8, RIGHT, 0, 0],
      legend: { show: false },
      cursor: { show: false },
      select: { show: false, left: 0, top: 0, width: 0, height: 0 },
      scales: {
        x: { time: false, range: (_, low, high) => [low, high] },
        y: range ? { range: (_, low, high) => range(low, high) } : {},
      },
      axes: [
        { ...axis, size: 24, values: (_, ticks) => ticks.map((tick) => `${tick}`) },
        { ...axis, size: LEFT - 14, label: unit, labelSize: 14, labelFont: FONT, labelGap: 0, gap: 3 },
      ],
      series: [{}, ...curves.map(series)],
      bands: band ? [{ series: band, fill: `${inked("read")}33` }] : [],
    };
  }
}

function series(curve: Curve): uPlot.Series {
  return {
    label: curve.label,
    stroke: curve.width === 0 ? "transparent" : inked(curve.ink),
    width: curve.width ?? 1.5,
    dash: curve.dash,
    points: { show: false },
  };
}
