/** Colours that colour-blind people tell apart, and the colour of the light itself. */

type Rgb = [number, number, number];

function rgb(hex: string): Rgb {
  return [1, 3, 5].map((at) => Number.parseInt(hex.slice(at, at + 2), 16)) as Rgb;
}

/** 256 colours interpolated between evenly spaced ones, four bytes each. */
function ramp(stops: string[]): Uint8ClampedArray {
  const colours = stops.map(rgb);
  const table = new Uint8ClampedArray(256 * 4);
  for (let i = 0; i < 256; i++) {
    const place = (i / 255) * (colours.length - 1);
    const left = Math.min(Math.floor(place), colours.length - 2);
    for (let c = 0; c < 3; c++) {
      const [low, high] = [colours[left][c], colours[left + 1][c]];
      table[4 * i + c] = low + (high - low) * (place - left);
    }
    table[4 * i + 3] = 255;
  }
  return table;
}

/** Cividis (Nunez, Anderton and Renslow, PLoS ONE 13 (7), 2018), for what is never negative. */
export const CIVIDIS = ramp([
  "#00204d", "#00336f", "#39486b", "#575c6d", "#707173",
  "#8a8779", "#a69d75", "#c4b56c", "#e4cf5b", "#ffea46",
]);

const ON_WHITE = ramp(["#08306b", "#2f79b5", "#a6cbe3", "#f6f4f0", "#f3bd93", "#d2662a", "#7f2704"]);
const ON_BLACK = ramp(["#b9dcff", "#4f9bd9", "#1f4e79", "#15181b", "#78401c", "#dd8038", "#ffd9b0"]);

/** Blue for pressure and orange for tension, about a middle that is the background. */
export function diverging(): Uint8ClampedArray {
  return isDark() ? ON_BLACK : ON_WHITE;
}

export function isDark(): boolean {
  const chosen = document.documentElement.dataset.theme;
  return chosen ? chosen === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}

const inks = new Map<string, string>();

/** A colour of the style sheet, for what is drawn on canvas; asked once, because asking is slow. */
export function inked(name: string): string {
  const key = `${name} ${isDark()}`;
  let ink = inks.get(key);
  if (ink === undefined) {
    ink = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
    inks.set(key, ink);
  }
  return ink;
}

/** What a screen shows for light of a linear colour at 256 intensities; screens are not linear. */
export function lightTable(light: Rgb): Uint8ClampedArray {
  const table = new Uint8ClampedArray(256 * 4);
  for (let i = 0; i < 256; i++) {
    for (let c = 0; c < 3; c++) table[4 * i + c] = 255 * ((i / 255) * light[c]) ** (1 / 2.2);
    table[4 * i + 3] = 255;
  }
  return table;
}

/** Paint values as rows of a picture, from low to high through a table of colours. */
export function painted(
  values: Float32Array,
  columns: number,
  table: Uint8ClampedArray,
  low: number,
  high: number,
): ImageData {
  const picture = new ImageData(columns, values.length / columns);
  const pixels = picture.data;
  const scale = 255 / (high - low || 1);
  for (let i = 0; i < values.length; i++) {
    const shade = 4 * Math.min(Math.max(Math.round((values[i] - low) * scale), 0), 255);
    pixels[4 * i] = table[shade];
    pixels[4 * i + 1] = table[shade + 1];
    pixels[4 * i + 2] = table[shade + 2];
    pixels[4 * i + 3] = 255;
  }
  return picture;
}
