/** Everything that is painted of one moment of a running sensor. */

import { blankCanvas, byId, element, write } from "./dom";
import { drawFringes } from "./fringes";
import { History } from "./history";
import { type Layout, layout, Sight } from "./layout";
import type { Pictures } from "./live";
import type { Model } from "./model";
import { fixed } from "./numbers";
import { Plot } from "./plots";
import { Readings } from "./readings";
import type { Moment, Ring } from "./ring";
import { Slip } from "./slip";
import { showCounts, showMoment } from "./watching";

const SPAN = 10;
const TOLD = 6;
/** Force from which a centre of pressure means something [N]: some of its standard deviations. */
const PRESSED = 0.1;
const WORDS: Record<string, string> = { slip: "near slip", stick: "holds" };

export class LivePictures implements Pictures<Model> {
  private readonly canvas = blankCanvas();
  private readonly readings: Readings;
  private readonly slip: Slip;
  private readonly normal = new History(byId("watch-normal"), "normal force [N]", 0, 2, SPAN);
  private readonly tangential = new History(byId("watch-tangential"), "tangential force [N]", 1, 2, SPAN);
  private readonly camera = new Plot(byId("watch-camera"), {
    height: 120,
    label: "grey level",
    curves: [{ label: "camera line", ink: "noise", width: 1 }],
    range: () => [0, this.fullScale],
  });
  private readonly sight: Sight;
  private fullScale = 255;
  private millimetres: Float32Array = new Float32Array();

  constructor(repaint: () => void) {
    byId("watch-fringes").append(this.canvas);
    this.readings = new Readings(byId("watch-forces"));
    this.slip = new Slip(byId("watch-slip"));
    this.sight = new Sight(repaint);
    this.sight.watch(...["fringes", "forces", "normal", "tangential", "slip"].map(panel));
  }

  /** Make ready for a sensor. */
  build(model: Model): void {
    this.fullScale = model.facts.camera.full_scale;
    this.millimetres = model.millimetres;
    const n = model.tactels.length;
    for (const plot of [this.normal, this.tangential]) plot.build(n);
    byId("watch-lines").replaceChildren(...this.normal.legend());
  }

  /** How the camera does, which is the same for all moments. */
  counts(header: Record<string, unknown>): void {
    showCounts(header);
  }

  draw(model: Model, ring: Ring, number: number, friction: number): void {
    const moment = ring.get(number);
    const place = layout(byId("watch-fringes").clientWidth, model.facts.strip.length);
    const span = ring.until(number, SPAN);
    this.along(model, moment, place);
    if (this.shows("forces")) this.readings.draw(model, null, moment, place, reach(span));
    if (this.shows("normal")) this.normal.draw(place.width, span);
    if (this.shows("tangential")) this.tangential.draw(place.width, span);
    if (this.shows("slip")) {
      this.slip.draw(model, moment, place, friction);
      this.events(ring.until(number, 2 * SPAN));
    }
    write(byId("watch-total"), together(moment, model.tactels));
    showMoment(moment);
  }

  private along(model: Model, moment: Moment, place: Layout): void {
    if (!this.shows("fringes")) return;
    drawFringes(this.canvas, model, moment.phase, place);
    const frame = Float32Array.from(moment.frame);
    this.camera.draw(place.width, [this.millimetres, frame]);
  }

  private events(span: Moment[]): void {
    const lines = span.flatMap(({ time, events }) => {
      const kinds = [...new Set(events.map(([kind]) => kind))];
      return kinds.map((kind) => {
        const tactels = events.filter((event) => event[0] === kind).map((event) => event[1] + 1);
        return `${time.toFixed(1)} s: ${WORDS[kind] ?? kind} at ${tactels.join(", ")}`;
      });
    });
    const last = lines.slice(-TOLD);
    const list = byId("watch-events");
    if (list.dataset.told === last.join()) return;
    list.dataset.told = last.join();
    list.replaceChildren(...last.map((line) => element("li", {}, line)));
  }

  private shows(name: string): boolean {
    return this.sight.sees(panel(name));
  }
}

/** The forces of all tactels, and the centre of pressure where they press as one. */
function together({ forces }: Moment, places: Float32Array): string {
  let [normal, tangential, moment] = [0, 0, 0];
  places.forEach((place, k) => {
    normal += forces[2 * k];
    tangential += forces[2 * k + 1];
    moment += place * forces[2 * k];
  });
  if (!Number.isFinite(normal + tangential)) return "";
  const sums = `Together ${fixed(normal, 2)} N normal, ${fixed(tangential, 2)} N tangential`;
  return normal > PRESSED ? `${sums}, centre at ${fixed((1e3 * moment) / normal, 1)} mm` : sums;
}

/** Forces that the scale must hold, lowest and highest of a span, so that it does not twitch. */
function reach(span: Moment[]): [number, number] {
  let [low, high] = [0, 0.1];
  for (const { forces } of span) {
    for (const force of forces) {
      if (force < low) low = force;
      if (force > high) high = force;
    }
  }
  return [low, high];
}

function panel(name: string): HTMLElement {
  return byId(`watch-${name}`);
}
