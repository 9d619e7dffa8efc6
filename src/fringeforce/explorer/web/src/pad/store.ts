/** What the person decided about a pad, and the link that restores it. */

import { counted, type Designed, designedOf, linked, linkOf } from "../link";
import { clamped } from "../numbers";
import { Timeline } from "../timeline";
import { type Contact, held, LIMITS, MOST, parsed, written } from "./contacts";

export interface State extends Designed {
  contacts: Contact[];
  /** Name of a preset whose contacts are not placed yet, for a pad that is not known yet. */
  preset: string;
  friction: number;
}

export type Part = "difference" | "shear" | "size";

export interface View {
  seen: string;
  part: Part;
  depth: number;
  selected: number;
}

export const PARTS: Part[] = ["difference", "shear", "size"];

export class PadStore extends Timeline<State> {
  view: View;
  /** Half of the pad's sides [mm]. */
  half: [number, number] = [1, 1];
  /** Half of the sides of what can be pressed [mm]. */
  reach: [number, number] = [1, 1];
  /** Whether presets are to press gently. */
  soft = false;

  constructor(hash: string, onChange: (before: State) => void) {
    const values = linked(hash);
    super(stateOf(values), onChange);
    this.view = {
      seen: values.get("view") ?? "white",
      part: PARTS.find((part) => part === values.get("stress")) ?? "difference",
      depth: counted(values.get("depth")),
      selected: 0,
    };
  }

  get selected(): Contact | undefined {
    return this.state.contacts[this.view.selected];
  }

  /** Change one contact, within what friction and the pad allow. */
  touch(number: number, part: Partial<Contact>, commit = true): void {
    const { contacts, friction } = this.state;
    const changed = contacts.map((old, i) =>
      i === number ? held({ ...old, ...part }, friction, this.reach) : old,
    );
    this.change({ contacts: changed, preset: "" }, commit);
  }

  /** One more contact, which becomes the selected one; nothing if there are too many. */
  add(contact: Contact, commit = true): boolean {
    const { contacts, friction } = this.state;
    if (contacts.length >= MOST) return false;
    this.view.selected = contacts.length;
    this.change({ contacts: [...contacts, held(contact, friction, this.reach)], preset: "" }, commit);
    return true;
  }

  remove(number: number): void {
    this.view.selected = Math.max(0, number - 1);
    this.change({ contacts: this.state.contacts.filter((_, i) => i !== number), preset: "" });
  }

  rub(friction: number): void {
    const limit = clamped(friction, ...LIMITS.friction);
    const contacts = this.state.contacts.map((contact) => held(contact, limit, this.reach));
    this.change({ friction: limit, contacts });
  }

  get hash(): string {
    const { state, view } = this;
    const values = linkOf(state);
    if (state.preset) values.set("touch", state.preset);
    else values.set("c", state.contacts.map(written).join(";"));
    if (state.friction !== 0.6) values.set("friction", `${state.friction}`);
    if (view.seen !== "white") values.set("view", view.seen);
    if (view.part !== "difference") values.set("stress", view.part);
    if (view.depth) values.set("depth", `${view.depth}`);
    return `#${values}`;
  }
}

function stateOf(values: URLSearchParams): State {
  const given = values.get("c");
  const contacts = (given ?? "").split(";").map(parsed).filter((one) => one !== null);
  return {
    ...designedOf(values),
    contacts: contacts.slice(0, MOST),
    preset: given === null ? (values.get("touch") ?? "finger") : "",
    friction: clamped(Number(values.get("friction")) || 0.6, ...LIMITS.friction),
  };
}
