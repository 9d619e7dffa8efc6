/** Forces of the tactels from above: discs as large as normal forces, arrows as long as shear. */

import { prepared } from "../canvas";
import { inked } from "../colours";
import { blankCanvas, set, shape } from "../dom";
import { niceAbove } from "../numbers";
import type { PadModel, Reading } from "./model";

/** What was read, as far as it is drawn. */
type Forces = Pick<Reading, "forces" | "std">;

const SMALLEST = 0.02;
const HEAD = 3.5;
/** Full scales: finer than 1, 2, 5, so that the discs fill their cells. */
const STEPS = [1, 1.5, 2, 3, 4, 5, 7, 10];

interface Scale {
  /** Disc that fills a cell, and arrow as long as one and a half cells [N]. */
  normal: number;
  shear: number;
}

export class ForceMap {
  private readonly canvas = blankCanvas();
  /** What the key shows, so that it is made anew only where that changes. */
  private told = "";

  constructor(
    private readonly container: HTMLElement,
    private readonly legend: HTMLElement,
  ) {
    container.append(this.canvas);
  }

  draw(model: PadModel, truth: Float32Array | null, reading: Forces | null): void {
    const [halfX, halfY] = model.half;
    const width = this.container.clientWidth;
    const scale = width / (2 * halfX);
    const context = prepared(this.canvas, width, 2 * halfY * scale);
    const cell = model.facts.tactels.pitch * 1e3 * scale;
    const read = reading && reading.forces.length === 3 * model.tactels ? reading.forces : null;
    const full = scaled([truth, read]);
    const at = Array.from({ length: model.tactels }, (_, i) => {
      const [x, y] = model.place(i);
      return [(x + halfX) * scale, (halfY - y) * scale] as [number, number];
    });
    context.strokeStyle = inked("line");
    context.lineWidth = 1;
    context.beginPath();
    for (const [x, y] of at) context.rect(x - cell / 2, y - cell / 2, cell, cell);
    context.stroke();
    if (read) {
      context.globalAlpha = 0.6;
      context.fillStyle = inked("normal");
      discs(context, at, read, cell, full, 1);
      context.fill();
      context.globalAlpha = 1;
      // what seems to pull at the skin is hollow and dashed
      context.strokeStyle = inked("normal");
      context.setLineDash([2, 2]);
      discs(context, at, read, cell, full, -1);
      context.stroke();
      context.setLineDash([]);
    }
    if (truth) {
      context.strokeStyle = inked("ink");
      context.lineWidth = 1.2;
      discs(context, at, truth, cell, full, 1);
      context.stroke();
    }
    for (const [forces, ink, wide] of [[truth, "ink", 1.2], [read, "tangential", 2.2]] as const) {
      if (!forces) continue;
      context.strokeStyle = context.fillStyle = inked(ink);
      context.lineWidth = wide;
      arrows(context, at, forces, (1.5 * cell) / full.shear);
    }
    this.tell(model, full, cell, truth, reading);
  }

  private tell(
    model: PadModel, full: Scale, cell: number, truth: Float32Array | null, reading: Forces | null,
  ): void {
    const kind = model.facts.skin ? "square" : "tactel";
    const spread = reading ? middle(reading.std, 0) : Number.NaN;
    const pulled = reading ? Math.max(middle(reading.std, 1), middle(reading.std, 2)) : Number.NaN;
    // most squares of a skin are under no contact, whose deviations are in the table
    const sure = spread > 0 && !model.facts.skin
      ? ` Read to ±${(spread * 1e3).toPrecision(2)} mN, shear to ±${(pulled * 1e3).toPrecision(2)} mN (σ, median ${kind}).`
      : "";
    const told = JSON.stringify([full, cell, sure, inked("normal")]);
    if (told !== this.told) {
      this.told = told;
      this.legend.replaceChildren(discKey(cell), ` ${full.normal} N\u2003`, arrowKey(1.5 * cell), ` ${full.shear} N.${sure}`);
    }
    const pressed = truth ? Array.from({ length: model.tactels }, (_, i) => truth[3 * i]).filter((n) => n > 1e-3).length : 0;
    set(this.canvas, { "aria-label": `Forces of ${model.tactels} ${kind}s; ${pressed} of them are pressed. The table of resultants sums them up.` });
  }
}

function scaled(all: (Float32Array | null)[]): Scale {
  let [normal, shear] = [SMALLEST, SMALLEST];
  for (const forces of all) {
    for (let i = 0; forces && i < forces.length; i += 3) {
      if (Number.isFinite(forces[i])) normal = Math.max(normal, Math.abs(forces[i]));
      const pull = Math.hypot(forces[i + 1], forces[i + 2]);
      if (Number.isFinite(pull)) shear = Math.max(shear, pull);
    }
  }
  return { normal: niceAbove(normal, STEPS), shear: niceAbove(shear, STEPS) };
}

/** A path of the discs of forces of one sign. */
function discs(
  context: CanvasRenderingContext2D, at: [number, number][], forces: Float32Array, cell: number, full: Scale, sign: number,
): void {
  context.beginPath();
  at.forEach(([x, y], i) => {
    const radius = (cell / 2) * Math.sqrt(Math.max(sign * forces[3 * i], 0) / full.normal);
    if (!(radius > 0.7)) return;
    context.moveTo(x + radius, y);
    context.arc(x, y, radius, 0, 2 * Math.PI);
  });
}

/** Arrows of shear, shafts first and then heads, each in one stroke. */
function arrows(context: CanvasRenderingContext2D, at: [number, number][], forces: Float32Array, k: number): void {
  const drawn = at
    .map(([x, y], i) => ({ x, y, dx: forces[3 * i + 1] * k, dy: -forces[3 * i + 2] * k }))
    .filter(({ dx, dy }) => Math.hypot(dx, dy) > 1.5);
  context.beginPath();
  for (const { x, y, dx, dy } of drawn) {
    context.moveTo(x, y);
    context.lineTo(x + dx, y + dy);
  }
  context.stroke();
  context.beginPath();
  for (const { x, y, dx, dy } of drawn) {
    const length = Math.hypot(dx, dy);
    const [ux, uy, head] = [dx / length, dy / length, Math.min(HEAD, length / 2)];
    const [tipX, tipY] = [x + dx, y + dy];
    context.moveTo(tipX + ux, tipY + uy);
    context.lineTo(tipX - 2 * head * ux + head * uy, tipY - 2 * head * uy - head * ux);
    context.lineTo(tipX - 2 * head * ux - head * uy, tipY - 2 * head * uy + head * ux);
  }
  context.fill();
}

/** A disc as large as its cell, for the key. */
function discKey(cell: number): SVGSVGElement {
  const half = cell / 2;
  const disc = shape("circle", { cx: half, cy: half, r: half, fill: inked("normal"), "fill-opacity": 0.6 });
  return key(cell, cell, "A disc that fills its cell:", disc);
}

/** An arrow of a length, for the key. */
function arrowKey(length: number): SVGSVGElement {
  const [middle, ink] = [HEAD + 1, inked("tangential")];
  const shaft = shape("line", { x1: 0, y1: middle, x2: length, y2: middle, stroke: ink, "stroke-width": 2.2 });
  const path = `M${length + HEAD},${middle}l${-3 * HEAD},${-HEAD}v${2 * HEAD}z`;
  return key(length + HEAD, 2 * middle, "An arrow of 1.5 cells:", shaft, shape("path", { d: path, fill: ink }));
}

function key(width: number, height: number, name: string, ...parts: SVGElement[]): SVGSVGElement {
  return shape("svg", { width, height, role: "img", "aria-label": name }, ...parts);
}

/** Median of one of the three components. */
function middle(values: Float32Array, component: number): number {
  const one = values.filter((_, i) => i % 3 === component).sort();
  return one[Math.floor(one.length / 2)];
}
