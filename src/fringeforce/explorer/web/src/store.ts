/** What the person decided, with its history, and the link that restores it. */

import { typed } from "./controls";

export type Component = "sigma_x" | "sigma_z" | "tau_xz" | "principal";

export interface State {
  start: string;
  changes: Record<string, string | number>;
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

const HISTORY = 200;
const COMPONENTS: Component[] = ["sigma_x", "sigma_z", "tau_xz", "principal"];

export class Store {
  state: State;
  view: View;
  private committed: State;
  private past: State[] = [];
  private future: State[] = [];

  constructor(
    hash: string,
    private readonly onChange: (before: State) => void,
  ) {
    const values = new URLSearchParams(hash.replace(/^#/, ""));
    this.state = stateOf(values);
    this.view = viewOf(values);
    this.committed = this.state;
  }

  get canUndo(): boolean {
    return this.past.length > 0;
  }

  get canRedo(): boolean {
    return this.future.length > 0;
  }

  get loads(): number[] {
    return [...this.state.normal, ...this.state.tangential];
  }

  /** Change something; a gesture commits only when it ends, so that undo takes it back whole. */
  change(part: Partial<State>, commit = true): void {
    const before = this.state;
    this.state = { ...before, ...part };
    if (commit) this.commit();
    this.onChange(before);
  }

  commit(): void {
    if (JSON.stringify(this.committed) === JSON.stringify(this.state)) return;
    this.past = [...this.past.slice(1 - HISTORY), this.committed];
    this.future = [];
    this.committed = this.state;
  }

  /** Follow from the server, such as another number of tactels: no step of its own in history. */
  amend(part: Partial<State>): void {
    this.state = { ...this.state, ...part };
    this.committed = this.state;
  }

  undo(): void {
    this.travel(this.past, this.future);
  }

  redo(): void {
    this.travel(this.future, this.past);
  }

  get hash(): string {
    const { state, view } = this;
    const values = new URLSearchParams();
    if (state.start) values.set("start", state.start);
    for (const [path, value] of Object.entries(state.changes)) values.set(`.${path}`, `${value}`);
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

  private travel(from: State[], to: State[]): void {
    const target = from.pop();
    if (!target) return;
    const before = this.state;
    to.push(this.committed);
    this.state = this.committed = target;
    this.onChange(before);
  }
}

function stateOf(values: URLSearchParams): State {
  const changes: State["changes"] = {};
  for (const [key, value] of values) if (key.startsWith(".")) changes[key.slice(1)] = typed(key.slice(1), value);
  const [normal, tangential] = [numbers(values.get("n")), numbers(values.get("t"))];
  const given = normal.length > 0 && normal.length === tangential.length;
  return {
    start: values.get("start") ?? "",
    changes,
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
