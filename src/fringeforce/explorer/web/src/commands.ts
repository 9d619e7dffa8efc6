/** Buttons that every page has: history, link and theme. */

import { isDark } from "./colours";
import { button, byId } from "./dom";

interface Past {
  readonly canUndo: boolean;
  readonly canRedo: boolean;
  undo(): void;
  redo(): void;
}

/** Make the buttons work: take back, do again, copy the link, change the theme. */
export function commands(past: Past, hash: () => string, onTheme: () => void): void {
  byId("undo").addEventListener("click", () => past.undo());
  byId("redo").addEventListener("click", () => past.redo());
  addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
    // text that is being typed has an undo of its own
    if (event.target instanceof HTMLInputElement && event.target.type !== "range") return;
    event.preventDefault();
    if (event.shiftKey) past.redo();
    else past.undo();
  });
  byId("share").addEventListener("click", () => void copied(hash()));
  const root = document.documentElement;
  const kept = localStorage.getItem("theme");
  if (kept) root.dataset.theme = kept;
  byId("theme").addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    localStorage.setItem("theme", root.dataset.theme);
    onTheme();
  });
}

/** Show what can be taken back, and the other theme's name. */
export function showCommands(past: Past): void {
  byId<HTMLButtonElement>("undo").disabled = !past.canUndo;
  byId<HTMLButtonElement>("redo").disabled = !past.canRedo;
  byId("theme").textContent = isDark() ? "Light" : "Dark";
}

/** Buttons of which the chosen one stays pressed. */
export class Choice<K extends string> {
  private readonly buttons = new Map<K, HTMLButtonElement>();

  /** Of a kind of things, each with a key, a name and a hint. */
  constructor(
    container: HTMLElement,
    kind: string,
    things: { key: K; name: string; hint: string }[],
    onChoose: (key: K) => void,
  ) {
    for (const { key, name, hint } of things) {
      const made = button(name, () => onChoose(key), { title: hint, [`data-${kind}`]: key });
      this.buttons.set(key, made);
    }
    container.append(...this.buttons.values());
  }

  /** Offer one of them, or not. */
  offer(key: K, there: boolean): void {
    const made = this.buttons.get(key);
    if (made) made.hidden = !there;
  }

  show(chosen: string): void {
    for (const [key, made] of this.buttons) press(made, key === chosen);
  }
}

/** Show whether a button stays pressed. */
export function press(made: HTMLElement, on: boolean): void {
  made.setAttribute("aria-pressed", `${on}`);
}

async function copied(hash: string): Promise<void> {
  const address = new URL(hash, location.href).href;
  history.replaceState(null, "", address);
  try {
    await navigator.clipboard.writeText(address);
    byId("link").textContent = "Link copied.";
  } catch {
    byId("link").textContent = "The address bar now holds the link.";
  }
}
