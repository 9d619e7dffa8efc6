/** The form of design values: typed as in a design file, or slid; refusals stand beside them. */

import {
  atNotch, type Changes, type Control, type Group, inUnit, NOTCHES, notch, readable, spelled, typed, type Value,
} from "./controls";
import { byId, element, set } from "./dom";

/** Who keeps the changes. */
interface Keeper {
  readonly state: { changes: Changes };
  change(part: { changes: Changes }, commit?: boolean): void;
  commit(): void;
}

interface Row {
  control: Control;
  row: HTMLElement;
  field: HTMLInputElement | HTMLSelectElement;
  slider: HTMLInputElement | null;
  problem: HTMLElement;
}

export class DesignForm {
  private readonly rows = new Map<string, Row>();
  private last = "";

  /** Unless eager, a design that is slid is asked for only when the slider is let go. */
  constructor(
    private readonly store: Keeper,
    groups: Group[],
    private readonly eager = true,
  ) {
    const form = byId<HTMLFormElement>("design");
    form.addEventListener("submit", (event) => event.preventDefault());
    for (const [i, group] of groups.entries()) {
      const rows = group.controls.map((control) => this.made(control));
      const fold = element("details", i < 3 || innerWidth > 900 ? { open: "" } : {});
      fold.append(element("summary", {}, group.name), ...rows);
      form.append(fold);
    }
  }

  /** Show the values of a design that the server accepted. */
  show(values: Record<string, Value>): void {
    this.clear();
    for (const { control, row, field, slider } of this.rows.values()) {
      const value = this.store.state.changes[control.path] ?? readable(values[control.path]) ?? (control.example && []);
      if (document.activeElement !== field || control.choices) field.value = spelled(value);
      if (slider && document.activeElement !== slider) this.place(control, slider, value);
      // such as tactels of a skin
      row.hidden = value === undefined;
    }
    for (const fold of byId("design").querySelectorAll("details")) {
      fold.hidden = !fold.querySelector(":scope > div:not([hidden])");
    }
  }

  /** Put each line of a refusal beside the control that it names, and return what names none. */
  refuse(text: string): string {
    this.clear();
    const lines = text.split("\n").map((line) => line.trim());
    const rest: string[] = [];
    for (const line of lines.length > 1 ? lines.slice(1) : lines) {
      const row = this.named(/^(?:the design: )?([\w.]+)/.exec(line)?.[1] ?? "");
      if (!row) {
        rest.push(line);
        continue;
      }
      row.problem.textContent = line;
      row.problem.hidden = false;
      row.field.setAttribute("aria-invalid", "true");
      row.row.closest("details")?.setAttribute("open", "");
    }
    return rest.join(" ");
  }

  private named(path: string): Row | undefined {
    const exact = this.rows.get(path);
    if (exact || !path) return exact;
    // a rule that binds several values names the part that they share: the one changed last broke it
    if (this.last.startsWith(`${path}.`)) return this.rows.get(this.last);
    const rows = [...this.rows.values()];
    // of a list, one of its values
    const whole = rows.find(({ control }) => path.startsWith(`${control.path}.`));
    return whole ?? rows.find(({ control }) => control.path.startsWith(`${path}.`));
  }

  private clear(): void {
    for (const { field, problem } of this.rows.values()) {
      problem.hidden = true;
      problem.textContent = "";
      field.removeAttribute("aria-invalid");
    }
  }

  private change(path: string, value: Value, commit: boolean): void {
    this.last = path;
    this.store.change({ changes: { ...this.store.state.changes, [path]: value } }, commit);
  }

  private made(control: Control): HTMLElement {
    const id = control.path.replaceAll(".", "-");
    const problem = element("p", { class: "problem", id: `${id}-problem`, role: "alert" });
    problem.hidden = true;
    const about = { id, "aria-describedby": problem.id, "data-path": control.path };
    const field = control.choices ? chooser(control.choices, about) : element("input", { ...about, type: "text", spellcheck: "false", inputmode: "text" });
    field.addEventListener("change", () => this.change(control.path, typed(control.path, field.value), true));
    const slider = control.range ? this.slid(control, field as HTMLInputElement) : null;
    if (control.example) set(field, { placeholder: spelled(control.example) });
    const name = element("label", { for: id }, control.name);
    if (control.title) name.append(element("small", {}, ` ${control.title}`));
    const row = element("div", { class: control.example ? "control long" : "control" }, name, field, ...(slider ? [slider] : []), problem);
    this.rows.set(control.path, { control, row, field, slider, problem });
    return row;
  }

  private slid(control: Control, field: HTMLInputElement): HTMLInputElement {
    const slider = element("input", {
      type: "range",
      min: 0,
      max: NOTCHES,
      "aria-label": `${control.name}, slider`,
      "data-slider": control.path,
    });
    const value = () => {
      const number = atNotch(control, Number(slider.value));
      return control.unit ? `${number} ${control.unit}` : number;
    };
    slider.addEventListener("input", () => {
      field.value = `${value()}`;
      slider.setAttribute("aria-valuetext", field.value);
      if (this.eager) this.change(control.path, value(), false);
    });
    slider.addEventListener("change", () => {
      if (this.eager) this.store.commit();
      else this.change(control.path, value(), true);
    });
    return slider;
  }

  private place(control: Control, slider: HTMLInputElement, value: Value): void {
    const number = inUnit(value, control.unit);
    if (Number.isFinite(number)) slider.value = `${notch(control, number)}`;
    slider.setAttribute("aria-valuetext", spelled(value));
  }
}

function chooser(
  choices: [string, string][],
  about: Record<string, string>,
): HTMLSelectElement {
  const options = choices.map(([value, name]) => element("option", { value }, name));
  return element("select", about, ...options);
}
