/** What the person decided about a skin, and the link that restores it. */

import { type Designed, designedOf, linked, linkOf } from "../link";
import { Timeline } from "../timeline";
import { FINGER, type Finger, held, MOST, parsed, written } from "./fingers";

export interface State extends Designed {
  fingers: Finger[];
}

const FIRST: Finger[] = [
  { x: -2.1, radius: 6, normal: 2.5, tangential: 0.9 },
  { x: 2.4, radius: 2, normal: 0.8, tangential: -0.2 },
];

/** Share of these forces on a skin of finite strain, which they would fold. */
const GENTLY = 0.2;

export class SkinStore extends Timeline<State> {
  selected = 0;
  /** Half of the skin's extent [mm]. */
  half = 1000;
  /** Whether finite strain is shown beside the linear one. */
  finite: boolean;

  constructor(hash: string, onChange: (before: State) => void) {
    super(stateOf(linked(hash)), onChange);
    this.finite = linked(hash).has("finite");
  }

  /** Press a soft skin gently, unless the person has pressed already. */
  ease(): void {
    if (this.state.fingers !== FIRST) return;
    const gentle = ({ normal, tangential, ...place }: Finger) => ({
      ...place,
      normal: normal * GENTLY,
      tangential: tangential * GENTLY,
    });
    this.amend({ fingers: FIRST.map(gentle) });
  }

  get finger(): Finger | undefined {
    return this.state.fingers[this.selected];
  }

  /** Change one finger, within what friction and the skin allow. */
  touch(number: number, part: Partial<Finger>, commit = true): void {
    const fingers = this.state.fingers.map((old, i) =>
      i === number ? held({ ...old, ...part }, this.half) : old,
    );
    this.change({ fingers }, commit);
  }

  /** One more finger, which becomes the selected one; nothing if there are too many. */
  add(part: Partial<Finger>, commit = true): boolean {
    const { fingers } = this.state;
    if (fingers.length >= MOST) return false;
    this.selected = fingers.length;
    this.change({ fingers: [...fingers, held({ ...FINGER, ...part }, this.half)] }, commit);
    return true;
  }

  remove(number: number): void {
    this.selected = Math.max(0, number - 1);
    this.change({ fingers: this.state.fingers.filter((_, i) => i !== number) });
  }

  get hash(): string {
    const values = linkOf(this.state);
    values.set("f", this.state.fingers.map(written).join(";"));
    if (this.finite) values.set("finite", "1");
    return `#${values}`;
  }
}

function stateOf(values: URLSearchParams): State {
  const given = values.get("f");
  const fingers = (given ?? "").split(";").map(parsed).filter((one) => one !== null);
  return { ...designedOf(values), fingers: given === null ? FIRST : fingers.slice(0, MOST) };
}
