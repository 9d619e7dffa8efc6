/** The page of a skin: what happens, who is asked, and one painting per animation frame. */

import { commands, showCommands } from "../commands";
import { Connection } from "../connection";
import { GROUPS } from "../controls";
import { DesignForm } from "../design";
import { blankCanvas, byId, save } from "../dom";
import { downloadMenu, saveFile } from "../download";
import { drawFringes } from "../fringes";
import { layout } from "../layout";
import { Page } from "../page";
import { Plot } from "../plots";
import { answer, type Message } from "../protocol";
import { StrainPanel } from "../strain";
import { Editor } from "./editor";
import { held, sent } from "./fingers";
import { SkinModel, type SkinReading } from "./model";
import { type State, SkinStore } from "./store";
import { StripView } from "./strip";
import { showContacts } from "./sums";

const SKIN_GROUPS = GROUPS.map((group) =>
  group.name !== "Tactels"
    ? group
    : { name: "Skin", controls: [{ path: "skin.extent", name: "Extent", unit: "mm", range: [4, 24] as [number, number] }] },
);
const CURVES = [
  { label: "true", ink: "ink" },
  { label: "read", ink: "read", width: 2, dash: [5, 4] },
  { label: "upper", ink: "read", width: 0 },
  { label: "lower", ink: "read", width: 0 },
];
const MEGA = 1e-6;
const PICTURES = { png: "Fringes (.png)" } as const;

export class SkinExplorer {
  private model: SkinModel | null = null;
  private reading: SkinReading | null = null;
  private frame = 0;
  private fullScale = 255;
  private readonly fringes = blankCanvas();
  private readonly store = new SkinStore(location.hash, (before) => this.changed(before));
  private readonly page = new Page(this.store, () => this.schedule());
  private readonly strip = new StripView(this.store);
  private readonly editor = new Editor(this.store);
  private readonly form = new DesignForm(this.store, SKIN_GROUPS, false);
  private readonly strain = new StrainPanel(
    this.store,
    () => this.connection,
    () => this.question("strain", {}),
    () => this.schedule(),
  );
  private readonly plots = (["pressure", "shear"] as const).map(
    (part) => new Plot(byId(part), { height: 170, label: `${part}, MPa`, curves: CURVES, band: [3, 4] }),
  );
  private readonly camera = new Plot(byId("camera"), {
    height: 120,
    label: "grey level",
    curves: [{ label: "with noise", ink: "noise", width: 1 }],
    range: () => [0, this.fullScale],
  });
  private readonly connection = new Connection(
    (message) => this.receive(message),
    (alive) => {
      this.page.linked(alive);
      if (alive) this.wantDesign();
    },
  );

  constructor() {
    byId("fringes").append(this.fringes);
    commands(this.store, () => this.store.hash, () => this.schedule());
    downloadMenu(
      PICTURES,
      (kind) => this.connection.want("download", () => this.question("download", { kind })),
      () => this.fringes.toBlob((blob) => blob && save("fringes.png", blob, "image/png")),
      ["design", "model", "reading"],
    );
    byId("noise").addEventListener("click", () => this.store.change({ seed: this.store.state.seed + 1 }));
    this.schedule();
  }

  private changed(before: State): void {
    const { state } = this.store;
    if (before.start !== state.start || before.changes !== state.changes) this.wantDesign();
    this.store.selected = Math.min(this.store.selected, Math.max(0, state.fingers.length - 1));
    this.wantReading();
    this.schedule();
  }

  private wantDesign(): void {
    byId("solving").textContent = "Solving this design takes some seconds …";
    this.connection.want("design", () => {
      const { start, changes } = this.store.state;
      return { type: "design", slot: "main", start, changes };
    });
  }

  private wantReading(): void {
    this.connection.want("read", () => this.question("read", {}));
    this.strain.want();
  }

  /** A question about the fingers on the current design. */
  private question(type: string, more: object): Record<string, unknown> | null {
    if (!this.model) return null;
    const { fingers, seed } = this.store.state;
    return { type, design: this.model.id, contacts: fingers.map(sent), seed, ...more };
  }

  private receive(message: Message): void {
    const { header, blocks } = message;
    if (message.type === "hello") this.page.offer(header.designs as string[], this.store.state.start);
    else if (message.type === "model") this.modelled(new SkinModel(message));
    else if (message.type === "strain") this.strain.take(message);
    else if (message.type === "file") saveFile(header.name as string, blocks.content as Uint8Array);
    else if (message.type === "refused") this.refused(header);
    else if (message.type === "reading" && header.design === this.model?.id) {
      this.reading = answer<SkinReading>(message);
      this.page.notice("");
      this.schedule();
    }
  }

  private modelled(model: SkinModel): void {
    this.page.notice("");
    byId("solving").textContent = "";
    this.store.half = model.extent * 500;
    if (model.finite) this.store.ease();
    this.store.amend({ fingers: this.store.state.fingers.map((one) => held(one, this.store.half)) });
    this.fullScale = model.facts.camera.full_scale;
    this.camera.forget();
    this.model = model;
    this.reading = null;
    this.form.show(model.facts.values);
    this.page.choose(this.store.state.start);
    this.wantReading();
    this.schedule();
  }

  private refused(header: Record<string, unknown>): void {
    if (header.stale) return;
    if (header.of === "strain") {
      this.strain.refuse(header.text as string);
      return;
    }
    const aboutDesign = header.of === "design";
    if (aboutDesign) byId("solving").textContent = "";
    this.page.notice(aboutDesign ? this.form.refuse(header.text as string) : (header.text as string));
  }

  private schedule(): void {
    if (!this.frame) this.frame = requestAnimationFrame(() => this.paint());
  }

  private paint(): void {
    this.frame = 0;
    const { model, reading } = this;
    showCommands(this.store);
    this.editor.show();
    this.page.keep();
    showContacts(reading);
    if (!model) return;
    const width = byId("strip").clientWidth;
    this.strip.draw(model, width);
    this.strain.draw(model, width);
    if (!reading) return;
    drawFringes(this.fringes, model, reading.phase, layout(width, model.facts.strip.length));
    this.camera.draw(width, [model.millimetres, Float32Array.from(reading.frame)]);
    const x = reading.places.map((place) => place * 1e3);
    this.plots.forEach((plot, part) => {
      const at = (values: Float32Array) => x.map((_, i) => values[2 * i + part] * MEGA);
      const [truth, read, std] = [at(reading.truth), at(reading.traction), at(reading.std)];
      const beside = (side: number) => read.map((value, i) => value + 2 * side * std[i]);
      plot.draw(width, [x, truth, read, beside(1), beside(-1)]);
    });
  }
}
