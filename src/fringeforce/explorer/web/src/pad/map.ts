/** Forces of the tactels from above: discs as large as normal forces, arrows as long as shear. */

import { inked } from "../colours";
import { element, set } from "../dom";
import { prepared } from "../layout";
import type { PadModel, Reading } from "./model";

const SMALLEST = 0.02;
const HEAD = 3.5;

interface Scale {
  /** Disc that fills a cell, and arrow as long as one and a half cells [N]. */
  normal: number;
  shear: number;
}

export class ForceMap {
  private readonly canvas = element("canvas", { role: "img", "aria-label": "Not drawn yet." });

  constructor(
    private readonly container: HTMLElement,
    private readonly legend: HTMLElement,
  ) {
    container.append(this.canvas);
  }

  draw(model: PadModel, truth: Float32Array | null, reading: Reading | null): void {
    const [halfX, halfY] = model.half;
    const width = this.container.clientWidth;
    const scale = width / (2 * halfX);
    const context = prepared(this.canvas, width, 2 * halfY * scale);
    const cell = model.facts.tactels.pitch * 1e3 * scale;
    const read = reading && reading.forces.length === 3 * model.tactels ? reading.forces : null;
    const full = scaled([truth, read]);
    for (let i = 0; i < model.tactels; i++) {
      const [x, y] = model.place(i);
      const at: [number, number] = [(x + halfX) * scale, (halfY - y) * scale];
      context.strokeStyle = inked("line");
      context.lineWidth = 1;
      context.strokeRect(at[0] - cell / 2, at[1] - cell / 2, cell, cell);
      if (read) disc(context, at, read[3 * i], cell, full, true);
      if (truth) disc(context, at, truth[3 * i], cell, full, false);
    }
    for (const [forces, ink, wide] of [[truth, "ink", 1.2], [read, "tangential", 2.2]] as const) {
      if (!forces) continue;
      context.strokeStyle = context.fillStyle = inked(ink);
      context.lineWidth = wide;
      for (let i = 0; i < model.tactels; i++) {
        const [x, y] = model.place(i);
        const k = (1.5 * cell) / full.shear;
        arrow(context, (x + halfX) * scale, (halfY - y) * scale, forces[3 * i + 1] * k, -forces[3 * i + 2] * k);
      }
    }
    this.tell(model, full, truth, reading);
  }

  private tell(model: PadModel, full: Scale, truth: Float32Array | null, reading: Reading | null): void {
    const spread = reading ? middle(reading.std, 0) : Number.NaN;
    const pulled = reading ? Math.max(middle(reading.std, 1), middle(reading.std, 2)) : Number.NaN;
    const sure = Number.isFinite(spread)
      ? ` Read to ±${(spread * 1e3).toPrecision(2)} mN, shear to ±${(pulled * 1e3).toPrecision(2)} mN (σ, median tactel).`
      : "";
    this.legend.textContent = `A disc that fills its cell: ${full.normal} N. An arrow of 1.5 cells: ${full.shear} N.${sure}`;
    const pressed = truth ? Array.from({ length: model.tactels }, (_, i) => truth[3 * i]).filter((n) => n > 1e-3).length : 0;
    set(this.canvas, { "aria-label": `Forces of ${model.tactels} tactels; ${pressed} of them are pressed. The table of resultants sums them up.` });
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
  return { normal: calm(normal), shear: calm(shear) };
}

/** The next of a few even numbers, so that scales stay calm while forces grow. */
function calm(value: number): number {
  const decade = 10 ** Math.floor(Math.log10(value));
  const step = [1, 1.5, 2, 3, 4, 5, 7, 10].find((factor) => factor * decade >= value * (1 - 1e-9)) ?? 10;
  return Number((step * decade).toPrecision(2));
}

function disc(
  context: CanvasRenderingContext2D, [x, y]: [number, number], force: number, cell: number, full: Scale, filled: boolean,
): void {
  const radius = (cell / 2) * Math.sqrt(Math.abs(force) / full.normal);
  if (!(radius > 0.7)) return;
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  // what seems to pull at the skin is hollow and dashed
  if (filled && force > 0) {
    context.globalAlpha = 0.6;
    context.fillStyle = inked("normal");
    context.fill();
    context.globalAlpha = 1;
    return;
  }
  context.setLineDash(force < 0 ? [2, 2] : []);
  context.strokeStyle = inked(filled ? "normal" : "ink");
  context.lineWidth = 1.2;
  context.stroke();
  context.setLineDash([]);
}

function arrow(context: CanvasRenderingContext2D, x: number, y: number, dx: number, dy: number): void {
  const length = Math.hypot(dx, dy);
  if (!(length > 1.5)) return;
  const [ux, uy] = [dx / length, dy / length];
  const [tipX, tipY] = [x + dx, y + dy];
  const head = Math.min(HEAD, length / 2);
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(tipX, tipY);
  context.stroke();
  context.beginPath();
  context.moveTo(tipX + ux, tipY + uy);
  context.lineTo(tipX - 2 * head * ux + head * uy, tipY - 2 * head * uy - head * ux);
  context.lineTo(tipX - 2 * head * ux - head * uy, tipY - 2 * head * uy + head * ux);
  context.fill();
}

/** Median of one of the three components. */
function middle(values: Float32Array, component: number): number {
  const one = values.filter((_, i) => i % 3 === component).sort();
  return one[Math.floor(one.length / 2)];
}
