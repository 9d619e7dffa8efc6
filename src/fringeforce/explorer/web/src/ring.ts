/** What was seen of a running sensor, oldest first, as far back as is worth keeping. */

import type { Estimate } from "./model";
import type { Block } from "./protocol";

export interface Moment extends Estimate {
  time: number;
  status: string;
  advice: string;
  touching: number[];
  slipping: number[];
  events: [kind: string, tactel: number][];
  frame: Block;
  phase: Float32Array;
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

  /** @param whole whether to keep everything that there is room for */
  add(moment: Moment, whole: boolean): void {
    this.moments.push(moment);
    this.bytes += size(moment);
    while (this.bytes > ROOM || (!whole && moment.time - this.moments[this.first].time > KEPT)) {
      this.bytes -= size(this.moments[this.first]);
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

  /** All that is kept, oldest first. */
  all(): Moment[] {
    return this.moments.slice(this.first);
  }

  /** Moments of a span of time that ends with a moment's number. */
  until(number: number, span: number): Moment[] {
    const end = this.get(number).time;
    return this.moments.slice(this.first + this.at(end - span), this.first + number + 1);
  }
}

/** All blocks of a moment look into one buffer. */
function size({ forces }: Moment): number {
  return forces.buffer.byteLength;
}
