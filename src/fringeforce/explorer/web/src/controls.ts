/** The controls of a design: path in the design file, name, and the range of the slider. */

import { clamped } from "./numbers";

export interface Control {
  path: string;
  name: string;
  title?: string;
  unit?: string;
  range?: [low: number, high: number];
  logarithmic?: boolean;
  whole?: boolean;
  choices?: [value: string, name: string][];
  /** Of what a design may leave out: how it is typed. */
  example?: Value;
}

export interface Group {
  name: string;
  controls: Control[];
}

const thickness = (part: string, range: [number, number]): Control => ({
  path: `transducer.${part}.thickness`,
  name: "Thickness",
  unit: "mm",
  range,
  logarithmic: true,
});

const stiffness = (part: string, range: [number, number]): Control => ({
  path: `transducer.${part}.youngs_modulus`,
  name: "Young's modulus",
  unit: "MPa",
  range,
  logarithmic: true,
});

const poisson = (part: string): Control => ({
  path: `transducer.${part}.poissons_ratio`,
  name: "Poisson's ratio",
  range: [0.1, 0.499],
});

/** Cover and clear layer, as soft as given [MPa]. */
export const layers = (cover: number, clear: number): Group[] => [
  {
    name: "Cover",
    controls: [thickness("compliant", [0.1, 3]), stiffness("compliant", [cover, 1000]), poisson("compliant")],
  },
  {
    name: "Clear layer",
    controls: [
      thickness("photoelastic", [0.5, 10]),
      stiffness("photoelastic", [clear, 5000]),
      poisson("photoelastic"),
      {
        path: "transducer.photoelastic.strain_optic_coefficient",
        name: "Strain-optic coefficient",
        range: [0.005, 0.2],
        logarithmic: true,
      },
    ],
  },
];

/** Light and camera, where what tells one camera from another stands between. */
export const imaging = (...kinds: Control[]): Group => ({
  name: "Light and camera",
  controls: [
    { path: "polariscope.wavelength", name: "Wavelength", unit: "nm", range: [400, 700] },
    ...kinds,
    { path: "camera.bits", name: "Bits", range: [4, 16], whole: true },
    { path: "camera.amplitude", name: "Amplitude", range: [10, 245] },
    { path: "camera.offset", name: "Offset", range: [0, 60] },
    { path: "camera.noise", name: "Noise", title: "grey levels", range: [0, 40] },
    {
      path: "camera.noise_model",
      name: "Noise is",
      choices: [["uniform", "uniform"], ["gaussian", "Gaussian"]],
    },
  ],
});

export const GROUPS: Group[] = [
  {
    name: "Strip",
    controls: [
      {
        path: "transducer.edges",
        name: "Edges",
        choices: [["free", "free"], ["roller", "on rollers"]],
      },
      {
        path: "transducer.plane",
        name: "Plane",
        choices: [["stress", "stress"], ["strain", "strain"]],
      },
      { path: "transducer.length", name: "Length", unit: "mm", range: [12, 60] },
      { path: "transducer.width", name: "Width", unit: "mm", range: [0.5, 30], logarithmic: true },
    ],
  },
  ...layers(1, 10),
  {
    name: "Tactels",
    controls: [
      { path: "tactels.count", name: "Count", title: "places that read a force", range: [1, 32], whole: true },
      { path: "tactels.pitch", name: "Pitch", unit: "mm", range: [0.25, 3] },
    ],
  },
  imaging({ path: "camera.pixels", name: "Pixels", range: [256, 4096], logarithmic: true, whole: true }),
];

/** Of strips with tactels alone: readings of others do not allow for it. */
export const CREEP = {
  name: "Creep",
  controls: [
    {
      path: "transducer.relaxation",
      name: "Relaxation",
      title: "shares of both moduli and their times",
      example: [
        { share: "6 %", time: "0.4 s" },
        { share: "4 %", time: "15 s" },
      ],
    },
  ],
} satisfies Group;

const QUANTITIES = new Set(
  GROUPS.flatMap(({ controls }) => controls.filter(({ unit }) => unit).map(({ path }) => path)),
);

/** What of a modulus is lost, and in which time. */
interface Term {
  share: string | number;
  time: string;
}

/** A value of a design: a number, a quantity with its unit, a word, two whole numbers, or terms. */
export type Value = string | number | number[] | Term[];
export type Changes = Record<string, Value>;

const PAIR = /^\[?\s*(\d+)\s*[x×,\s]\s*(\d+)\s*\]?$/;

/** What was typed, as the library takes it: a quantity stays text, for it needs its unit. */
export function typed(path: string, text: string): Value {
  const trimmed = text.trim();
  if (path === CREEP.controls[0].path) return terms(trimmed);
  const pair = PAIR.exec(trimmed);
  if (pair) return [Number(pair[1]), Number(pair[2])];
  const plain = !QUANTITIES.has(path) && trimmed !== "" && Number.isFinite(Number(trimmed));
  return plain ? Number(trimmed) : trimmed;
}

/** Terms as they are typed, "6 % 0.4 s, 4 % 15 s"; what makes no sense is left to the library to refuse. */
function terms(text: string): Term[] {
  const parts = text.split(",").map((part) => part.trim());
  return parts.filter(Boolean).map((part) => {
    const [, share, time] = /^(.*\S)\s+([-+.\deE]+\s*[a-zA-Zµ]+)$/.exec(part) ?? [part, part, ""];
    return { share, time };
  });
}

/** A value with as many digits as a person reads. */
export function readable<T>(value: T): T | number {
  return typeof value === "number" ? Number(value.toPrecision(6)) : value;
}

/** A value as it is typed. */
export function spelled(value: Value): string {
  if (!Array.isArray(value)) return `${value}`;
  const parts = value.map((part) => (typeof part === "number" ? part : `${percent(part.share)} ${part.time}`));
  return parts.join(typeof value[0] === "number" ? " × " : ", ");
}

function percent(share: string | number): string {
  return typeof share === "number" ? `${Number((100 * share).toPrecision(6))} %` : share;
}

const SIZES: Record<string, number> = {
  m: 1, cm: 1e-2, mm: 1e-3, um: 1e-6, µm: 1e-6, nm: 1e-9,
  Pa: 1, kPa: 1e3, MPa: 1e6, GPa: 1e9,
};

/** A quantity in the control's own unit, or NaN where only the library can read it. */
export function inUnit(value: Value, unit: string | undefined): number {
  if (!unit) return Number(value);
  const match = /^\s*([-+.\deE]+)\s*([a-zA-Zµ]+)\s*$/.exec(`${value}`);
  return match ? (Number(match[1]) * SIZES[match[2]]) / SIZES[unit] : Number.NaN;
}

export const NOTCHES = 200;

/** Place of a value on its slider, 0 to NOTCHES. */
export function notch(control: Control, value: number): number {
  const [low, high] = control.range as [number, number];
  const share = control.logarithmic
    ? Math.log(value / low) / Math.log(high / low)
    : (value - low) / (high - low);
  return Math.round(clamped(share, 0, 1) * NOTCHES);
}

/** Value at a place of the slider, to three digits. */
export function atNotch(control: Control, place: number): number {
  const [low, high] = control.range as [number, number];
  const share = place / NOTCHES;
  const value = control.logarithmic ? low * (high / low) ** share : low + (high - low) * share;
  return control.whole ? Math.round(value) : Number(value.toPrecision(control.unit === "nm" ? 4 : 3));
}
