/** The page's pictures as one SVG figure that stands by itself. */

import { shape } from "./dom";
import { LEFT, layout, RIGHT } from "./layout";
import type { Model, Reading } from "./model";
import { niceAbove } from "./numbers";
import type { State } from "./store";

const WIDTH = 900;
const INK = "#333";
const NORMAL = "#d55e00";
const TANGENTIAL = "#0072b2";

interface Pictures {
  stress: string;
  stressTitle: string;
  fringes: string;
}

/** An SVG document of strip, forces, stress, fringes, phase and forces read. */
export function figure(
  model: Model,
  state: State,
  phase: Float32Array,
  reading: Reading | null,
  pictures: Pictures,
): string {
  const place = layout(WIDTH, model.facts.strip.length);
  const width = WIDTH - LEFT - RIGHT;
  const depth = (model.facts.layers[0] + model.facts.layers[1]) * place.scale;
  let y = 30;
  const parts: (Node | string)[] = [
    shape("rect", { width: "100%", height: "100%", fill: "white" }),
    text(LEFT, 20, `${model.facts.name}, ${model.facts.strip.edges} edges`, 15),
  ];
  parts.push(...arrows(model, state, place.across, (y += 90)));
  parts.push(image(pictures.stress, y, depth), text(LEFT, (y += depth + 16), pictures.stressTitle));
  parts.push(image(pictures.fringes, (y += 14), 60), text(LEFT, (y += 76), "fringes"));
  parts.push(...curve(model, phase, place.across, (y += 20), 130));
  if (reading) parts.push(...bars(model, state, reading, place.across, (y += 190), 120));
  const height = y + 150;
  const svg = shape("svg", {
    xmlns: "http://www.w3.org/2000/svg",
    width: WIDTH,
    height,
    viewBox: `0 0 ${WIDTH} ${height}`,
    "font-family": "sans-serif",
  });
  svg.append(...parts);
  return new XMLSerializer().serializeToString(svg);

  function image(address: string, top: number, tall: number): SVGElement {
    const at = { href: address, x: LEFT, y: top, width, height: tall };
    return shape("image", { ...at, preserveAspectRatio: "none" });
  }
}

/** An SVG document as a PNG of twice its size. */
export async function rastered(svg: string): Promise<Blob> {
  const picture = new Image();
  picture.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await picture.decode();
  const canvas = new OffscreenCanvas(2 * picture.width, 2 * picture.height);
  const context = canvas.getContext("2d");
  context?.drawImage(picture, 0, 0, canvas.width, canvas.height);
  return canvas.convertToBlob({ type: "image/png" });
}

type Across = (x: number) => number;

function text(x: number, y: number, words: string, size = 12, anchor = "start"): SVGElement {
  return shape("text", { x, y, "font-size": size, fill: INK, "text-anchor": anchor }, words);
}

function line(x1: number, y1: number, x2: number, y2: number, stroke: string, wide = 1): SVGElement {
  return shape("line", { x1, y1, x2, y2, stroke, "stroke-width": wide });
}

function arrows(model: Model, state: State, across: Across, surface: number): SVGElement[] {
  const k = 70 / niceAbove(Math.max(...state.normal, ...state.tangential.map(Math.abs), 0.1));
  return state.normal.flatMap((normal, i) => {
    const [x, tangential] = [across(model.tactels[i]), state.tangential[i]];
    if (Math.hypot(normal, tangential) * k < 2) return [];
    const angle = (Math.atan2(tangential, normal) * -180) / Math.PI;
    const at = `translate(${x} ${surface}) rotate(${angle})`;
    const head = shape("path", { d: "M0 0L-4 -8L4 -8Z", fill: NORMAL, transform: at });
    return [line(x - tangential * k, surface - normal * k, x, surface, NORMAL, 2), head];
  });
}

function curve(
  model: Model, phase: Float32Array, across: Across, top: number, tall: number,
): SVGElement[] {
  const low = Math.min(...phase, 0);
  const high = Math.max(...phase, 0.01);
  const y = (value: number) => top + ((high - value) / (high - low)) * tall;
  const step = Math.max(1, Math.floor(phase.length / 600));
  const points: string[] = [];
  for (let i = 0; i < phase.length; i += step) {
    points.push(`${across(model.x[i]).toFixed(1)},${y(phase[i]).toFixed(1)}`);
  }
  return [
    line(LEFT, y(0), WIDTH - RIGHT, y(0), "#bbb"),
    shape("polyline", { points: points.join(" "), fill: "none", stroke: INK, "stroke-width": 1.5 }),
    text(LEFT - 6, y(high) + 4, high.toFixed(1), 11, "end"),
    text(LEFT - 6, y(low) + 4, low.toFixed(1), 11, "end"),
    text(LEFT, top + tall + 20, "phase lead [rad]"),
  ];
}

function bars(
  model: Model, state: State, reading: Reading, across: Across, top: number, tall: number,
): SVGElement[] {
  const truth = state.normal.flatMap((force, i) => [force, state.tangential[i]]);
  const high = niceAbove(Math.max(...truth, 0.1));
  const low = Math.min(...truth, 0) * 1.2;
  const y = (force: number) => top + ((high - force) / (high - low)) * tall;
  const found = [
    line(LEFT, y(0), WIDTH - RIGHT, y(0), "#bbb"),
    text(LEFT - 6, y(high) + 4, `${high}`, 11, "end"),
    text(LEFT, top + tall + 20, `forces read [N], ±2 σ, beside the true ones: ${reading.status}`),
  ];
  truth.forEach((force, i) => {
    const [value, spread] = [reading.forces[i], 2 * reading.std[i]];
    const [colour, shift] = i % 2 ? [TANGENTIAL, 4] : [NORMAL, -4];
    const x = across(model.tactels[Math.floor(i / 2)]) + shift;
    found.push(line(x - 5, y(force), x + 5, y(force), INK, 1.5));
    if (!Number.isFinite(value)) return;
    found.push(line(x, y(value - spread), x, y(value + spread), colour, 1.5));
    found.push(shape("circle", { cx: x, cy: y(value), r: 3, fill: colour }));
  });
  return found;
}
