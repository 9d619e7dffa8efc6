/** The contacts that were read, each beside the finger that made it. */

import { byId, element } from "../dom";
import { fixed } from "../numbers";
import { showVerdict } from "../page";
import type { Felt, SkinReading } from "./model";

const HEADS: [name: string, unit: string, column: number, digits: number][] = [
  ["Place", "mm", 0, 3],
  ["Width", "mm", 1, 2],
  ["Normal", "N", 2, 3],
  ["Shear", "N", 3, 3],
];

export function showContacts(reading: SkinReading | null): void {
  showVerdict(reading);
  if (!reading) return;
  const [total, ...contacts] = reading.contacts;
  const truth = [...reading.true].sort((a, b) => a[0] - b[0]);
  const read = [...contacts].sort((a, b) => (a[0] ?? 0) - (b[0] ?? 0));
  const paired = truth.length === read.length;
  const sums = [1, 2].map((part) => truth.reduce((sum, one) => sum + one[part], 0));
  const push = sums[0] || 1;
  const centre = truth.reduce((sum, [x, normal]) => sum + (x * normal) / push, 0);
  const rows = total ? [row("All", total, truth.length ? [centre, sums[0], sums[1]] : null)] : [];
  read.forEach((felt, i) => rows.push(row(`${i + 1}`, felt, paired ? truth[i] : null)));
  const heads = HEADS.map(([name, unit]) => element("th", { scope: "col" }, name, " ", element("small", {}, unit)));
  const caption = element("caption", {}, "Read ± one standard deviation; below it the truth.");
  byId("sums").replaceChildren(element("table", {}, caption, element("tr", {}, element("td"), ...heads), ...rows));
}

function row(name: string, felt: Felt, truth: [number, number, number] | null): HTMLElement {
  const known = truth ? [truth[0], null, truth[1], truth[2]] : [null, null, null, null];
  const cells = HEADS.map(([, , column, digits]) => {
    const [value, spread] = [felt[column] ?? Number.NaN, felt[column + 4] ?? Number.NaN];
    const text = `${fixed(value, digits)} ± ${fixed(spread, digits)}`;
    const own = known[column];
    return element("td", {}, element("span", {}, text), element("small", {}, own === null ? "" : fixed(own, digits)));
  });
  return element("tr", {}, element("th", { scope: "row" }, name), ...cells);
}
