/** Everything that is painted of one load: pictures, curves and readings, from top to bottom. */

import { Compare } from "./compare";
import { blankCanvas, byId, save, write } from "./dom";
import type { Picture } from "./download";
import { figure, rastered } from "./figure";
import { drawFringes, fringeCount } from "./fringes";
import { LEFT, layout, type Layout, RIGHT, Sight } from "./layout";
import { intensity, type Mesh, type Model, type Reading } from "./model";
import { showVerdict } from "./page";
import { Plot } from "./plots";
import { Readings } from "./readings";
import { drawScale, drawStress, megapascals, NAMES } from "./stress";
import type { Store } from "./store";
import { Strip } from "./strip";

export class Painting {
  readonly compare = new Compare();
  private readonly strip: Strip;
  private readonly readings = new Readings(byId("reading"));
  private readonly stress = canvasIn("stress");
  private readonly scale = canvasIn("stress");
  private readonly fringes = canvasIn("fringes");
  private readonly phasePlot = new Plot(byId("phase"), {
    height: 170,
    label: "rad",
    curves: [
      { label: "true", ink: "ink" },
      { label: "read", ink: "read", width: 2, dash: [5, 4] },
      { label: "upper", ink: "read", width: 0 },
      { label: "lower", ink: "read", width: 0 },
    ],
    band: [3, 4],
  });
  private readonly cameraPlot = new Plot(byId("camera"), {
    height: 140,
    label: "grey level",
    curves: [
      { label: "with noise", ink: "noise", width: 1 },
      { label: "without noise", ink: "ink", width: 1 },
    ],
    range: () => [0, this.fullScale],
  });
  private readonly sight: Sight;
  private fullScale = 255;
  private limit = 0;
  private phase: Float32Array = new Float32Array();
  private model: Model | null = null;

  constructor(
    private readonly store: Store,
    repaint: () => void,
  ) {
    this.strip = new Strip(byId("strip"), store, repaint);
    this.sight = new Sight(repaint);
    this.sight.watch(...["stress", "fringes", "phase", "camera", "compare"].map((id) => byId(id)));
    this.scale.setAttribute("aria-hidden", "true");
  }

  /** All that follows from the load, without anybody being asked. */
  paintLoad(model: Model, finite: Mesh | null): void {
    const { view, loads } = this.store;
    const width = byId("strip").clientWidth;
    const place = layout(width, model.facts.strip.length);
    this.model = model;
    this.phase = model.phase(loads);
    this.strip.draw(model, place);
    // until the new stresses come, those of the design before stay
    if (model.whole && this.shows("stress")) {
      this.limit = drawStress(this.stress, model, loads, view.component, place, view.mesh ? (finite ?? model.mesh(loads)) : null);
      drawScale(this.scale, view.component, this.limit, width);
    }
    if (this.shows("fringes")) drawFringes(this.fringes, model, this.phase, place);
    write(byId("fringe-count"), fringeCount(this.phase));
    if (view.compare && this.shows("compare")) {
      this.compare.draw(loads, view.component, view.mesh, width);
    }
  }

  /** What the noisy line says, beside the truth. */
  paintReading(model: Model, reading: Reading | null): void {
    const place = layout(byId("strip").clientWidth, model.facts.strip.length);
    this.curves(model, reading, place);
    this.readings.draw(model, this.store.state, reading, place);
    showVerdict(reading);
  }

  private shows(id: string): boolean {
    return this.sight.sees(byId(id));
  }

  /** Save the pictures as a figure. */
  async save(kind: Picture, reading: Reading | null): Promise<void> {
    if (!this.model) return;
    const { component } = this.store.view;
    const drawing = figure(this.model, this.store.state, this.phase, reading, {
      stress: cropped(this.stress, this.model),
      stressTitle: `${NAMES[component]}, colours to ±${megapascals(this.limit)}`,
      fringes: cropped(this.fringes, this.model),
    });
    if (kind === "svg") save("figure.svg", drawing, "image/svg+xml");
    else save("figure.png", await rastered(drawing), "image/png");
  }

  private curves(model: Model, reading: Reading | null, place: Layout): void {
    const x = model.millimetres;
    const fits = reading && reading.phase.length === x.length;
    const read = fits ? reading.phase : x.map(() => Number.NaN);
    if (this.shows("phase")) {
      const spread = fits ? reading.phase_std : read;
      const upper = read.map((value, i) => value + 2 * spread[i]);
      const lower = read.map((value, i) => value - 2 * spread[i]);
      this.phasePlot.draw(place.width, [x, this.phase, read, upper, lower]);
    }
    if (!this.shows("camera")) return;
    const { amplitude, offset, full_scale } = model.facts.camera;
    if (this.fullScale !== full_scale) this.cameraPlot.forget();
    this.fullScale = full_scale;
    const expected = this.phase.map((value) => amplitude * intensity(value) + offset);
    const frame = fits ? Float32Array.from(reading.frame) : read;
    this.cameraPlot.draw(place.width, [x, frame, expected]);
  }
}

function canvasIn(id: string): HTMLCanvasElement {
  const canvas = blankCanvas();
  byId(id).append(canvas);
  return canvas;
}

/** The part of a canvas that shows the strip, as a picture's address. */
function cropped(canvas: HTMLCanvasElement, model: Model): string {
  const density = canvas.width / Number.parseFloat(canvas.style.width);
  const width = canvas.width - (LEFT + RIGHT) * density;
  const depth = (model.facts.layers[0] + model.facts.layers[1]) * (width / model.facts.strip.length);
  const margin = Math.max((canvas.height - depth) / 2, 0);
  const inner = canvas.parentElement?.id === "stress" ? margin : 0;
  const copy = document.createElement("canvas");
  copy.width = width;
  copy.height = canvas.height - 2 * inner;
  copy.getContext("2d")?.drawImage(canvas, -LEFT * density, -inner);
  return copy.toDataURL("image/png");
}
