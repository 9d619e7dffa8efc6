/** What the link of every page holds: a design, what was changed of it, and the seed of the noise. */

import { type Changes, spelled, typed } from "./controls";

export interface Designed {
  start: string;
  changes: Changes;
  seed: number;
}

/** Names and values of a link. */
export function linked(hash: string): URLSearchParams {
  return new URLSearchParams(hash.replace(/^#/, ""));
}

export function designedOf(values: URLSearchParams): Designed {
  const paths = [...values].filter(([key]) => key.startsWith(".")).map(([key, text]) => [key.slice(1), text]);
  return {
    start: values.get("start") ?? "",
    changes: Object.fromEntries(paths.map(([path, text]) => [path, typed(path, text)])),
    seed: counted(values.get("seed")) % 2 ** 32,
  };
}

/** A whole number that is not negative; 0 where there is none. */
export function counted(text: string | null): number {
  const number = Math.abs(Math.trunc(Number(text)));
  return Number.isFinite(number) ? number : 0;
}

/** The beginning of a link, to which a page adds what only it knows. */
export function linkOf({ start, changes, seed }: Designed): URLSearchParams {
  const values = new URLSearchParams();
  if (start) values.set("start", start);
  for (const [path, value] of Object.entries(changes)) values.set(`.${path}`, spelled(value));
  if (seed) values.set("seed", `${seed}`);
  return values;
}
