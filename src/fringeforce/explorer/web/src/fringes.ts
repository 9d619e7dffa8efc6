/** The strip from above through the polariscope, in the colour of its light. */

import { blit, prepared } from "./canvas";
import { inked, lightTable, painted } from "./colours";
import { LEFT, type Layout } from "./layout";
import { intensity, type Model } from "./model";
import { fixed } from "./numbers";

const TALLEST = 84;

export function drawFringes(
  canvas: HTMLCanvasElement,
  model: Model,
  phase: Float32Array,
  place: Layout,
): void {
  const { strip, light } = model.facts;
  const height = Math.min(strip.width * place.scale, TALLEST);
  const context = prepared(canvas, place.width, height);
  const width = strip.length * place.scale;
  const bright = phase.map(intensity);
  blit(context, painted(bright, phase.length, lightTable(light), 0, 1), LEFT, 0, width, height);
  context.strokeStyle = inked("line");
  context.lineWidth = 1;
  context.strokeRect(LEFT + 0.5, 0.5, width - 1, height - 1);
  canvas.setAttribute("aria-label", `Fringes of the load: ${fringeCount(phase)}.`);
}

/** Dark fringes crossed, and the largest order, in words. */
export function fringeCount(phase: Float32Array): string {
  let [low, high] = [Infinity, -Infinity];
  for (const value of phase) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  const peak = Math.max(Math.abs(low), Math.abs(high));
  return `phase from ${fixed(low, 2)} to ${fixed(high, 2)} rad, fringe order up to ${(peak / (2 * Math.PI)).toFixed(2)}`;
}
