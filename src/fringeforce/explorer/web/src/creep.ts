/** A strip that creeps in slow and fast motion: pressed, held and released; asked for while it is shown. */

import { Choice } from "./commands";
import type { Connection } from "./connection";
import { type Changes, CREEP } from "./controls";
import { blankCanvas, byId, set, write } from "./dom";
import { drawFringes } from "./fringes";
import { layout } from "./layout";
import type { Model } from "./model";
import { clamped, fixed } from "./numbers";
import { Plot } from "./plots";
import { answer, type Message } from "./protocol";

type Loads = "at once" | "over time";
const LOADS: { key: Loads; name: string; hint: string }[] = [
  { key: "at once", name: "At once", hint: "Loads that have just begun to act, as all other pictures show" },
  { key: "over time", name: "Over time", hint: "Press, hold and release, and read with and without what the design says of creep" },
];
const WAYS = ["without", "with"] as const;
/** Of each moment while it is played [ms]. */
const PACE = 100;
/** Width that a time needs on the axis [px]. */
const LABEL = 46;

interface Crept {
  design: number;
  /** First moment behind press and release, and length of the hold [s]; moments of either. */
  first: number;
  held: number;
  steps: number;
  status: Record<(typeof WAYS)[number], string[]>;
  times: Float32Array;
  acts: Float32Array;
  /** Of all moments, one after another [rad]. */
  phase: Float32Array;
  /** Forces of all tactels together, normal and tangential, and their deviations [N]. */
  true: Float32Array;
  without_read: Float32Array;
  with_read: Float32Array;
  with_std: Float32Array;
}

interface Keeper {
  /** Seconds for which a load is held, 0 for as long as the design asks for; null where it is not shown. */
  creep: number | null;
  readonly loads: number[];
  readonly state: { changes: Changes };
  change(part: { changes: Changes }): void;
}

export class CreepPanel {
  private shown: Crept | null = null;
  private refused = "";
  private moment = 0;
  private timer = 0;
  private width = 0;
  private readonly choice: Choice<Loads>;
  private readonly canvases = [blankCanvas(), blankCanvas()];
  private readonly slider = byId<HTMLInputElement>("creep-time");
  private readonly field = byId<HTMLInputElement>("creep-held");
  private readonly phases = new Plot(byId("creep-phase"), {
    height: 150,
    label: "phase, rad",
    curves: [
      { label: "at once", ink: "ink" },
      { label: "at this moment", ink: "read", width: 2, dash: [5, 4] },
    ],
    range: () => this.span,
  });
  private readonly forces = new Plot(byId("creep-forces"), {
    height: 190,
    label: "N",
    curves: [
      { label: "true", ink: "ink" },
      { label: "without", ink: "normal", width: 2 },
      { label: "with", ink: "read", width: 2, dash: [5, 4] },
      { label: "upper", ink: "read", width: 0 },
      { label: "lower", ink: "read", width: 0 },
    ],
    band: [4, 5],
    across: {
      range: (low, high) => [low, high],
      tick: (place) => `${Number(this.since(place).toPrecision(1))} s`,
      places: () => this.decades(),
    },
    marks: () => [
      { at: this.released - 0.5, dash: [2, 3] },
      { at: this.moment, dash: [] },
    ],
  });
  /** Lowest and highest phase of all moments [rad]. */
  private span: [number, number] = [0, 1];

  /** Asks with the question of the page, which has the loads. */
  constructor(
    private readonly store: Keeper,
    private readonly connection: () => Connection,
    private readonly question: (more: object) => Record<string, unknown> | null,
    private readonly repaint: () => void,
  ) {
    this.choice = new Choice(byId("creep"), "creep", LOADS, (loads) => {
      store.creep = loads === "over time" ? Number(this.field.value) : null;
      this.play(false);
      this.want();
      repaint();
    });
    byId("creep-fringes").append(...this.canvases);
    byId("creep-play").addEventListener("click", () => this.play(!this.timer));
    this.slider.addEventListener("input", () => {
      this.play(false);
      this.seek(this.slider.valueAsNumber);
    });
    this.field.addEventListener("change", () => {
      if (!this.field.reportValidity()) return;
      store.creep = Number(this.field.value);
      this.want();
      repaint();
    });
    byId("creep-try").addEventListener("click", () => {
      const { path, example } = CREEP.controls[0];
      store.creep = 0;
      store.change({ changes: { ...store.state.changes, [path]: example } });
    });
  }

  /** Ask for what loads of now do, if it is shown. */
  want(): void {
    const { creep } = this.store;
    if (creep !== null) this.connection().want("creep", () => this.question({ held: creep }));
  }

  take(message: Message): void {
    const shown = answer<Crept>(message);
    const { phase, times } = shown;
    let [low, high] = [0, 0.01];
    for (const value of phase) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
    const room = 0.05 * (high - low);
    this.span = [low - room, high + room];
    if (this.shown?.times.length !== times.length) this.moment = 1;
    this.shown = shown;
    this.refused = "";
    for (const plot of [this.phases, this.forces]) plot.forget();
    this.repaint();
  }

  refuse(text: string): void {
    this.shown = null;
    this.refused = text;
    this.repaint();
  }

  draw(model: Model, width: number): void {
    const on = this.store.creep !== null;
    const { creeps } = model.facts;
    byId("creep").hidden = !creeps;
    byId("creep-try").hidden = creeps;
    this.choice.show(on ? "over time" : "at once");
    const shown = creeps && on && this.shown?.design === model.id ? this.shown : null;
    byId("crept").hidden = !shown;
    write(byId("creep-note"), this.note(creeps, shown));
    if (!shown) this.play(false);
    if (shown) this.paint(shown, model, width);
  }

  private paint(shown: Crept, model: Model, width: number): void {
    const pixels = model.x.length;
    this.width = width;
    this.slider.max = `${shown.times.length - 1}`;
    this.slider.value = `${this.moment}`;
    if (document.activeElement !== this.field) this.field.value = `${shown.held}`;
    const acts = shown.acts[this.moment];
    const phases = [
      model.phase(this.store.loads.map((load) => acts * load)),
      shown.phase.subarray(this.moment * pixels, (this.moment + 1) * pixels),
    ];
    const place = layout(width, model.facts.strip.length);
    phases.forEach((phase, i) => drawFringes(this.canvases[i], model, phase, place));
    this.phases.draw(width, [model.millimetres, ...phases]);
    const part = this.part(shown);
    const [truth, without, read, std] = (["true", "without_read", "with_read", "with_std"] as const).map((name) =>
      Array.from(shown.times, (_, k) => shown[name][2 * k + part]),
    );
    const [upper, lower] = [2, -2].map((reach) => read.map((value, k) => value + reach * std[k]));
    const curves = [truth, without, read, upper, lower].map((curve) => curve.map((v) => (Number.isFinite(v) ? v : null)));
    this.forces.draw(width, [truth.map((_, k) => k), ...curves]);
    const when = this.when(shown);
    write(byId("creep-moment"), when);
    set(this.slider, { "aria-valuetext": when });
    const [now, seen, found, spread] = [truth, without, read, std].map((curve) => curve[this.moment]);
    const told = WAYS.map((way) => shown.status[way][this.moment].replaceAll("_", " "));
    const kind = part ? "Tangential" : "Normal";
    write(
      byId("creep-words"),
      `${kind} force of all tactels together: ${fixed(now, 2)} N act; read without creep taken out ${fixed(seen, 2)} N (${told[0]}), with it taken out ${fixed(found, 2)} ± ${fixed(2 * spread, 2)} N (${told[1]}).`,
    );
  }

  private note(creeps: boolean, shown: Crept | null): string {
    if (!creeps) return "This strip does not creep: its layers have no relaxation, under Creep in the design.";
    if (this.store.creep === null) return "All other pictures show loads that have just begun to act.";
    const busy = this.connection().busy("creep");
    if (!shown) return busy ? "Exposing and reading the frames of a press …" : this.refused;
    const { steps, held } = shown;
    const part = this.part(shown);
    const load = shown.true[2 + part];
    if (!load) return "Nothing acts; press the strip to see it creep.";
    const share = (k: number) => (100 * shown.without_read[2 * k + part]) / load;
    const parts = [
      `Without creep taken out, the load reads ${fixed(share(steps + 1) - 100, 1)} % too large after ${seconds(held)}; when it is gone, ${fixed(share(steps + 2), 1)} % of it are still read at once and ${fixed(share(2 * steps + 2), 1)} % after ${seconds(held)}.`,
    ];
    if (busy) parts.push("Reading the loads of now …");
    return parts.join(" ");
  }

  /** Whether the loads are rather tangential: 1, or normal: 0. */
  private part(shown: Crept): number {
    return Math.abs(shown.true[3]) > Math.abs(shown.true[2]) ? 1 : 0;
  }

  /** The first moment behind the release. */
  private get released(): number {
    return (this.shown?.steps ?? 0) + 2;
  }

  private when(shown: Crept): string {
    const { first, held, times } = shown;
    if (this.moment === 0) return "before the press";
    const gone = this.moment >= this.released;
    const since = Math.max(times[this.moment] - first - (gone ? first + held : 0), 0);
    return `${seconds(since)} after the ${gone ? "release" : "press"}`;
  }

  /** Seconds behind press or release at a place of the axis, which counts moments. */
  private since(place: number): number {
    if (!this.shown) return 0;
    const { first, held, steps } = this.shown;
    const along = place - (place >= this.released ? this.released : 1) - 1;
    return first * (held / first) ** (along / (steps - 1));
  }

  /** Places of powers of ten on the axis, as many as there is room for. */
  private decades(): number[] {
    if (!this.shown) return [];
    const { first, held, steps } = this.shown;
    const [low, high] = [Math.ceil(Math.log10(first) - 1e-6), Math.floor(Math.log10(held) + 1e-6)];
    const every = Math.max(1, Math.ceil((LABEL * (high - low + 1)) / (this.width / 2 - LABEL)));
    const found: number[] = [];
    for (let power = low; power <= high; power += every) {
      found.push(2 + (steps - 1) * (Math.log(10 ** power / first) / Math.log(held / first)));
    }
    return [...found, ...found.map((place) => place + steps + 1)];
  }

  private seek(moment: number): void {
    this.moment = clamped(Math.round(moment), 0, (this.shown?.times.length ?? 1) - 1);
    this.repaint();
  }

  /** Let the moments follow each other, from the first one if the last is shown. */
  private play(on: boolean): void {
    clearInterval(this.timer);
    this.timer = 0;
    byId("creep-play").textContent = on ? "Pause" : "Play";
    if (!on) return;
    const last = (this.shown?.times.length ?? 1) - 1;
    if (this.moment >= last) this.seek(0);
    this.timer = setInterval(() => {
      this.seek(this.moment + 1);
      if (this.moment >= last) this.play(false);
    }, PACE);
  }
}

/** Less than a millisecond is rounding of times since the start. */
function seconds(time: number): string {
  if (time < 1e-3) return "0 s";
  return `${Number(time.toPrecision(3))} s`;
}
