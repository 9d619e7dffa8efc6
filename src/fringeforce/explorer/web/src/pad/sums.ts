/** What was read in all and of each contact, beside what is true; and the reader's verdict. */

import { byId, element, write } from "../dom";
import { clamped, fixed } from "../numbers";
import { showVerdict } from "../page";
import type { PadModel, Reading } from "./model";

const QUANTITIES: [name: string, unit: string, factor: number][] = [
  ["Normal", "N", 1],
  ["Shear x", "N", 1],
  ["Shear y", "N", 1],
  ["Moment", "N mm", 1e3],
  ["Centre x", "mm", 1e3],
  ["Centre y", "mm", 1e3],
];
const COUNT = QUANTITIES.length;
// said in words too, for a narrow page lays cells out as a grid, which is no table to a reader of screens
const ROW = { role: "row" };
const CELL = { role: "cell" };

export function showSums(model: PadModel | null, reading: Reading | null): void {
  showVerdict(reading);
  const region = byId("sums");
  if (!model || !reading) return;
  const heads = QUANTITIES.map(([name, unit]) => {
    const head = element("th", { scope: "col", role: "columnheader" }, name, " ");
    head.append(element("small", {}, unit));
    return head;
  });
  const rows = Array.from({ length: reading.sums.length / (3 * COUNT) }, (_, row) => {
    const cells = QUANTITIES.map(([name, unit, factor], column) => {
      const [truth, value, spread] = [0, 1, 2].map((k) => reading.sums[(3 * row + k) * COUNT + column] * factor);
      const found = cell(truth, value, spread);
      found.dataset.head = `${name} [${unit}]`;
      return found;
    });
    const name = row === 0 ? "All" : `Contact ${row}`;
    return element("tr", ROW, element("th", { scope: "row", role: "rowheader" }, name), ...cells);
  });
  const caption = element("caption", {}, "Read ± one standard deviation; below it the truth.");
  const head = element("tr", ROW, element("td", CELL), ...heads);
  region.replaceChildren(element("table", { role: "table", class: "wide" }, caption, head, ...rows));
}

/** Say why nothing can be read. */
export function showUnread(why: string): void {
  write(byId("status"), "NOT READ");
  write(byId("advice"), why);
  byId("status").dataset.status = "";
  byId("sums").replaceChildren();
}

function cell(truth: number, value: number, spread: number): HTMLElement {
  if (!Number.isFinite(value)) return element("td", CELL, "–", element("small", {}, fixed(truth, 2)));
  const digits = clamped(-Math.floor(Math.log10(spread || 1)), 0, 4);
  return element(
    "td",
    CELL,
    element("span", {}, `${fixed(value, digits)} ±\u00a0${fixed(spread, digits)}`),
    element("small", {}, fixed(truth, digits)),
  );
}
