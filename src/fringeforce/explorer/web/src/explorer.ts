/** The page as a whole: what happens, who is asked, and one painting per animation frame. */

import { EDGES, type Edges } from "./compare";
import { Connection } from "./connection";
import { CREEP, GROUPS } from "./controls";
import { CreepPanel } from "./creep";
import { DesignForm } from "./design";
import { byId } from "./dom";
import { downloadMenu, PICTURES, saveFile } from "./download";
import { showFigures } from "./figures";
import { Live } from "./live";
import { LivePictures } from "./livepictures";
import { type Figure, Model, type Reading } from "./model";
import { Page } from "./page";
import { Painting } from "./painting";
import { presetLoads, refitted } from "./presets";
import { answer, type Message } from "./protocol";
import { type State, Store } from "./store";
import { StrainPanel } from "./strain";
import { Toolbar } from "./toolbar";
import { Tour } from "./tour";
import { TypedForces } from "./typed";

export class Explorer {
  private model: Model | null = null;
  private reading: Reading | null = null;
  /** Of the design before, to tell what changed. */
  private figures: Figure[] = [];
  private frame = 0;
  private loadChanged = true;
  private live: Live<Model> | null = null;
  private readonly store = new Store(location.hash, (before) => this.changed(before));
  private readonly page = new Page(this.store, () => this.schedule());
  private readonly painting = new Painting(this.store, () => this.schedule());
  private readonly form = new DesignForm(this.store, [...GROUPS, CREEP]);
  private readonly strain = new StrainPanel(
    this.store,
    () => this.connection,
    () => this.question("strain", {}),
    () => this.schedule(),
  );
  private readonly creep = new CreepPanel(
    this.store,
    () => this.connection,
    (more) => (this.model?.facts.creeps ? this.question("creep", more) : null),
    () => this.schedule(false),
  );
  private readonly typed = new TypedForces(this.store);
  private readonly toolbar = new Toolbar(this.store, {
    preset: (key) => this.preset(key),
    view: () => this.viewed(),
  });
  private readonly connection = new Connection(
    (message) => this.receive(message),
    (alive) => this.linked(alive),
  );

  constructor() {
    new Tour(
      (key) => this.preset(key),
      () => this.kept(),
    );
    downloadMenu(
      PICTURES,
      (kind) => this.connection.want("download", () => this.question("download", { kind })),
      (kind) => this.painting.save(kind, this.reading),
    );
  }

  private changed(before: State): void {
    const { state } = this.store;
    // the new design, once it is there, is read by itself
    if (before.start !== state.start || before.changes !== state.changes) this.wantDesign();
    else this.wantReading();
    this.schedule();
  }

  private viewed(): void {
    if (this.store.view.compare) this.wantEdges();
    this.schedule();
  }

  private preset(key: string): void {
    if (this.model) {
      this.store.change({ preset: key, ...presetLoads(key, this.model.tactels.length) });
    }
  }

  /** What brings the forces of now back, if the design still has as many tactels. */
  private kept(): () => void {
    const { preset, normal, tangential } = this.store.state;
    return () => {
      if (this.store.state.normal.length === normal.length) {
        this.store.change({ preset, normal, tangential });
      }
    };
  }

  private wantDesign(): void {
    const wish = () => ({
      type: "design",
      slot: "main",
      start: this.store.state.start,
      changes: this.store.state.changes,
    });
    this.connection.want("design", wish);
    if (this.store.view.compare) this.wantEdges();
  }

  private wantEdges(): void {
    for (const edges of EDGES) {
      this.connection.want(edges, () => ({
        type: "design",
        slot: edges,
        start: this.store.state.start,
        changes: { ...this.store.state.changes, "transducer.edges": edges },
      }));
    }
  }

  private wantReading(): void {
    this.connection.want("read", () => this.question("read", {}));
    this.strain.want();
    this.creep.want();
  }

  /** A question about the current load of the current design; none while they do not fit. */
  private question(type: string, more: object): Record<string, unknown> | null {
    const { normal, tangential, seed } = this.store.state;
    if (!this.model || normal.length !== this.model.tactels.length) return null;
    const forces = normal.map((force, i) => [force, tangential[i]]);
    return { type, design: this.model.id, forces, seed, ...more };
  }

  private receive(message: Message): void {
    const { header, blocks } = message;
    if (message.type === "hello") this.greeted(header);
    else if (message.type === "live") this.live?.take(message);
    else if (message.type === "model") this.modelled(new Model(message), header.slot as string);
    else if (message.type === "inside") this.completed(message);
    else if (message.type === "reading") this.read(answer<Reading>(message));
    else if (message.type === "strain") this.strain.take(message);
    else if (message.type === "creep") this.creep.take(message);
    else if (message.type === "file") saveFile(header.name as string, blocks.content as Uint8Array);
    else if (message.type === "refused") this.refused(header);
  }

  private greeted(header: Record<string, unknown>): void {
    this.page.offer(header.designs as string[], this.store.state.start);
    if (header.camera) {
      this.live ??= new Live(
        this.connection,
        () => this.schedule(),
        (repaint) => new LivePictures(repaint),
        (model) => model.tactels.length,
      );
      this.live.greet();
    }
  }

  private modelled(model: Model, slot: string): void {
    if (slot === "camera") {
      this.live?.modelled(model);
      return;
    }
    this.connection.want(`inside ${slot}`, () => ({ type: "inside", slot, design: model.id }));
    if (slot !== "main") {
      this.painting.compare.take(slot as Edges, model);
      return;
    }
    this.page.notice("");
    const n = model.tactels.length;
    const { normal, tangential, preset } = this.store.state;
    if (normal.length !== n) {
      this.store.amend(
        preset
          ? presetLoads(preset, n)
          : { normal: refitted(normal, n), tangential: refitted(tangential, n) },
      );
    }
    asDrawn(model);
    this.model = model;
    this.form.show(model.facts.values);
    this.page.choose(this.store.state.start);
    this.wantReading();
    this.schedule();
  }

  private completed(message: Message): void {
    const { design } = message.header;
    const main = design === this.model?.id;
    const model = main ? this.model : this.painting.compare.find(design);
    model?.complete(message);
    if (main) {
      const figures = message.header.figures as Figure[];
      showFigures(figures, this.figures);
      this.figures = figures;
    }
    this.schedule();
  }

  private read(reading: Reading): void {
    if (reading.design !== this.model?.id) return;
    this.reading = reading;
    this.schedule(false);
  }

  private refused(header: Record<string, unknown>): void {
    if (header.stale) return;
    const text = header.text as string;
    if (header.of === "strain" || header.of === "creep") {
      this[header.of].refuse(text);
      return;
    }
    const aboutDesign = header.of === "design" && header.slot === "main";
    if (header.of !== "design" || aboutDesign) {
      this.page.notice(aboutDesign ? this.form.refuse(text) : text);
    }
  }

  private linked(alive: boolean): void {
    this.page.linked(alive);
    if (alive) this.wantDesign();
  }

  private schedule(loadChanged = true): void {
    this.loadChanged ||= loadChanged;
    if (!this.frame) this.frame = requestAnimationFrame(() => this.paint());
  }

  private paint(): void {
    this.frame = 0;
    this.toolbar.show();
    if (this.live?.shown) {
      this.live.redraw();
      return;
    }
    if (!this.model || this.store.state.normal.length !== this.model.tactels.length) return;
    if (this.loadChanged) {
      this.typed.draw();
      this.painting.paintLoad(this.model, this.strain.mesh(this.model));
    }
    this.loadChanged = false;
    this.painting.paintReading(this.model, this.reading);
    this.strain.draw(this.model, byId("strip").clientWidth);
    this.creep.draw(this.model, byId("strip").clientWidth);
    this.page.keep();
  }
}

/** Say where the numbers come from, if the page was started with a model. */
function asDrawn({ facts }: Model): void {
  const line = byId("as-drawn");
  line.hidden = !facts.as_drawn && !facts.calibrated;
  line.textContent = facts.calibrated
    ? "Calibrated: as the sensor was measured."
    : "As drawn: what the loaded model was measured to be holds for its own design only. Undo leads back.";
}
