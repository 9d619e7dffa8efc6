/** Small helpers around the document. */

const SVG = "http://www.w3.org/2000/svg";

export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`The page has no element called ${id}.`);
  return found as T;
}

type Attributes = Record<string, string | number>;

/** An HTML element with attributes and children. */
export function element<K extends keyof HTMLElementTagNameMap>(
  name: K,
  attributes: Attributes = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(name);
  set(made, attributes);
  made.append(...children);
  return made;
}

/** A button that does something. */
export function button(name: string, act: () => void, attributes: Attributes = {}): HTMLButtonElement {
  const made = element("button", { type: "button", ...attributes }, name);
  made.addEventListener("click", act);
  return made;
}

/** A canvas that has a name even before anything is drawn on it. */
export function blankCanvas(): HTMLCanvasElement {
  return element("canvas", { role: "img", "aria-label": "Not drawn yet." });
}

/** An SVG element with attributes and children. */
export function shape<K extends keyof SVGElementTagNameMap>(
  name: K,
  attributes: Attributes = {},
  ...children: (Node | string)[]
): SVGElementTagNameMap[K] {
  const made = document.createElementNS(SVG, name) as SVGElementTagNameMap[K];
  set(made, attributes);
  made.append(...children);
  return made;
}

export function set(target: Element, attributes: Attributes): void {
  for (const [name, value] of Object.entries(attributes)) {
    if (target.getAttribute(name) !== `${value}`) target.setAttribute(name, `${value}`);
  }
}

/** Make a picture so many pixels wide and high, without stretching what is in it. */
export function sized(svg: SVGSVGElement, width: number, height: number): void {
  set(svg, { width, height, viewBox: `0 0 ${width} ${height}` });
}

/** Set a text that has changed: a live region speaks whenever it is set. */
export function write(target: HTMLElement, text: string): void {
  if (target.textContent !== text) target.textContent = text;
}

/** Save bytes or text as a file. */
export function save(name: string, content: BlobPart, type: string): void {
  const address = URL.createObjectURL(new Blob([content], { type }));
  element("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}
