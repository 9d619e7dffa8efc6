/** What stands behind marks above the tactels: levels with their values, and the tactels' numbers. */

import { shape } from "./dom";
import { LEFT, type Layout, RIGHT } from "./layout";
import type { Model } from "./model";

/** Room above the highest level and below the lowest [px]. */
export const TOP = 10;
export const BOTTOM = 24;

export function levels(values: number[], y: (value: number) => number, place: Layout): SVGElement[] {
  return values.flatMap((value) => {
    const level = y(value);
    const label = { class: "label", x: LEFT - 6, y: level + 4, "text-anchor": "end" };
    return [
      shape("line", { class: value ? "grid" : "zero", x1: LEFT, x2: place.width - RIGHT, y1: level, y2: level }),
      shape("text", label, `${Number(value.toPrecision(6))}`),
    ];
  });
}

/** Every so many that they do not touch, and before them what they are numbers of. */
export function tactelNumbers({ tactels }: Model, height: number, place: Layout): SVGElement[] {
  const every = Math.ceil(24 / (place.scale * (tactels[1] - tactels[0] || 1)));
  const y = height - 8;
  const numbers = [...tactels].flatMap((x, i) => {
    if (i % every) return [];
    return [shape("text", { class: "label", x: place.across(x), y, "text-anchor": "middle" }, `${i + 1}`)];
  });
  const name = { class: "label", x: place.across(tactels[0]) - 14, y, "text-anchor": "end" };
  return [shape("text", name, "tactel"), ...numbers];
}
