/** What the person decided, with its history, and the link that restores it. */

import { type Changes, changesOf, spelled } from "./controls";
import { Timeline } from "./timeline";

export type Component = "sigma_x" | "sigma_z" | "tau_xz" | "principal";

export interface State {
  start: string;
  changes: Changes;
  normal: number[];
  tangential: number[];
  preset: string;
  seed: number;
}

export interface View {
  component: Component;
  mesh: boolean;
  compare: boolean;
}

const COMPONENTS: Component[] = ["sigma_x", "sigma_z", "tau_xz", "principal"];

export class Store extends Timeline<State> {
  view: View;

  constructor(hash: string, onChange: (before: State) => void) {
    const values = new URLSearchParams(hash.replace(/^#/, ""));
    super(stateOf(values), onChange);
    this.view = viewOf(values);
  }

  get loads(): number[] {
    return [...this.state.normal, ...this.state.tangential];
  }

  get hash(): string {
    const { state, view } = this;
    const values = new URLSearchParams();
    if (state.start) values.set("start", state.start);
    for (const [path, value] of Object.entries(state.changes)) values.set(`.${path}`, spelled(value));
    if (state.preset) values.set("load", state.preset);
    else {
      values.set("n", state.normal.map(short).join(" "));
      values.set("t", state.tangential.map(short).join(" "));
    }
    if (state.seed) values.set("seed", `${state.seed}`);
    if (view.component !== "sigma_x") values.set("stress", view.component);
    if (view.mesh) values.set("mesh", "1");
    if (view.compare) values.set("edges", "1");
    return `#${values}`;
  }
}

function stateOf(values: URLSearchParams): State {
  const [normal, tangential] = [numbers(values.get("n")), numbers(values.get("t"))];
  const given = normal.length > 0 && normal.length === tangential.length;
  return {
    start: values.get("start") ?? "",
    changes: changesOf(values),
    normal: given ? normal : [],
    tangential: given ? tangential : [],
    preset: given ? "" : (values.get("load") ?? "paper"),
    seed: Math.abs(Math.trunc(Number(values.get("seed")))) % 2 ** 32 || 0,
  };
}

function viewOf(values: URLSearchParams): View {
  const component = COMPONENTS.find((name) => name === values.get("stress"));
  return {
    component: component ?? "sigma_x",
    mesh: values.has("mesh"),
    compare: values.has("edges"),
  };
}

function numbers(text: string | null): number[] {
  const values = (text ?? "").split(" ").filter(Boolean).map(Number);
  return values.every(Number.isFinite) ? values.map((v) => Math.min(Math.max(v, -1000), 1000)) : [];
}

function short(value: number): string {
  return `${Number(value.toPrecision(6))}`;
}
