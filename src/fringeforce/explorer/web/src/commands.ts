/** Buttons that every page has: history, link and theme. */

import { isDark } from "./colours";
import { byId, element } from "./dom";

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

/** A button that stays pressed. */
export function pressed(name: string, hint: string): HTMLButtonElement {
  return element("button", { type: "button", "aria-pressed": "false", title: hint }, name);
}

export function press(button: HTMLElement, on: boolean): void {
  button.setAttribute("aria-pressed", `${on}`);
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
