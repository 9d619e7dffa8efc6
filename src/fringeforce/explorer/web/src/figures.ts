/** The strip of design figures, with what changed since the design before. */

import { byId, element } from "./dom";
import type { Figure } from "./model";

export function showFigures(figures: Figure[], before: Figure[]): void {
  byId("figures").replaceChildren(...figures.map((figure) => tile(figure, before)));
}

function tile(figure: Figure, before: Figure[]): HTMLElement {
  const old = before.find(({ key }) => key === figure.key)?.value;
  const name = element("dt", {}, figure.name);
  const value = element("dd", { class: "value", "data-key": figure.key }, spelled(figure.value));
  if (figure.unit) value.append(element("span", { class: "unit" }, ` ${figure.unit}`));
  const note = element("dd", { class: "note" }, change(figure.value, old));
  const meaning = element("dd", { class: "meaning" }, figure.meaning);
  return element("div", { class: "figure", tabindex: 0 }, name, value, note, meaning);
}

function spelled(value: number): string {
  return Math.abs(value) >= 1e5 ? value.toExponential(2) : `${Number(value.toPrecision(4))}`;
}

function change(value: number, old: number | undefined): string {
  if (old === undefined || !old) return "";
  const percent = 100 * (value / old - 1);
  if (Math.abs(percent) < 0.05) return "";
  return `${percent > 0 ? "▲" : "▼"} ${Math.abs(percent).toFixed(Math.abs(percent) < 10 ? 1 : 0)} %`;
}
