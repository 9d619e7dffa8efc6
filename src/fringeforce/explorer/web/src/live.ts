/** A running sensor: what comes is kept, shown as it comes, or looked at again. */

import type { Connection } from "./connection";
import { byId, save } from "./dom";
import { table } from "./export";
import { clamped } from "./numbers";
import { answer, type Message } from "./protocol";
import { type Moment, Ring } from "./ring";

const STEP = 1;
const LEAP = 30;

/** What is painted of a running sensor of one kind. */
export interface Pictures<M> {
  /** Make ready for a sensor. */
  build(model: M): void;
  /** How the camera does, which is the same for all moments. */
  counts(header: Record<string, unknown>): void;
  draw(model: M, ring: Ring, number: number, friction: number): void;
}

export class Live<M> {
  shown = false;
  private model: M | null = null;
  private run = 0;
  private greeted = false;
  private again = false;
  private paused = false;
  private ended = "";
  private recording = false;
  private cursor = 0;
  private frame = 0;
  private friction = 0.5;
  private readonly ring = new Ring();
  private readonly pictures: Pictures<M>;
  private readonly scrub = byId<HTMLInputElement>("scrub");

  constructor(
    private readonly connection: Connection,
    private readonly left: () => void,
    pictures: (repaint: () => void) => Pictures<M>,
    private readonly tactels: (model: M) => number,
  ) {
    this.pictures = pictures(() => this.redraw());
    const mode = byId("live");
    mode.hidden = false;
    mode.addEventListener("click", () => this.show(!this.shown));
    byId("pause").addEventListener("click", () => this.pause(!this.paused));
    byId("again").addEventListener("click", () => this.restart());
    byId("record").addEventListener("click", () => this.record(!this.recording));
    byId("export").addEventListener("click", () => this.export());
    this.scrub.addEventListener("input", () => this.seek(this.ring.at(this.scrub.valueAsNumber)));
    document.querySelector("input#friction")?.addEventListener("input", (event) => this.assume(event));
    addEventListener("keydown", (event) => this.key(event));
    // a picture that is held, or the last of a recording, follows the page's width too
    new ResizeObserver(() => this.redraw()).observe(byId("watch"));
  }

  /** The server has answered, for the first time or after it was away. */
  greet(): void {
    this.connection.want("model", () => ({ type: "design", slot: "camera" }));
    if (!this.greeted || this.shown) this.show(true);
    this.greeted = true;
  }

  modelled(model: M): void {
    this.model = model;
    this.pictures.build(model);
    this.redraw();
  }

  take(message: Message): void {
    const { header } = message;
    if (header.run !== this.run) this.begin(header.run as number);
    this.ended = header.ended as string;
    if (message.blocks.forces) {
      const before = this.ring.length;
      this.ring.add(answer<Moment>(message), this.recording || (header.recorded as boolean));
      // a picture that is held stays the same when the oldest ones go
      if (this.paused) this.cursor = Math.max(this.cursor + this.ring.length - before - 1, 0);
    }
    if (!this.paused) this.cursor = Math.max(this.ring.length - 1, 0);
    this.pictures.counts(header);
    byId("again").hidden = !this.ended;
    // the camera rests while no page shows it
    if (!this.ended && this.shown) this.want();
    this.redraw();
  }

  redraw(): void {
    if (this.shown && !this.frame) this.frame = requestAnimationFrame(() => this.paint());
  }

  private begin(run: number): void {
    this.run = run;
    this.ring.clear();
    this.pause(false);
  }

  private want(): void {
    this.connection.want("live", () => {
      const { friction, again } = this;
      this.again = false;
      return { type: "live", friction, again };
    });
  }

  private restart(): void {
    this.again = true;
    this.pause(false);
    this.want();
  }

  /** From now on, keep everything in the place of the last minute; it begins with what comes. */
  private record(on: boolean): void {
    if (on) this.begin(this.run);
    this.recording = on;
    byId("record").setAttribute("aria-pressed", `${on}`);
  }

  private export(): void {
    if (!this.model) return;
    save("readings.csv", table(this.ring.all(), this.tactels(this.model)), "text/csv");
  }

  private show(on: boolean): void {
    this.shown = on;
    document.body.classList.toggle("live", on);
    byId("watch").hidden = !on;
    byId("live").setAttribute("aria-pressed", `${on}`);
    if (!on) {
      this.left();
      return;
    }
    if (!this.ended) this.want();
    this.redraw();
  }

  private pause(on: boolean): void {
    this.paused = on;
    if (!on) this.cursor = Math.max(this.ring.length - 1, 0);
    byId("pause").textContent = on ? "Resume" : "Pause";
    this.redraw();
  }

  private seek(number: number): void {
    if (!this.ring.length) return;
    this.pause(true);
    this.cursor = clamped(number, 0, this.ring.length - 1);
  }

  private assume(event: Event): void {
    const field = event.target as HTMLInputElement;
    const usable = field.valueAsNumber > 0 && field.valueAsNumber <= 100;
    field.setAttribute("aria-invalid", `${!usable}`);
    if (usable) this.friction = field.valueAsNumber;
    this.redraw();
  }

  /** Space holds and goes on; arrows look back and forth; wherever no control wants them. */
  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (!this.shown || event.ctrlKey || event.metaKey || event.altKey) return;
    if (target.matches("button, select, summary, input:not([type=range])")) return;
    const number = this.ring.length - 1;
    const keys: Record<string, () => void> = {
      " ": () => this.pause(!this.paused),
      ArrowLeft: () => this.seek(this.cursor - STEP),
      ArrowRight: () => this.seek(this.cursor + STEP),
      PageDown: () => this.seek(this.cursor - LEAP),
      PageUp: () => this.seek(this.cursor + LEAP),
      Home: () => this.seek(0),
      End: () => this.seek(number),
    };
    // pages scroll with these keys; only the slider takes them from the page
    if (/^(Page|Home|End)/.test(event.key) && target !== this.scrub) return;
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  }

  private paint(): void {
    this.frame = 0;
    const { ring, model } = this;
    if (!model || !ring.length || !ring.oldest || !ring.newest) return;
    const moment = ring.get(this.cursor);
    this.scrub.min = `${ring.oldest.time}`;
    this.scrub.max = `${ring.newest.time}`;
    this.scrub.value = `${moment.time}`;
    const back = ring.newest.time - moment.time;
    const words = `${moment.time.toFixed(2)} s${back > 0.005 ? `, ${back.toFixed(2)} s back` : ""}`;
    this.scrub.setAttribute("aria-valuetext", words);
    byId("moment").textContent = words;
    this.pictures.draw(model, ring, this.cursor, this.friction);
  }
}
