/** Everything that is painted of one moment of a running pad. */

import { blankCanvas, byId, element, set } from "../dom";
import { History } from "../history";
import type { Pictures } from "../live";
import { fixed } from "../numbers";
import type { Ring } from "../ring";
import { showCounts, showMoment } from "../watching";
import { ForceMap } from "./map";
import type { PadModel, PadMoment, Raster } from "./model";
import { raster } from "./surface";

const SPAN = 10;
const NAMES = ["N", "T x", "T y"];
const QUANTITIES: [name: string, unit: string, factor: number, digits: number][] = [
  ["Normal", "N", 1, 2],
  ["Shear x", "N", 1, 3],
  ["Shear y", "N", 1, 3],
  ["Moment", "N mm", 1e3, 2],
  ["Centre x", "mm", 1e3, 2],
  ["Centre y", "mm", 1e3, 2],
];

export class PadLivePictures implements Pictures<PadModel> {
  private readonly canvas = blankCanvas();
  private readonly map = new ForceMap(byId("watch-map"), byId("watch-scale"));
  private readonly history = new History(byId("watch-history"), "all tactels [N]", 0, 1, SPAN);
  private readonly values: HTMLElement[];

  constructor() {
    byId("watch-image").append(this.canvas);
    this.values = QUANTITIES.map(([name, unit]) => {
      const value = element("dd", {}, "–");
      byId("watch-sums").append(element("div", {}, element("dt", {}, `${name} [${unit}]`), value));
      return value;
    });
    this.history.build(NAMES.length);
    const lines = this.history.legend();
    lines.forEach((line, k) => { line.textContent = NAMES[k]; });
    byId("watch-lines").replaceChildren(...lines);
  }

  build(model: PadModel): void {
    set(this.canvas, { "aria-label": `The pad as its camera sees it, ${model.facts.name}.` });
  }

  counts(header: Record<string, unknown>): void {
    showCounts(header);
  }

  draw(model: PadModel, ring: Ring, number: number): void {
    const moment = ring.get(number) as PadMoment;
    this.camera(model, moment);
    this.map.draw(model, null, moment);
    QUANTITIES.forEach(([, , factor, digits], k) => {
      this.values[k].textContent = fixed(moment.sums[k] * factor, digits);
    });
    const span = ring.until(number, SPAN) as PadMoment[];
    this.history.draw(byId("watch-history").clientWidth, span.map(summed));
    showMoment(moment);
  }

  /** The image from above, stretched to the room that there is. */
  private camera(model: PadModel, picture: Raster): void {
    const [halfX, halfY] = model.half;
    const [rows, columns] = picture.shape;
    const width = byId("watch-image").clientWidth;
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${(width * halfY) / halfX}px`;
    if (this.canvas.width !== columns || this.canvas.height !== rows) {
      this.canvas.width = columns;
      this.canvas.height = rows;
    }
    this.canvas.getContext("2d")?.putImageData(raster(picture), 0, 0);
  }
}

/** A moment whose forces are those of all tactels together. */
function summed(moment: PadMoment): PadMoment {
  return { ...moment, forces: moment.sums };
}
