/** Curves, below the strip's pictures and as wide. */

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { FONT } from "./canvas";
import { inked, isDark } from "./colours";
import { LEFT, RIGHT } from "./layout";

type Data = (number | null)[][] | Float32Array[];
type Range = (low: number, high: number) => [number, number];

interface Curve {
  label: string;
  ink: string;
  width?: number;
  dash?: number[];
}

interface Options {
  height: number;
  label: string;
  curves: Curve[];
  band?: [upper: number, lower: number];
  /** Ends of the upright axis, from those of the data. */
  range?: Range;
  /** The other axis, where it is not millimetres along the strip. */
  across?: Across;
  /** Upright lines, where there are any. */
  marks?: () => { at: number; dash: number[] }[];
}

interface Across {
  range: Range;
  tick: (value: number, last: boolean) => string;
  /** Where it has ticks, if not at round numbers. */
  places?: () => number[];
}

const ALONG: Across = {
  range: (low, high) => [low, high],
  tick: (value, last) => (last ? `${value} mm` : String(value)),
};

/** A plot that is made again when its width or the theme changes. */
export class Plot {
  private plot: uPlot | null = null;
  private made = "";

  constructor(
    private readonly container: HTMLElement,
    private readonly options: Options,
  ) {}

  draw(width: number, data: Data): void {
    const signature = `${width} ${isDark()}`;
    if (signature !== this.made) this.forget();
    this.made = signature;
    if (this.plot) this.plot.setData(data as uPlot.AlignedData);
    else this.plot = new uPlot(this.settings(width), data as uPlot.AlignedData, this.container);
  }

  /** Take the plot away until the next drawing, as when its range has changed. */
  forget(): void {
    this.plot?.destroy();
    this.plot = null;
  }

  private settings(width: number): uPlot.Options {
    const { height, label, curves, band, range, across = ALONG, marks } = this.options;
    const { places } = across;
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
        x: { time: false, range: (_, low, high) => across.range(low, high) },
        y: range ? { range: (_, low, high) => range(low, high) } : {},
      },
      axes: [
        {
          ...axis,
          size: 24,
          values: (_, ticks) => ticks.map((value, k) => across.tick(value, k === ticks.length - 1)),
          ...(places ? { splits: () => places() } : {}),
        },
        { ...axis, size: LEFT - 14, label, labelSize: 14, labelFont: FONT, labelGap: 0, gap: 3 },
      ],
      series: [{}, ...curves.map(series)],
      bands: band ? [{ series: band, fill: `${inked("read")}33` }] : [],
      hooks: marks ? { draw: [(plot) => draw(plot, marks())] } : {},
    };
  }
}

function draw(plot: uPlot, marks: { at: number; dash: number[] }[]): void {
  const { ctx, bbox } = plot;
  const density = window.devicePixelRatio || 1;
  ctx.save();
  ctx.strokeStyle = inked("ink-soft");
  ctx.lineWidth = density;
  for (const { at, dash } of marks) {
    const x = Math.round(plot.valToPos(at, "x", true)) + 0.5;
    ctx.setLineDash(dash.map((length) => length * density));
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
  }
  ctx.restore();
}

function series({ label, ink, width = 1.5, dash }: Curve): uPlot.Series {
  const stroke = width === 0 ? "transparent" : inked(ink);
  return { label, stroke, width, dash, points: { show: false } };
}
