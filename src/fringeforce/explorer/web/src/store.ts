/** What the person decided, with its history, and the link that restores it. */

import { type Designed, designedOf, linked, linkOf } from "./link";
import { clamped } from "./numbers";
import { Timeline } from "./timeline";

export type Component = "sigma_x" | "sigma_z" | "tau_xz" | "principal";

export interface State extends Designed {
  normal: number[];
  tangential: number[];
  preset: string;
}

export interface View {
  component: Component;
  mesh: boolean;
  compare: boolean;
}

export const COMPONENTS: Component[] = ["sigma_x", "sigma_z", "tau_xz", "principal"];

export class Store extends Timeline<State> {
  view: View;
  /** Whether finite strain is shown beside the linear one. */
  finite: boolean;
  /** For how long a load is held that is shown over time [s], 0 as the design asks for; else null. */
  creep: number | null;

  constructor(hash: string, onChange: (before: State) => void) {
    const values = linked(hash);
    super(stateOf(values), onChange);
    this.view = viewOf(values);
    this.finite = values.has("finite");
    this.creep = values.has("creep") ? clamped(Number(values.get("creep")) || 0, 0, 1e9) : null;
  }

  /** Forces in the order of all arrays: the normal and the tangential one of tactel after tactel. */
  get loads(): number[] {
    const { normal, tangential } = this.state;
    return normal.flatMap((force, i) => [force, tangential[i]]);
  }

  get hash(): string {
    const { state, view } = this;
    const values = linkOf(state);
    if (state.preset) values.set("load", state.preset);
    else {
      values.set("n", state.normal.map(short).join(" "));
      values.set("t", state.tangential.map(short).join(" "));
    }
    if (view.component !== "sigma_x") values.set("stress", view.component);
    if (view.mesh) values.set("mesh", "1");
    if (view.compare) values.set("edges", "1");
    if (this.finite) values.set("finite", "1");
    if (this.creep !== null) values.set("creep", short(this.creep));
    return `#${values}`;
  }
}

function stateOf(values: URLSearchParams): State {
  const [normal, tangential] = [numbers(values.get("n")), numbers(values.get("t"))];
  const given = normal.length > 0 && normal.length === tangential.length;
  return {
    ...designedOf(values),
    normal: given ? normal : [],
    tangential: given ? tangential : [],
    preset: given ? "" : (values.get("load") ?? "paper"),
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
  return values.every(Number.isFinite) ? values.map((value) => clamped(value, -1000, 1000)) : [];
}

function short(value: number): string {
  return `${Number(value.toPrecision(6))}`;
}
