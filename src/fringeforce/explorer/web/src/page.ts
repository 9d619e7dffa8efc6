/** What every page has around its pictures: designs to start from, notices, and a link that is kept. */

import type { Changes } from "./controls";
import { byId, element, write } from "./dom";
import type { Verdict } from "./model";

const LINK_DELAY = 250;

interface Keeper {
  readonly hash: string;
  change(part: { start: string; changes: Changes }): void;
}

export class Page {
  private timer = 0;
  private readonly start = byId<HTMLSelectElement>("start");

  constructor(
    private readonly store: Keeper,
    repaint: () => void,
  ) {
    this.start.addEventListener("change", () => store.change({ start: this.start.value, changes: {} }));
    addEventListener("hashchange", () => {
      if (location.hash !== store.hash) location.reload();
    });
    new ResizeObserver(repaint).observe(byId("stage"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
  }

  /** Offer the designs that there are to start from. */
  offer(designs: string[], chosen: string): void {
    const options = designs.map((name) => element("option", { value: name }, name));
    this.start.replaceChildren(element("option", { value: "" }, "as started"), ...options);
    this.choose(chosen);
  }

  choose(start: string): void {
    this.start.value = start;
  }

  notice(text: string): void {
    const notice = byId("notice");
    notice.textContent = text;
    notice.hidden = text === "";
  }

  /** Tell whether the server answers. */
  linked(alive: boolean): void {
    byId("link").textContent = alive ? "" : "No answer from the server; trying again …";
    document.body.classList.toggle("lost", !alive);
  }

  /** Keep the state in the address once it has come to rest. */
  keep(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => history.replaceState(null, "", this.store.hash), LINK_DELAY);
  }
}

/** What the reader says of a reading, or that there is none yet. */
export function showVerdict(reading: Verdict | null): void {
  const status = byId("status");
  const chi2 = reading?.chi2 ? ` Reduced chi-square ${reading.chi2.toFixed(2)}.` : "";
  write(status, reading ? reading.status.replaceAll("_", " ") : "Reading …");
  write(byId("advice"), reading ? reading.advice + chi2 : "The reader warms up once.");
  status.dataset.status = reading?.status ?? "";
}
