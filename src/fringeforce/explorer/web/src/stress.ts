/** The stress field as a picture to scale, the deformed mesh over it, and its scale of colours. */

import { blit, colourBar, FONT, prepared } from "./canvas";
import { CIVIDIS, diverging, inked, painted } from "./colours";
import { LEFT, type Layout, RIGHT } from "./layout";
import { COLUMNS, type Mesh, type Model } from "./model";
import { largest, niceAbove } from "./numbers";
import type { Component } from "./store";

export const NAMES: Record<Component, string> = {
  sigma_x: "σx",
  sigma_z: "σz",
  tau_xz: "τxz",
  principal: "σ₁ − σ₂",
};
const SPOKEN: Record<Component, string> = {
  sigma_x: "normal stress along the strip",
  sigma_z: "normal stress through the depth",
  tau_xz: "shear stress",
  principal: "difference of the principal stresses",
};
const MARGIN = 16;
const SCALE_HEIGHT = 40;
const SHOWN_SINKING = 0.1;

/** One stress of a layer [Pa], from the three that the server sent one after another. */
export function picked(all: Float32Array, component: Component): Float32Array {
  const size = all.length / 3;
  const part = (i: number) => all.subarray(i * size, (i + 1) * size);
  if (component === "sigma_x") return part(0);
  if (component === "sigma_z") return part(1);
  if (component === "tau_xz") return part(2);
  const [sx, sz, shear] = [part(0), part(1), part(2)];
  return sx.map((value, i) => Math.hypot(value - sz[i], 2 * shear[i]));
}

/** Draw the field; returns the stress at the ends of the colours [Pa]. */
export function drawStress(
  canvas: HTMLCanvasElement,
  model: Model,
  loads: number[],
  component: Component,
  place: Layout,
  mesh: Mesh | null,
  given?: number,
): number {
  const { layers } = model.facts;
  const cover = picked(model.stress("cover", loads), component);
  const clear = picked(model.stress("clear", loads), component);
  // right under a line load stress has no bound: the clear layer sets the scale
  const limit = given ?? niceAbove(largest(clear));
  const depth = (layers[0] + layers[1]) * place.scale;
  const context = prepared(canvas, place.width, depth + 2 * MARGIN);
  const table = component === "principal" ? CIVIDIS : diverging();
  const low = component === "principal" ? 0 : -limit;
  const width = model.facts.strip.length * place.scale;
  context.imageSmoothingQuality = "low";
  let y = MARGIN;
  for (const [field, thickness] of [[cover, layers[0]], [clear, layers[1]]] as const) {
    blit(context, painted(field, COLUMNS, table, low, limit), LEFT, y, width, thickness * place.scale);
    y += thickness * place.scale;
  }
  context.strokeStyle = inked("ink-soft");
  context.lineWidth = 0.6;
  context.strokeRect(LEFT, MARGIN, width, depth);
  if (mesh) drawMesh(context, model, mesh, place, component === "principal" ? "#ffffff" : inked("ink"));
  canvas.setAttribute(
    "aria-label",
    `Picture of the ${SPOKEN[component]}; colours end at ${megapascals(limit)}.`,
  );
  return limit;
}

/** How many times displacements are drawn too large, so that the sinking of the skin shows. */
function exaggeration(moved: Float32Array, rows: number, depth: number): number {
  let square = 0;
  const corners = moved.length / 2;
  for (let node = rows - 1; node < corners; node += rows) square += moved[corners + node] ** 2;
  const typical = Math.sqrt((square * rows) / corners);
  return typical > 0 ? niceAbove((SHOWN_SINKING * depth) / typical) : 1;
}

function drawMesh(
  context: CanvasRenderingContext2D,
  model: Model,
  { mesh_x: x, mesh_z: z, moved }: Mesh,
  place: Layout,
  ink: string,
): void {
  const { layers } = model.facts;
  const times = exaggeration(moved, z.length, layers[0] + layers[1]);
  const corners = x.length * z.length;
  const at = (i: number, j: number): [number, number] => {
    const node = i * z.length + j;
    return [
      place.across(x[i] + times * moved[node]),
      MARGIN - (z[j] + times * moved[corners + node]) * place.scale,
    ];
  };
  context.beginPath();
  for (let i = 0; i < x.length; i++) {
    for (let j = 0; j < z.length; j++) {
      if (j) context.lineTo(...at(i, j));
      else context.moveTo(...at(i, j));
    }
  }
  for (let j = 0; j < z.length; j++) {
    for (let i = 0; i < x.length; i++) {
      if (i) context.lineTo(...at(i, j));
      else context.moveTo(...at(i, j));
    }
  }
  context.strokeStyle = ink;
  context.lineWidth = 0.6;
  context.globalAlpha = 0.65;
  context.stroke();
  context.globalAlpha = 1;
  context.fillStyle = inked("ink-soft");
  context.font = FONT;
  context.textAlign = "right";
  context.fillText(`mesh moved ${times}×`, place.width - RIGHT, 10);
}

/** The colours with their stresses, below the picture. */
export function drawScale(
  canvas: HTMLCanvasElement,
  component: Component,
  limit: number,
  width: number,
): void {
  const context = prepared(canvas, width, SCALE_HEIGHT);
  const table = component === "principal" ? CIVIDIS : diverging();
  const length = Math.min(320, width - LEFT - 40);
  colourBar(context, table, LEFT, 4, length, 10);
  context.strokeStyle = inked("line");
  context.strokeRect(LEFT, 4, length, 10);
  context.fillStyle = inked("ink-soft");
  context.font = FONT;
  const low = component === "principal" ? 0 : -limit;
  const middle = (low + limit) / 2;
  for (const [share, value] of [[0, low], [0.5, middle], [1, limit]]) {
    context.textAlign = share === 0 ? "left" : share === 1 ? "right" : "center";
    context.fillText(megapascals(value, limit), LEFT + share * length, 28);
  }
  context.textAlign = "left";
  const sense = component === "principal" ? "" : "blue presses, orange pulls";
  if (width > 560) context.fillText(`${NAMES[component]}  ${component === "tau_xz" ? "" : sense}`, LEFT + length + 14, 13);
}

/** A stress in the unit that suits the largest one beside it. */
export function megapascals(pascals: number, beside = pascals): string {
  const sign = pascals < 0 ? "−" : "";
  const size = Math.abs(pascals);
  const [value, unit] = Math.abs(beside) >= 1e6 ? [size / 1e6, "MPa"] : [size / 1e3, "kPa"];
  return `${sign}${Number(value.toPrecision(3))} ${unit}`;
}
