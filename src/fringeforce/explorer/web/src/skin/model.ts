/** What the server tells of a skin. */

import { type Facts, Model, type Verdict } from "../model";
import type { Block, Message } from "../protocol";

export class SkinModel extends Model {
  /** Length of the skin [m]. */
  readonly extent: number;
  /** Whether it strains so much that small strain does not hold. */
  readonly finite: boolean;

  constructor(message: Message) {
    super(message);
    const { extent, finite } = this.facts as Facts & { extent: number; finite: boolean };
    this.extent = extent;
    this.finite = finite;
  }
}

/** Place and width [mm], normal and tangential force [N], and their deviations. */
export type Felt = (number | null)[];

export interface SkinReading extends Verdict {
  frame: Block;
  phase: Float32Array;
  /** Along the strip [m]. */
  places: Float32Array;
  /** Pressure and shear at place after place [Pa]. */
  truth: Float32Array;
  traction: Float32Array;
  std: Float32Array;
  /** All together, then each contact, the strongest first. */
  contacts: Felt[];
  /** Centre of pressure [mm], normal and tangential force [N] of each finger. */
  true: [number, number, number][];
}
