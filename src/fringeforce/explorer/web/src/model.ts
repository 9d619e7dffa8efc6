/** What the server tells of a design, and what the page computes from it by superposition. */

import type { Value } from "./controls";
import type { Block, Message } from "./protocol";

export interface Figure {
  key: string;
  name: string;
  value: number;
  unit: string;
  meaning: string;
}

export interface Facts {
  name: string;
  values: Record<string, Value>;
  light: [number, number, number];
  strip: { length: number; width: number; edges: "free" | "roller"; plane: string };
  layers: [cover: number, clear: number];
  camera: { amplitude: number; offset: number; noise: number; full_scale: number };
  calibrated: boolean;
  /** Whether what loads do to the light changes while they last. */
  creeps: boolean;
  as_drawn: boolean;
}

/** Corners of elements [m], and their displacements: u, then w, column by column from the base up [m]. */
export interface Mesh {
  mesh_x: Float32Array;
  mesh_z: Float32Array;
  moved: Float32Array;
}

/** Cells of the stress picture along the strip; the rows follow from the blocks' sizes. */
export const COLUMNS = 160;

export class Model {
  readonly id: number;
  readonly facts: Facts;
  readonly blocks: Record<string, Float32Array>;

  constructor({ header, blocks }: Message) {
    this.id = header.id as number;
    this.facts = header as unknown as Facts;
    this.blocks = blocks as Record<string, Float32Array>;
  }

  /** What is inside comes after what its fringes need. */
  complete({ blocks }: Message): void {
    Object.assign(this.blocks, blocks);
  }

  /** Whether what is inside has come. */
  get whole(): boolean {
    return "moved" in this.blocks;
  }

  get tactels(): Float32Array {
    return this.blocks.tactels;
  }

  /** Of the pixels along the strip [m]. */
  get x(): Float32Array {
    return this.blocks.x;
  }

  get millimetres(): Float32Array {
    return this.x.map((x) => x * 1e3);
  }

  /** Phase lead at the pixels [rad], equation (10.a). */
  phase(loads: number[]): Float32Array {
    return superposed(this.blocks.psi, loads);
  }

  /** sigma_x, sigma_z, tau_xz of a layer [Pa], one after another, rows from above. */
  stress(layer: "cover" | "clear", loads: number[]): Float32Array {
    return superposed(this.blocks[`stress_${layer}`], loads);
  }

  /** The elements as the loads move them. */
  mesh(loads: number[]): Mesh {
    const { mesh_x, mesh_z, moved } = this.blocks;
    return { mesh_x, mesh_z, moved: superposed(moved, loads) };
  }
}

/** Forces that were read, tactel after tactel, and their standard deviations [N]. */
export interface Estimate {
  forces: Float32Array;
  std: Float32Array;
}

/** What the reader says of its reading. */
export interface Verdict {
  status: string;
  advice: string;
  chi2: number | null;
}

export interface Reading extends Estimate, Verdict {
  design: number;
  frame: Block;
  phase: Float32Array;
  phase_std: Float32Array;
}

/** Sum of unit responses, loads first, weighted by the loads. */
function superposed(units: Float32Array, loads: number[]): Float32Array {
  const size = units.length / loads.length;
  const sum = new Float32Array(size);
  for (let k = 0; k < loads.length; k++) {
    const load = loads[k];
    if (load === 0) continue;
    const start = k * size;
    for (let i = 0; i < size; i++) sum[i] += load * units[start + i];
  }
  return sum;
}

/** Normalised intensity of a dark-field circular polariscope, equation (11). */
export function intensity(phase: number): number {
  return Math.sin(phase / 2) ** 2;
}
