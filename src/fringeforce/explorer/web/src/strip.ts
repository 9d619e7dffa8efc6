/** The strip to scale: its layers and supports, and the forces on its skin as arrows. */

import { Arrows } from "./arrows";
import { shape, sized } from "./dom";
import { LEFT, type Layout } from "./layout";
import type { Model } from "./model";
import type { Store } from "./store";

const SKY = 128;
const BASE = 12;

export class Strip {
  private readonly svg = shape("svg", { class: "strip" });
  private readonly ground = shape("g");
  private readonly arrows: Arrows;
  private drawn = "";

  constructor(container: HTMLElement, store: Store, onGesture: () => void) {
    this.arrows = new Arrows(store, SKY, onGesture);
    this.svg.append(this.ground, this.arrows.group);
    container.append(this.svg);
  }

  draw(model: Model, place: Layout): void {
    const { layers, strip } = model.facts;
    const signature = `${model.id} ${place.width}`;
    if (signature !== this.drawn) {
      const height = SKY + (layers[0] + layers[1]) * place.scale + BASE + 2;
      sized(this.svg, place.width, height);
      this.ground.replaceChildren(...this.layers(model, place), ...supports(strip.edges, model, place));
      this.drawn = signature;
    }
    this.arrows.draw(model, place);
  }

  private layers(model: Model, place: Layout): SVGElement[] {
    const { layers, strip } = model.facts;
    const width = strip.length * place.scale;
    const [cover, clear] = layers.map((thickness) => thickness * place.scale);
    const rect = (name: string, y: number, height: number) =>
      shape("rect", { class: name, x: LEFT, y, width, height });
    const label = (text: string, y: number) =>
      shape("text", { class: "label", x: LEFT - (strip.edges === "roller" ? 16 : 8), y: y + 4, "text-anchor": "end" }, text);
    return [
      rect("cover", SKY, cover),
      rect("clear", SKY + cover, clear),
      rect("base", SKY + cover + clear, BASE - 4),
      shape("line", {
        class: "mirror",
        x1: LEFT,
        x2: LEFT + width,
        y1: SKY + cover,
        y2: SKY + cover,
      }),
      label("cover", SKY + Math.min(cover / 2, 10)),
      label("clear", SKY + cover + Math.max(clear / 2, 8)),
    ];
  }
}

/** Rollers beside edges that may only slide; free edges have nothing. */
function supports(edges: string, model: Model, place: Layout): SVGElement[] {
  if (edges !== "roller") return [];
  const { layers, strip } = model.facts;
  const depth = (layers[0] + layers[1]) * place.scale;
  const radius = Math.min(4.5, depth / 8);
  const found: SVGElement[] = [];
  for (const side of [-1, 1]) {
    const edge = place.across((side * strip.length) / 2);
    for (const share of [0.2, 0.5, 0.8]) {
      found.push(
        shape("circle", {
          class: "roller",
          cx: edge + side * (radius + 1),
          cy: SKY + share * depth,
          r: radius,
        }),
      );
    }
    const wall = edge + side * (2 * radius + 2);
    found.push(shape("line", { class: "wall", x1: wall, x2: wall, y1: SKY, y2: SKY + depth }));
  }
  return found;
}
