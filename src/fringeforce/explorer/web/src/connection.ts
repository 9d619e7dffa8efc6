/** The one WebSocket: it comes back by itself, and holds few requests of a kind in flight. */

import { decode, encode, type Message } from "./protocol";

const FIRST_WAIT = 300;
const LONGEST_WAIT = 3000;
/** Least time between two requests for a reading [ms]: faster than eyes follow, it costs frames. */
const READ_PAUSE = 40;

type Wish = () => Record<string, unknown> | null;

interface Pace {
  /** Least time between two requests for a reading [ms]. */
  readPause?: number;
  /** Requests of a kind that may be in flight where it is not one: the server takes up the latest. */
  ahead?: Record<string, number>;
}

export class Connection {
  private socket: WebSocket | null = null;
  private wait = FIRST_WAIT;
  private number = 0;
  private readAt = 0;
  private timer = 0;
  private readonly flying = new Map<string, number[]>();
  private readonly wishes = new Map<string, Wish>();

  constructor(
    private readonly onMessage: (message: Message) => void,
    private readonly onLink: (alive: boolean) => void,
    private readonly pace: Pace = {},
  ) {
    this.open();
  }

  get alive(): boolean {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  /** Whether something of a kind was asked for, or will be, that has no answer yet. */
  busy(kind: string): boolean {
    return this.wishes.has(kind) || (this.flying.get(kind)?.length ?? 0) > 0;
  }

  /** Ask for something; while earlier requests of the kind are away, the latest wish waits. */
  want(kind: string, wish: Wish): void {
    this.wishes.set(kind, wish);
    this.send(kind);
  }

  private send(kind: string): void {
    const wish = this.wishes.get(kind);
    const flying = this.flying.get(kind) ?? [];
    if (!wish || !this.alive || flying.length >= (this.pace.ahead?.[kind] ?? 1)) return;
    if (kind === "read" && this.resting()) return;
    this.wishes.delete(kind);
    const request = wish();
    if (!request) return;
    this.number += 1;
    this.flying.set(kind, [...flying, this.number]);
    this.socket?.send(encode({ ...request, id: this.number }));
  }

  /** Whether the last reading was asked for only just now; then it is asked for again later. */
  private resting(): boolean {
    const now = performance.now();
    const left = this.readAt + (this.pace.readPause ?? READ_PAUSE) - now;
    if (left <= 0) {
      this.readAt = now;
      return false;
    }
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.send("read"), left);
    return true;
  }

  private open(): void {
    const address = new URL("socket", document.baseURI);
    address.protocol = "ws:";
    address.hash = "";
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.wait = FIRST_WAIT;
      this.flying.clear();
      this.onLink(true);
      for (const kind of [...this.wishes.keys()]) this.send(kind);
    };
    socket.onmessage = (event) => this.receive(decode(event.data));
    socket.onclose = () => this.lost();
    this.socket = socket;
  }

  private receive(message: Message): void {
    const id = message.header.id as number;
    const [kind, flying] = [...this.flying].find(([, numbers]) => numbers.includes(id)) ?? [];
    // those before it, if they have no answer yet, were passed over
    if (kind && flying) this.flying.set(kind, flying.filter((number) => number > id));
    this.onMessage(message);
    if (kind) this.send(kind);
  }

  private lost(): void {
    this.flying.clear();
    this.onLink(false);
    setTimeout(() => this.open(), this.wait);
    this.wait = Math.min(this.wait * 1.6, LONGEST_WAIT);
  }
}
