/** Loads that teach something, for any number of tactels. */

type Load = [normal: number, tangential: number];

export interface Preset {
  key: string;
  name: string;
  hint: string;
  load: (place: number) => Load;
}

const TILT = (10 * Math.PI) / 180;
const FRICTION = 0.5;

/** A contact that is pressed in its middle, as a round finger does. */
function round(place: number, radius: number): number {
  return Math.max(1 - (place / radius) ** 2, 0);
}

/** `place` counts from -1 at the leftmost tactel to 1 at the rightmost. */
export const PRESETS: Preset[] = [
  {
    key: "paper",
    name: "Paper",
    hint: "1 N at 10° on every tactel",
    load: () => [Math.cos(TILT), Math.sin(TILT)],
  },
  {
    key: "single",
    name: "Single",
    hint: "1 N on the middle tactel",
    load: (place) => [Math.abs(place) < 1e-9 ? 1 : 0, 0],
  },
  { key: "uniform", name: "Uniform", hint: "1 N on every tactel", load: () => [1, 0] },
  {
    key: "pinch",
    name: "Pinch",
    hint: "Two contacts pulled together",
    load: (place) => {
      const push = round(Math.abs(place) - 0.6, 0.35);
      return [push, -0.4 * push * Math.sign(place)];
    },
  },
  {
    key: "slip",
    name: "Slip",
    hint: "A round contact about to slip: its rim slides, its middle still sticks",
    load: (place) => {
      // Cattaneo and Mindlin: full friction everywhere, less a smaller round in the middle
      const push = 1.5 * round(place, 0.9);
      return [push, FRICTION * (push - 0.6 * round(place, 0.55))];
    },
  },
  { key: "none", name: "None", hint: "Nothing touches the sensor", load: () => [0, 0] },
];

export function presetLoads(key: string, n: number): { normal: number[]; tangential: number[] } {
  const preset = PRESETS.find((one) => one.key === key) ?? PRESETS[0];
  // with an even number of tactels the single force goes to the one right of the middle
  const middle = key === "single" ? Math.floor(n / 2) : (n - 1) / 2;
  const half = Math.max((n - 1) / 2, 0.5);
  const loads = Array.from({ length: n }, (_, i) => preset.load((i - middle) / half));
  return { normal: loads.map(([n]) => n), tangential: loads.map(([, t]) => t) };
}

/** Loads for another number of tactels, the middle one staying where it is. */
export function refitted(values: number[], n: number): number[] {
  const shift = Math.round((values.length - n) / 2);
  return Array.from({ length: n }, (_, i) => values[i + shift] ?? 0);
}
