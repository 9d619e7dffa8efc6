/** The page of a pad: what happens, who is asked, and one painting per animation frame. */

import { Choice, commands, showCommands } from "../commands";
import { Connection } from "../connection";
import { DesignForm } from "../design";
import { byId, element, save } from "../dom";
import { downloadMenu, saveFile } from "../download";
import { showFigures } from "../figures";
import { Live } from "../live";
import { Page } from "../page";
import { answer, type Message } from "../protocol";
import { held, sent } from "./contacts";
import { PAD_GROUPS } from "./controls";
import { Editor } from "./editor";
import { PadLivePictures } from "./live";
import { ForceMap } from "./map";
import { PadModel, type Picture, type Reading, type Slices } from "./model";
import { presetContacts, PRESETS } from "./presets";
import { SlicePictures } from "./slices";
import { PadStore, type State } from "./store";
import { showSums, showUnread } from "./sums";
import { Surface } from "./surface";

/** After which something that moved is at rest, and worth a fine picture [ms]. */
const REST = 120;
/** The same while a finger holds it: who only hesitates should not wait for a fine picture [ms]. */
const HOLD = 400;
/** Least time between two readings [ms]: a reading costs a core that pictures need. */
const READ_PAUSE = 150;
/** Pictures asked for before the first is there: the server draws the latest when it is free. */
const AHEAD = 4;
/** Least time between two changes of the contact's numbers while it is dragged [ms]. */
const EDIT_PAUSE = 200;
const PICTURES = { png: "Image (.png)" } as const;

export class PadExplorer {
  private model: PadModel | null = null;
  private picture: Picture | null = null;
  private reading: Reading | null = null;
  private slices: Slices | null = null;
  /** What the last reading was asked of, and what the reading that is shown was. */
  private asked: State | null = null;
  private told: State | null = null;
  private fine = true;
  private frame = 0;
  private live: Live<PadModel> | null = null;
  private editedAt = 0;
  private stale = new Set(["picture", "map", "sums", "slices"]);
  private restTimer = 0;
  private readonly store = new PadStore(location.hash, (before) => this.changed(before));
  private readonly page = new Page(this.store, () => this.all());
  private readonly surface = new Surface(byId("pad"), this.store, () => this.schedule());
  private readonly map = new ForceMap(byId("map"), byId("scale"));
  private readonly stack = new SlicePictures(this.store, () => this.schedule("slices"));
  private readonly editor = new Editor(this.store);
  private readonly presets = new Choice(byId("presets"), "preset", PRESETS, (key) => this.preset(key));
  private readonly form = new DesignForm(this.store, PAD_GROUPS, false);
  private readonly connection = new Connection(
    (message) => this.receive(message),
    (alive) => this.linked(alive),
    { readPause: READ_PAUSE, ahead: { press: AHEAD } },
  );

  constructor() {
    commands(this.store, () => this.store.hash, () => this.all());
    downloadMenu(
      PICTURES,
      (kind) => this.connection.want("download", () => this.question("download", { kind })),
      () => void this.saveImage(),
    );
    byId("noise").addEventListener("click", () => this.store.change({ seed: this.store.state.seed + 1 }));
    byId<HTMLSelectElement>("view").addEventListener("change", ({ target }) => {
      this.store.view.seen = (target as HTMLSelectElement).value;
      this.wantPicture(true);
      this.schedule();
    });
  }

  private changed(before: State): void {
    const { state } = this.store;
    if (before.start !== state.start || before.changes !== state.changes) this.wantDesign();
    if (this.store.view.selected >= state.contacts.length) this.store.view.selected = Math.max(0, state.contacts.length - 1);
    this.wantPressed();
    this.schedule();
  }

  private preset(key: string): void {
    this.store.view.selected = 0;
    this.store.change({ contacts: this.contactsOf(key), preset: key });
  }

  private contactsOf(key: string): State["contacts"] {
    const { reach, state } = this.store;
    return presetContacts(key, reach, this.store.soft).map((one) => held(one, state.friction, reach));
  }

  /** Speak of what the pad has: tactels, or a skin under rigid spheres that do not twist. */
  private suit(model: PadModel): void {
    const skin = model.facts.skin !== null;
    byId("forces-title").textContent = skin ? "Forces on squares of the skin" : "Forces of the tactels";
    this.editor.suit(skin);
    this.presets.offer("twist", !skin);
  }

  private wantDesign(): void {
    byId("solving").textContent = "Solving this design takes some seconds …";
    this.connection.want("design", () => {
      const { start, changes } = this.store.state;
      return { type: "design", slot: "main", start, changes };
    });
  }

  /** A coarse picture at once, and once all is at rest a fine one and the slices. */
  private wantPressed(): void {
    this.wantPicture(false);
    this.connection.want("read", () => {
      this.asked = this.store.state;
      return this.question("read", {});
    });
    clearTimeout(this.restTimer);
    this.restTimer = setTimeout(() => {
      this.wantPicture(true);
      this.connection.want("slices", () => this.question("slices", {}));
    }, this.surface.dragged ? HOLD : REST);
  }

  private wantPicture(fine: boolean): void {
    this.fine = fine;
    this.connection.want("press", () => this.question("press", { view: this.store.view.seen, fine: this.fine }));
  }

  /** A question about the contacts on the current design. */
  private question(type: string, more: object): Record<string, unknown> | null {
    if (!this.model) return null;
    const { contacts, friction, seed } = this.store.state;
    const turned = this.model.facts.skin ? { twist: 0 } : {};
    const fingers = contacts.map((contact) => sent({ ...contact, ...turned }));
    return { type, design: this.model.id, contacts: fingers, friction, seed, ...more };
  }

  private receive(message: Message): void {
    const { header, blocks } = message;
    const own = header.design === this.model?.id;
    if (message.type === "hello") this.greeted(header);
    else if (message.type === "live") this.live?.take(message);
    else if (message.type === "model" && header.slot === "camera") this.live?.modelled(new PadModel(message));
    else if (message.type === "model") this.modelled(new PadModel(message));
    else if (message.type === "file") saveFile(header.name as string, blocks.content as Uint8Array);
    else if (message.type === "refused") this.refused(header);
    else if (message.type === "picture" && own) {
      this.picture = answer<Picture>(message);
      this.schedule("picture", "map");
    } else if (message.type === "reading" && own) {
      this.reading = answer<Reading>(message);
      this.told = this.asked;
      this.schedule("map", "sums");
    } else if (message.type === "slices" && own) {
      this.slices = answer<Slices>(message);
      this.schedule("slices");
    }
  }

  private greeted(header: Record<string, unknown>): void {
    this.page.offer(header.designs as string[], this.store.state.start);
    if (!header.camera) return;
    this.live ??= new Live(
      this.connection,
      () => this.all(),
      () => new PadLivePictures(),
      (model) => model.tactels,
    );
    this.live.greet();
  }

  private modelled(model: PadModel): void {
    const { store } = this;
    this.page.notice("");
    byId("solving").textContent = "";
    store.half = model.half;
    store.reach = model.reach;
    store.soft = model.soft;
    const { contacts, friction, preset } = store.state;
    store.amend({
      contacts: preset ? this.contactsOf(preset) : contacts.map((one) => held(one, friction, model.reach)),
    });
    this.suit(model);
    const view = byId<HTMLSelectElement>("view");
    view.replaceChildren(...model.facts.views.map(([key, name]) => element("option", { value: key }, name)));
    if (!model.facts.views.some(([key]) => key === store.view.seen)) store.view.seen = "white";
    view.value = store.view.seen;
    showFigures(model.facts.figures, this.model?.facts.figures ?? []);
    this.model = model;
    this.form.show(model.facts.values);
    this.page.choose(store.state.start);
    this.wantPressed();
    this.all();
  }

  private refused(header: Record<string, unknown>): void {
    if (header.stale) return;
    if (header.of === "read") {
      this.reading = null;
      showUnread(header.text as string);
      this.schedule("map");
      return;
    }
    const aboutDesign = header.of === "design";
    if (aboutDesign) byId("solving").textContent = "";
    this.page.notice(aboutDesign ? this.form.refuse(header.text as string) : (header.text as string));
  }

  private linked(alive: boolean): void {
    this.page.linked(alive);
    if (alive) this.wantDesign();
  }

  private async saveImage(): Promise<void> {
    if (this.picture) save("pad.png", await this.surface.saved(this.picture), "image/png");
  }

  private all(): void {
    this.schedule("picture", "map", "sums", "slices");
  }

  private schedule(...parts: string[]): void {
    for (const part of parts) this.stale.add(part);
    if (!this.frame) this.frame = requestAnimationFrame(() => this.paint());
  }

  private paint(): void {
    this.frame = 0;
    const { model, store, stale } = this;
    showCommands(store);
    this.presets.show(store.state.preset);
    if (!model) return;
    if (stale.has("picture")) {
      const name = model.facts.views.find(([key]) => key === store.view.seen)?.[1] ?? "";
      this.surface.paint(model, this.picture, name);
      document.body.dataset.painted = `${this.picture?.id ?? ""}`;
    }
    if (stale.has("map")) this.map.draw(model, this.picture?.forces ?? null, this.reading);
    if (stale.has("sums")) showSums(model, this.reading);
    byId("behind").hidden = !this.reading || this.told === store.state;
    if (stale.has("slices")) this.stack.draw(this.slices);
    stale.clear();
    this.surface.place(model);
    // numbers that nobody reads while they run would cost a layout of each frame
    if (!this.surface.dragged || performance.now() > this.editedAt + EDIT_PAUSE) {
      this.editedAt = performance.now();
      this.editor.show();
    }
    this.page.keep();
  }
}
