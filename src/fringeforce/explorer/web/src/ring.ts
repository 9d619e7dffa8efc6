/** What was seen of a running sensor, oldest first, as far back as is worth keeping. */

import type { Message } from "./protocol";

export interface Moment {
  time: number;
  status: string;
  advice: string;
  touching: number[];
  slipping: number[];
  events: [kind: string, tactel: number][];
  frame: ArrayLike<number>;
  forces: Float32Array;
  std: Float32Array;
  phase: Float32Array;
  bytes: number;
}

/** Seconds that are kept of a camera; of a recording everything, while there is room. */
const KEPT = 60;
const ROOM = 128e6;

export class Ring {
  private moments: Moment[] = [];
  private first = 0;
  private bytes = 0;

  get length(): number {
    return this.moments.length - this.first;
  }

  get oldest(): Moment | undefined {
    return this.moments[this.first];
  }

  get newest(): Moment | undefined {
    return this.length ? this.moments[this.moments.length - 1] : undefined;
  }

  add(moment: Moment, whole: boolean): void {
    this.moments.push(moment);
    this.bytes += moment.bytes;
    while (this.bytes > ROOM || (!whole && moment.time - this.moments[this.first].time > KEPT)) {
      this.bytes -= this.moments[this.first].bytes;
      this.first += 1;
    }
    // what is gone is cut off now and then, not at each step
    if (this.first > 512) {
      this.moments = this.moments.slice(this.first);
      this.first = 0;
    }
  }

  clear(): void {
    this.moments = [];
    this.first = this.bytes = 0;
  }

  /** Number of the last moment that is not after a time, counted from the oldest. */
  at(time: number): number {
    let [low, high] = [this.first, this.moments.length - 1];
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (this.moments[middle].time <= time) low = middle;
      else high = middle - 1;
    }
    return low - this.first;
  }

  get(number: number): Moment {
    return this.moments[this.first + number];
  }

  /** Moments of a span of time that ends with a moment's number. */
  until(number: number, span: number): Moment[] {
    const end = this.get(number).time;
    return this.moments.slice(this.first + this.at(end - span), this.first + number + 1);
  }
}

export function momentOf({ header, blocks }: Message): Moment {
  return {
    time: header.time as number,
    status: header.status as string,
    advice: header.advice as string,
    touching: header.touching as number[],
    slipping: header.slipping as number[],
    events: header.events as [string, number][],
    frame: blocks.frame,
    forces: blocks.forces as Float32Array,
    std: blocks.std as Float32Array,
    phase: blocks.phase as Float32Array,
    bytes: blocks.frame.buffer.byteLength,
  };
}
