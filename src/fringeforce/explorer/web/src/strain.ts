/** What the light would be under finite strain, beside that of small strain; asked for while it is shown. */

import { Choice } from "./commands";
import type { Connection } from "./connection";
import { blankCanvas, byId, write } from "./dom";
import { drawFringes } from "./fringes";
import { layout } from "./layout";
import type { Mesh, Model } from "./model";
import { fixed } from "./numbers";
import { Plot } from "./plots";
import { answer, type Message } from "./protocol";

type Strain = "linear" | "finite";
const STRAINS: { key: Strain; name: string; hint: string }[] = [
  { key: "linear", name: "Linear", hint: "Small strain, as all other pictures show" },
  { key: "finite", name: "Finite", hint: "Solve the strip as it deforms, and compare" },
];

interface Compared extends Partial<Mesh> {
  design: number;
  linear: Float32Array;
  finite: Float32Array;
  /** Largest difference [rad], its share of the peak, and that of a grey level in deviations of its noise. */
  largest: number;
  share: number;
  deviations: number;
  /** That contacts without one were given [m]. */
  width: number;
}

interface Keeper {
  finite: boolean;
}

export class StrainPanel {
  private shown: Compared | null = null;
  private refused = "";
  private readonly choice: Choice<Strain>;
  private readonly canvases = [blankCanvas(), blankCanvas()];
  private readonly phases = new Plot(byId("finite-phase"), {
    height: 150,
    label: "phase, rad",
    curves: [
      { label: "linear", ink: "ink" },
      { label: "finite", ink: "read", width: 2, dash: [5, 4] },
    ],
  });
  private readonly less = new Plot(byId("finite-less"), {
    height: 120,
    label: "difference, rad",
    curves: [{ label: "finite less linear", ink: "read" }],
  });

  /** Asks with the question of the page, which has the loads. */
  constructor(
    private readonly store: Keeper,
    private readonly connection: () => Connection,
    private readonly question: () => Record<string, unknown> | null,
    private readonly repaint: () => void,
  ) {
    this.choice = new Choice(byId("strain"), "strain", STRAINS, (strain) => {
      store.finite = strain === "finite";
      this.want();
      repaint();
    });
    byId("finite-fringes").append(...this.canvases);
  }

  /** Ask for what loads of now do, if it is shown. */
  want(): void {
    if (this.store.finite) this.connection().want("strain", this.question);
  }

  take(message: Message): void {
    this.shown = answer<Compared>(message);
    this.refused = "";
    this.repaint();
  }

  refuse(text: string): void {
    this.shown = null;
    this.refused = text;
    this.repaint();
  }

  /** The deformed mesh of a design under finite strain, where that is shown. */
  mesh(model: Model): Mesh | null {
    const { shown } = this;
    if (!this.store.finite || shown?.design !== model.id || !shown.moved) return null;
    return shown as Mesh;
  }

  draw(model: Model, width: number): void {
    const { finite } = this.store;
    this.choice.show(finite ? "finite" : "linear");
    const shown = this.shown?.design === model.id ? this.shown : null;
    const taken = model.facts.values["transducer.strain"] === "finite" ? "finite" : "small";
    byId("finite").hidden = !finite || !shown;
    write(byId("strain-note"), finite ? this.words(shown) : `Finite shows what large strain changes here. Readings take ${taken} strain, as the design says.`);
    if (!finite || !shown) return;
    const place = layout(width, model.facts.strip.length);
    [shown.linear, shown.finite].forEach((phase, i) => drawFringes(this.canvases[i], model, phase, place));
    this.phases.draw(width, [model.millimetres, shown.linear, shown.finite]);
    this.less.draw(width, [model.millimetres, shown.finite.map((value, i) => value - shown.linear[i])]);
  }

  private words(shown: Compared | null): string {
    const busy = this.connection().busy("strain");
    if (!shown) return busy ? "Solving the strip as it deforms …" : this.refused;
    const { largest, share, deviations, width, moved } = shown;
    const parts = [
      `Finite strain moves the phase by ${fixed(largest, 3)} rad at most, ${fixed(100 * share, 2)} % of its peak, and a grey level by ${fixed(deviations, 1)} deviations of its noise.`,
    ];
    if (width) parts.push(`Contacts are taken as ${fixed(width * 1e3, 2)} mm wide here: under a line strain has no bound.`);
    if (moved) parts.push("The mesh, where it is shown, moves by it.");
    if (busy) parts.push("Solving for the loads of now …");
    return parts.join(" ");
  }
}
