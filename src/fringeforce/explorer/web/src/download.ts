/** Files to take away: those of the library come from the server, pictures are made here. */

import { button, byId, save } from "./dom";

const SERVER_FILES = {
  design: "Design file (.toml)",
  model: "Model (.h5)",
  forces: "Forces (.csv)",
  reading: "Reading (.csv)",
} as const;

export const PICTURES = { svg: "Figure (.svg)", png: "Figure (.png)" } as const;

type ServerFile = keyof typeof SERVER_FILES;
export type Picture = keyof typeof PICTURES;

export function downloadMenu<P extends string>(
  names: Record<P, string>,
  onFile: (kind: ServerFile) => void,
  onPicture: (kind: P) => void,
  kinds = Object.keys(SERVER_FILES) as ServerFile[],
): void {
  const menu = byId<HTMLDetailsElement>("download");
  const item = (kind: string, name: string, act: () => void) => {
    const chosen = () => {
      menu.open = false;
      act();
    };
    return button(name, chosen, { "data-file": kind });
  };
  const pictures = Object.entries(names) as [P, string][];
  menu.querySelector(".items")?.append(
    ...kinds.map((kind) => item(kind, SERVER_FILES[kind], () => onFile(kind))),
    ...pictures.map(([kind, name]) => item(kind, name, () => onPicture(kind))),
  );
  document.addEventListener("click", (event) => {
    if (!menu.contains(event.target as Node)) menu.open = false;
  });
  menu.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    menu.open = false;
    menu.querySelector("summary")?.focus();
  });
}

export function saveFile(name: string, content: Uint8Array): void {
  save(name, content.slice().buffer as ArrayBuffer, "application/octet-stream");
}
