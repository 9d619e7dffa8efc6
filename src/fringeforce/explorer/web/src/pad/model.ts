/** What the server tells of a pad. */

import type { Value } from "../controls";
import type { Estimate, Figure, Verdict } from "../model";
import type { Message } from "../protocol";
import type { Moment } from "../ring";

interface Facts {
  name: string;
  values: Record<string, Value>;
  figures: Figure[];
  pad: { length: number; width: number; layers: [cover: number, clear: number] };
  tactels: { count: [number, number]; pitch: number };
  views: [key: string, name: string][];
  slices: number;
  /** Extent of a skin [m]; null of a pad with tactels. */
  skin: [number, number] | null;
}

export class PadModel {
  readonly id: number;
  readonly facts: Facts;

  constructor(message: Message) {
    this.id = message.header.id as number;
    this.facts = message.header as unknown as Facts;
  }

  /** Half of the sides [mm]. */
  get half(): [number, number] {
    return [this.facts.pad.length * 500, this.facts.pad.width * 500];
  }

  /** Half of the sides of what can be pressed [mm]. */
  get reach(): [number, number] {
    const { skin } = this.facts;
    return skin ? [skin[0] * 500, skin[1] * 500] : this.half;
  }

  /** Whether a fingertip shows more than one fringe: presets for stiff pads would show too many to be read. */
  get soft(): boolean {
    return (this.facts.figures.find(({ key }) => key === "order")?.value ?? 0) > 1;
  }

  get tactels(): number {
    return this.facts.tactels.count[0] * this.facts.tactels.count[1];
  }

  /** Centre of a tactel [mm]. */
  place(tactel: number): [number, number] {
    const { count, pitch } = this.facts.tactels;
    const [along, across] = [Math.floor(tactel / count[1]), tactel % count[1]];
    return [(along - (count[0] - 1) / 2) * pitch * 1e3, (across - (count[1] - 1) / 2) * pitch * 1e3];
  }
}

export interface Raster {
  shape: [rows: number, columns: number, colours: number];
  image: Uint8Array;
}

export interface Picture extends Raster {
  id: number;
  /** N, T_x, T_y of tactel after tactel [N]. */
  forces: Float32Array;
}

export interface Reading extends Estimate, Verdict {
  /** Of the pad and of each contact: six numbers that are true, six read, six deviations. */
  sums: Float32Array;
}

/** What is seen of a running pad at a time. */
export interface PadMoment extends Moment, Raster {
  /** Of all tactels: force [N], moment about the normal [N m], centre of pressure [m]. */
  sums: Float32Array;
}

export interface Slices {
  shape: [slices: number, parts: number, rows: number, columns: number];
  /** Where they lie [m]; 0 is the loaded surface. */
  heights: number[];
  slices: Float32Array;
}
