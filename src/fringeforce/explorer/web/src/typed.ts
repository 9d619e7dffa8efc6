/** Forces as a table of numbers to type. */

import { MOST } from "./arrows";
import { byId, element } from "./dom";
import type { Store } from "./store";

const ROWS = ["normal", "tangential"] as const;

export class TypedForces {
  private fields: Record<(typeof ROWS)[number], HTMLInputElement[]> = { normal: [], tangential: [] };

  constructor(private readonly store: Store) {}

  draw(): void {
    const { state } = this.store;
    if (this.fields.normal.length !== state.normal.length) this.build(state.normal.length);
    for (const row of ROWS) {
      this.fields[row].forEach((field, i) => {
        const text = `${Number(state[row][i].toFixed(4))}`;
        if (document.activeElement !== field && field.value !== text) field.value = text;
      });
    }
  }

  private build(n: number): void {
    const head = element("tr", {}, element("th", { scope: "row" }, "Tactel"));
    for (let i = 1; i <= n; i++) head.append(element("th", { scope: "col" }, `${i}`));
    const body = ROWS.map((row) => {
      this.fields[row] = Array.from({ length: n }, (_, i) => this.field(row, i));
      const cells = this.fields[row].map((field) => element("td", {}, field));
      return element("tr", {}, element("th", { scope: "row" }, `${row} [N]`), ...cells);
    });
    byId("typed").replaceChildren(element("table", {}, head, ...body));
  }

  private field(row: (typeof ROWS)[number], i: number): HTMLInputElement {
    const field = element("input", {
      type: "number",
      step: "any",
      min: -MOST,
      max: MOST,
      required: "",
      "aria-label": `Tactel ${i + 1}, ${row} force in newtons`,
    });
    field.addEventListener("change", () => {
      field.setAttribute("aria-invalid", `${!field.validity.valid}`);
      if (!field.reportValidity()) return;
      const values = this.store.state[row].slice();
      values[i] = field.valueAsNumber;
      this.store.change({ preset: "", [row]: values });
    });
    return field;
  }
}
