/** Canvases that are sharp, and pictures that are painted on them. */

import { painted } from "./colours";

/** Of the letters on pictures. */
export const FONT = "11px system-ui, sans-serif";

const scratch = new OffscreenCanvas(1, 1);

/** A canvas of a size in CSS pixels, sharp on dense screens, cleared and ready to draw. */
export function prepared(
  canvas: HTMLCanvasElement,
  width: number,
  height: number,
): CanvasRenderingContext2D {
  const density = window.devicePixelRatio || 1;
  const [columns, rows] = [Math.round(width * density), Math.round(height * density)];
  if (canvas.width !== columns || canvas.height !== rows) {
    canvas.width = columns;
    canvas.height = rows;
    canvas.style.width = `${width}px`;
    canvas.style.height = `${height}px`;
  }
  const context = canvas.getContext("2d") as CanvasRenderingContext2D;
  context.setTransform(density, 0, 0, density, 0, 0);
  context.clearRect(0, 0, width, height);
  return context;
}

/** Draw a picture stretched to a size. */
export function blit(
  context: CanvasRenderingContext2D,
  picture: ImageData,
  x: number,
  y: number,
  width: number,
  height: number,
): void {
  scratch.width = picture.width;
  scratch.height = picture.height;
  scratch.getContext("2d")?.putImageData(picture, 0, 0);
  context.drawImage(scratch, x, y, width, height);
}

/** All colours of a table, from its first on the left. */
export function colourBar(
  context: CanvasRenderingContext2D,
  table: Uint8ClampedArray,
  x: number,
  y: number,
  width: number,
  height: number,
): void {
  const places = Float32Array.from({ length: 256 }, (_, i) => i);
  blit(context, painted(places, 256, table, 0, 255), x, y, width, height);
}
