/** The same design with free and with roller edges, side by side under the same load. */

import { blankCanvas, byId, element } from "./dom";
import { drawFringes } from "./fringes";
import { layout } from "./layout";
import type { Model } from "./model";
import { largest, niceAbove } from "./numbers";
import { Plot } from "./plots";
import { drawStress, megapascals, NAMES, picked } from "./stress";
import type { Component } from "./store";

export const EDGES = ["free", "roller"] as const;
export type Edges = (typeof EDGES)[number];
const TITLES = { free: "Free edges", roller: "Edges on rollers" };
const GAP = 24;

export class Compare {
  private readonly models: Partial<Record<Edges, Model>> = {};
  private readonly canvases = EDGES.map(() => [blankCanvas(), blankCanvas()]);
  private readonly note = element("p", { class: "aside" });
  private readonly plot: Plot;

  constructor() {
    const cards = EDGES.map((edges, i) =>
      element("figure", {}, element("figcaption", {}, TITLES[edges]), ...this.canvases[i]),
    );
    const curves = element("div");
    byId("compare").append(element("div", { class: "pair" }, ...cards), this.note, curves);
    this.plot = new Plot(curves, {
      height: 150,
      label: "phase [rad]",
      curves: [
        { label: "free", ink: "normal" },
        { label: "roller", ink: "tangential", dash: [6, 3] },
      ],
    });
  }

  take(edges: Edges, model: Model): void {
    this.models[edges] = model;
  }

  /** The one of both models that has a number. */
  find(id: unknown): Model | undefined {
    return Object.values(this.models).find((model) => model.id === id);
  }

  draw(loads: number[], component: Component, mesh: boolean, width: number): void {
    const [free, roller] = EDGES.map((edges) => this.models[edges]);
    if (!free?.whole || !roller?.whole) return;
    if (free.tactels.length * 2 !== loads.length || roller.tactels.length * 2 !== loads.length) return;
    const half = width > 720 ? (width - GAP) / 2 : width;
    const limit = niceAbove(
      Math.max(...[free, roller].map((m) => largest(picked(m.stress("clear", loads), component)))),
    );
    const phases = [free, roller].map((model, i) => {
      const place = layout(half, model.facts.strip.length);
      const [field, fringes] = this.canvases[i];
      const phase = model.phase(loads);
      drawStress(field, model, loads, component, place, mesh ? model.mesh(loads) : null, limit);
      drawFringes(fringes, model, phase, place);
      return phase;
    });
    this.note.textContent = `${NAMES[component]} to ±${megapascals(limit)} in both. Phase: solid, free edges; dashed, rollers. Free edges let the phase go to zero at the ends; rollers hold it.`;
    if (roller.x.length === free.x.length) this.plot.draw(width, [free.millimetres, ...phases]);
  }
}
