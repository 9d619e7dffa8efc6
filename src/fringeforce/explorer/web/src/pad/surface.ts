/** The pad as the eye sees it, and the contacts on it, to be pressed, dragged and moved. */

import { blankCanvas, set, shape, sized } from "../dom";
import { type Contact, FINGER, LIMITS, worded } from "./contacts";
import type { PadModel, Picture, Raster } from "./model";
import type { PadStore } from "./store";

const STEP = 0.5;
const PRESS = 0.5;
const LEAP = 5;
const PULL = 0.05;
const WHEEL_REST = 400;

interface Marks {
  group: SVGGElement;
  patch: SVGCircleElement;
  arrow: SVGLineElement;
  head: SVGPathElement;
  centre: SVGCircleElement;
  name: SVGTextElement;
}

interface Drag {
  contact: number;
  kind: "move" | "pull";
  from: [number, number];
  /** Where the arrow's tip, or the centre, was when the drag began [mm]. */
  begun: [number, number];
}

export class Surface {
  readonly canvas = blankCanvas();
  private readonly svg = shape("svg", { class: "touch" });
  private marks: Marks[] = [];
  private drag: Drag | null = null;
  private wheel = 0;
  private scale = 1;

  constructor(
    private readonly container: HTMLElement,
    private readonly store: PadStore,
    private readonly onSelect: () => void,
  ) {
    container.append(this.canvas, this.svg);
    this.svg.addEventListener("pointerdown", (event) => this.press(event));
    this.svg.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"]) {
      this.svg.addEventListener(end, () => this.release());
    }
    this.svg.addEventListener("wheel", (event) => this.roll(event), { passive: false });
  }

  /** Show the picture, if there is one; the browser stretches it to the room that there is. */
  paint(model: PadModel, picture: Picture | null, name: string): void {
    const [width, height] = this.size(model);
    set(this.canvas, { "aria-label": `The pad, ${name}.` });
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${height}px`;
    if (!picture) return;
    const [rows, columns] = picture.shape;
    if (this.canvas.width !== columns || this.canvas.height !== rows) {
      this.canvas.width = columns;
      this.canvas.height = rows;
    }
    this.canvas.getContext("2d")?.putImageData(raster(picture), 0, 0);
  }

  /** Draw the contacts where they are now. */
  place(model: PadModel): void {
    const { contacts, friction } = this.store.state;
    const [width, height] = this.size(model);
    sized(this.svg, width, height);
    while (this.marks.length < contacts.length) this.marks.push(this.made(this.marks.length));
    for (const gone of this.marks.splice(contacts.length)) gone.group.remove();
    contacts.forEach((contact, i) => this.put(i, contact, friction));
  }

  /** The picture as a file. */
  async saved(picture: Picture): Promise<Blob> {
    const [rows, columns] = picture.shape;
    const upright = new OffscreenCanvas(columns, rows);
    upright.getContext("2d")?.putImageData(raster(picture), 0, 0);
    return upright.convertToBlob({ type: "image/png" });
  }

  /** Whether a contact is being dragged now. */
  get dragged(): boolean {
    return this.drag !== null;
  }

  focus(number: number): void {
    this.marks[number]?.group.focus({ preventScroll: true });
  }

  private size(model: PadModel): [number, number] {
    const [halfX, halfY] = model.half;
    const width = this.container.clientWidth;
    this.scale = width / (2 * halfX);
    return [width, 2 * halfY * this.scale];
  }

  private made(number: number): Marks {
    const patch = shape("circle", { class: "patch" });
    const arrow = shape("line", { class: "pull" });
    const head = shape("path", { class: "tip", d: "M0 0L-9 -4.5L-9 4.5Z" });
    const centre = shape("circle", { class: "centre", r: 6 });
    const name = shape("text", { class: "number", "text-anchor": "middle" }, `${number + 1}`);
    const group = shape(
      "g",
      {
        class: "contact",
        role: "slider",
        tabindex: 0,
        "data-contact": number,
        "aria-label": `Contact ${number + 1}`,
        "aria-describedby": "press-help",
        "aria-valuemin": LIMITS.normal[0],
        "aria-valuemax": LIMITS.normal[1],
        "aria-orientation": "vertical",
      },
      patch, arrow, head, centre, name,
    );
    group.addEventListener("focus", () => this.select(number));
    group.addEventListener("keydown", (event) => this.key(event, number));
    this.svg.append(group);
    return { group, patch, arrow, head, centre, name };
  }

  private put(number: number, contact: Contact, friction: number): void {
    const marks = this.marks[number];
    const [x, y] = this.across(contact.x, contact.y);
    const reach = contact.radius * this.scale;
    const limit = friction * contact.normal || 1;
    const tip = [x + (contact.shearX / limit) * reach, y - (contact.shearY / limit) * reach];
    const shear = Math.hypot(contact.shearX, contact.shearY);
    const angle = (Math.atan2(-contact.shearY, contact.shearX) * 180) / Math.PI;
    const seen = shear > 0.005 ? "visible" : "hidden";
    set(marks.group, {
      class: number === this.store.view.selected ? "contact chosen" : "contact",
      "aria-valuenow": contact.normal.toFixed(2),
      "aria-valuetext": worded(contact),
    });
    set(marks.patch, { cx: x, cy: y, r: reach });
    set(marks.arrow, { x1: x, y1: y, x2: tip[0], y2: tip[1], visibility: seen });
    set(marks.head, { transform: `translate(${tip[0]} ${tip[1]}) rotate(${angle})`, visibility: seen });
    set(marks.centre, { cx: x, cy: y });
    set(marks.name, { x: x - 0.72 * reach - 6, y: y - 0.72 * reach - 2 });
  }

  private across(x: number, y: number): [number, number] {
    const [halfX, halfY] = this.store.half;
    return [(x + halfX) * this.scale, (halfY - y) * this.scale];
  }

  private at(event: PointerEvent): [number, number] {
    const frame = this.svg.getBoundingClientRect();
    const [halfX, halfY] = this.store.half;
    return [(event.clientX - frame.left) / this.scale - halfX, halfY - (event.clientY - frame.top) / this.scale];
  }

  private press(event: PointerEvent): void {
    if (event.button !== 0) return;
    event.preventDefault();
    const target = event.target as Element;
    const from = this.at(event);
    const group = target.closest<SVGGElement>(".contact");
    let contact = Number(group?.dataset.contact);
    if (!group) {
      const { radius, normal } = this.store.selected ?? FINGER;
      const added = this.store.add({ ...FINGER, radius, normal, x: from[0], y: from[1] }, false);
      if (!added) return;
      contact = this.store.view.selected;
    }
    this.select(contact);
    const { x, y, radius, normal, shearX, shearY } = this.store.state.contacts[contact];
    const arm = radius / (this.store.state.friction * normal || 1);
    const moved = target.classList.contains("centre");
    const begun: [number, number] = moved ? [x, y] : [shearX * arm, shearY * arm];
    this.drag = { contact, kind: moved ? "move" : "pull", from, begun };
    this.svg.setPointerCapture(event.pointerId);
    requestAnimationFrame(() => this.focus(contact));
  }

  private move(event: PointerEvent): void {
    if (!this.drag) return;
    const { contact, kind, from, begun } = this.drag;
    const [x, y] = this.at(event);
    const place = [begun[0] + x - from[0], begun[1] + y - from[1]];
    if (kind === "move") {
      this.store.touch(contact, { x: place[0], y: place[1] }, false);
      return;
    }
    // an arrow that ends at the patch's rim is as much as friction holds
    const { radius, normal } = this.store.state.contacts[contact];
    const perMillimetre = (this.store.state.friction * normal) / radius;
    this.store.touch(contact, { shearX: place[0] * perMillimetre, shearY: place[1] * perMillimetre }, false);
  }

  private release(): void {
    if (!this.drag) return;
    this.drag = null;
    this.store.commit();
    this.onSelect();
  }

  private roll(event: WheelEvent): void {
    const group = (event.target as Element).closest<SVGGElement>(".contact");
    const number = Number(group?.dataset.contact);
    if (!group || !this.store.state.contacts[number]) return;
    event.preventDefault();
    const { normal } = this.store.state.contacts[number];
    this.store.touch(number, { normal: normal - Math.sign(event.deltaY) * PRESS }, false);
    clearTimeout(this.wheel);
    this.wheel = setTimeout(() => this.store.commit(), WHEEL_REST);
  }

  private select(number: number): void {
    if (this.store.view.selected === number) return;
    this.store.view.selected = number;
    this.onSelect();
  }

  private key(event: KeyboardEvent, number: number): void {
    const { x, y, normal, shearX, shearY } = this.store.state.contacts[number];
    const along: Record<string, [number, number]> = {
      ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
    };
    const press: Record<string, number> = { "+": PRESS, "=": PRESS, "-": -PRESS, "−": -PRESS, PageUp: LEAP, PageDown: -LEAP };
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key in along) {
      const [right, up] = along[event.key];
      const pull = PULL * this.store.state.friction * normal;
      const moved = { x: x + STEP * right, y: y + STEP * up };
      const pulled = { shearX: shearX + pull * right, shearY: shearY + pull * up };
      this.store.touch(number, event.shiftKey ? pulled : moved);
    } else if (event.key in press) this.store.touch(number, { normal: normal + press[event.key] });
    else if (event.key === "Delete" || event.key === "Backspace") {
      this.store.remove(number);
      this.focus(this.store.view.selected);
    } else return;
    event.preventDefault();
  }
}

/** Pixels from above: rows of a picture count from the most negative y. */
export function raster({ shape: [rows, columns, colours], image }: Raster): ImageData {
  const data = new ImageData(columns, rows);
  const pixels = new Uint32Array(data.data.buffer);
  for (let row = 0, k = 0; row < rows; row++) {
    let i = (rows - 1 - row) * columns;
    for (let column = 0; column < columns; column++, i++, k += colours) {
      const [green, blue] = colours === 3 ? [image[k + 1], image[k + 2]] : [image[k], image[k]];
      pixels[i] = 0xff000000 | (blue << 16) | (green << 8) | image[k];
    }
  }
  return data;
}
