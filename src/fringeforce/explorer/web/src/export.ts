/** What a page has seen of a running sensor, as a table: a row for each moment and tactel. */

import type { Moment } from "./ring";

const PARTS: Record<number, string[]> = {
  2: ["normal", "tangential"],
  3: ["normal", "tangential_x", "tangential_y"],
};

/** CSV of readings, with the names of columns that `fringeforce read` writes. */
export function table(moments: Moment[], tactels: number): string {
  const parts = PARTS[moments.length ? moments[0].forces.length / tactels : 2];
  const named = (end: string) => parts.map((part) => `${part}${end}`);
  const rows = [["time_s", "tactel", ...named("_N"), ...named("_std_N"), "status"].join(",")];
  for (const { time, forces, std, status } of moments) {
    for (let tactel = 0; tactel < tactels; tactel++) {
      const own = (values: Float32Array) =>
        parts.map((_, k) => number(values[tactel * parts.length + k]));
      rows.push([time.toFixed(4), tactel + 1, ...own(forces), ...own(std), status].join(","));
    }
  }
  return `${rows.join("\n")}\n`;
}

/** Nothing where nothing was read. */
function number(value: number): string {
  return Number.isFinite(value) ? value.toPrecision(6) : "";
}
