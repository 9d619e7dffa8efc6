/** Messages between page and server: see protocol.py, which says what a frame is made of. */

export type Block = Float32Array | Uint8Array | Uint16Array | Int32Array;

export interface Message {
  type: string;
  header: Record<string, unknown>;
  blocks: Record<string, Block>;
}

type Entry = [name: string, dtype: string, shape: number[], offset: number];

const KINDS: Record<string, new (buffer: ArrayBuffer, offset: number, length: number) => Block> = {
  f4: Float32Array,
  u1: Uint8Array,
  u2: Uint16Array,
  i4: Int32Array,
};

/** Header and blocks of an answer in one. */
export function answer<T>({ header, blocks }: Message): T {
  return { ...header, ...blocks } as unknown as T;
}

/** A frame of the page: a header only. */
export function encode(header: object): Uint8Array {
  const text = new TextEncoder().encode(JSON.stringify(header));
  const frame = new Uint8Array(4 + text.length);
  new DataView(frame.buffer).setUint32(0, text.length, true);
  frame.set(text, 4);
  return frame;
}

/** Header and blocks of a frame; the blocks look into the frame and copy nothing. */
export function decode(frame: ArrayBuffer): Message {
  const length = new DataView(frame).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(frame, 4, length)));
  const blocks: Record<string, Block> = {};
  for (const [name, dtype, shape, offset] of header.blocks as Entry[]) {
    const count = shape.reduce((product, size) => product * size, 1);
    blocks[name] = new KINDS[dtype](frame, 4 + length + offset, count);
  }
  return { type: header.type, header, blocks };
}
