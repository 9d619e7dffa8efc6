/** What each slice adds to the light's retardance, from the mirror to the base. */

import { blit, colourBar, prepared } from "../canvas";
import { CIVIDIS, diverging, painted } from "../colours";
import { Choice } from "../commands";
import { blankCanvas, byId, element, write } from "../dom";
import { largest, niceAbove } from "../numbers";
import type { Slices } from "./model";
import { type PadStore, type Part, PARTS } from "./store";

const NAMES: Record<Part, string> = { difference: "σx − σy", shear: "2 τxy", size: "σ₁ − σ₂" };
const SMALL = 92;
const LARGE = 280;
const BAR = [220, 12] as const;

export class SlicePictures {
  private readonly strip = element("div", { class: "stack" });
  private readonly large = blankCanvas();
  private readonly bar = blankCanvas();
  private readonly scale = element("p", { class: "aside" });
  private readonly depth = element("input", { type: "range", min: 1, step: 1, "aria-label": "Slice shown large" });
  private readonly parts: Choice<Part>;

  constructor(
    private readonly store: PadStore,
    onView: () => void,
  ) {
    const parts = PARTS.map((key) => ({ key, name: NAMES[key], hint: "Retardance of one pass that this stress makes" }));
    this.parts = new Choice(byId("components"), "part", parts, (part) => {
      store.view.part = part;
      onView();
    });
    this.depth.addEventListener("input", () => {
      store.view.depth = this.depth.valueAsNumber - 1;
      onView();
    });
    const beside = element("div", { class: "beside" }, this.depth, this.scale, this.bar);
    byId("slices").append(this.strip, element("div", { class: "enlarged" }, this.large, beside));
  }

  draw(found: Slices | null): void {
    const { view } = this.store;
    this.parts.show(view.part);
    if (!found) return;
    const [count, , rows, columns] = found.shape;
    const fields = Array.from({ length: count }, (_, k) => picked(found, k, view.part));
    const limit = niceAbove(Math.max(...fields.map(largest), 1e-4));
    const shown = Math.min(view.depth, count - 1);
    this.depth.max = `${count}`;
    if (document.activeElement !== this.depth) this.depth.value = `${shown + 1}`;
    this.depth.setAttribute("aria-valuetext", named(shown, found.heights));
    this.build(found.heights);
    const pictures = [...this.strip.querySelectorAll("canvas")];
    fields.forEach((field, k) => {
      const label = `${named(k, found.heights)}: largest ${largest(field).toPrecision(2)} radians`;
      this.show(pictures[k], field, columns, rows, SMALL, limit, label);
      this.strip.children[k].classList.toggle("chosen", k === shown);
    });
    this.show(this.large, fields[shown], columns, rows, LARGE, limit, `${NAMES[view.part]}, ${named(shown, found.heights)}`);
    this.gauge(limit, named(shown, found.heights));
  }

  private build(heights: number[]): void {
    const names = heights.map(deep);
    const captions = [...this.strip.querySelectorAll("figcaption")];
    if (captions.length === names.length) {
      captions.forEach((caption, k) => write(caption, names[k]));
      return;
    }
    const figures = names.map((name) => element("figure", {}, blankCanvas(), element("figcaption", {}, name)));
    this.strip.replaceChildren(...figures);
  }

  private show(
    canvas: HTMLCanvasElement, field: Float32Array, columns: number, rows: number, size: number, limit: number, label: string,
  ): void {
    const [width, height] = columns >= rows ? [size, (size * rows) / columns] : [(size * columns) / rows, size];
    const context = prepared(canvas, width, height);
    // rows count from the most negative y
    context.translate(0, height);
    context.scale(1, -1);
    blit(context, painted(field, columns, this.table, this.low(limit), limit), 0, 0, width, height);
    canvas.setAttribute("aria-label", label);
  }

  private get table(): Uint8ClampedArray {
    return this.store.view.part === "size" ? CIVIDIS : diverging();
  }

  /** Where the colours begin that end at a limit. */
  private low(limit: number): number {
    return this.store.view.part === "size" ? 0 : -limit;
  }

  private gauge(limit: number, name: string): void {
    const low = this.low(limit);
    colourBar(prepared(this.bar, ...BAR), this.table, 0, 0, ...BAR);
    const from = `${low}`.replace("-", "−");
    this.bar.setAttribute("aria-label", `Colours from ${low} to ${limit} radians`);
    this.scale.textContent = `Large: ${name}. Colours from ${from} to ${limit} rad, retardance of one pass.`;
  }
}

function named(slice: number, heights: number[]): string {
  const end = slice === 0 ? ", at the mirror" : slice === heights.length - 1 ? ", at the base" : "";
  return `slice ${deep(heights[slice])} deep${end}`;
}

/** How far a slice lies below the loaded surface. */
function deep(height: number): string {
  return `${(-1e3 * height).toPrecision(3)} mm`;
}

function picked(found: Slices, slice: number, part: Part): Float32Array {
  const [, , rows, columns] = found.shape;
  const size = rows * columns;
  const one = (k: number) => found.slices.subarray((2 * slice + k) * size, (2 * slice + k + 1) * size);
  if (part === "difference") return one(0);
  if (part === "shear") return one(1);
  const shear = one(1);
  return one(0).map((value, i) => Math.hypot(value, shear[i]));
}
