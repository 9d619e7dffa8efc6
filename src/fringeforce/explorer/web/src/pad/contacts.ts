/** Fingertips in millimetres, newtons and newton millimetres; friction holds them. */

import { clamped, hundredths } from "../numbers";

export interface Contact {
  x: number;
  y: number;
  radius: number;
  normal: number;
  shearX: number;
  shearY: number;
  twist: number;
}

export const MOST = 12;
export const LIMITS = {
  radius: [0.5, 12],
  normal: [0, 60],
  friction: [0.05, 2],
} as const;
export const FINGER: Contact = { x: 0, y: 0, radius: 4, normal: 15, shearX: 0, shearY: 0, twist: 0 };

/** Largest moment that friction carries under a round contact, all of it sliding (Hertz) [N mm]. */
export function mostTwist({ normal, radius }: Contact, friction: number): number {
  return ((3 * Math.PI) / 16) * friction * normal * radius;
}

/** A contact within its limits: on the pad, pulled no harder than friction holds. */
export function held(contact: Contact, friction: number, half: [number, number]): Contact {
  const normal = clamped(contact.normal, ...LIMITS.normal);
  const radius = clamped(contact.radius, ...LIMITS.radius);
  const shear = Math.hypot(contact.shearX, contact.shearY);
  const share = shear > 0 ? Math.min(1, (friction * normal) / shear) : 1;
  const twist = mostTwist({ ...contact, normal, radius }, friction);
  return {
    x: hundredths(clamped(contact.x, -half[0], half[0])),
    y: hundredths(clamped(contact.y, -half[1], half[1])),
    radius: hundredths(radius),
    normal: hundredths(normal),
    shearX: hundredths(contact.shearX * share),
    shearY: hundredths(contact.shearY * share),
    twist: hundredths(clamped(contact.twist, -twist, twist)),
  };
}

/** As the server takes it, in SI units. */
export function sent(contact: Contact): Record<string, number> {
  return {
    x: contact.x * 1e-3,
    y: contact.y * 1e-3,
    radius: contact.radius * 1e-3,
    normal: contact.normal,
    shear_x: contact.shearX,
    shear_y: contact.shearY,
    twist: contact.twist * 1e-3,
  };
}

/** For a link. */
export function written(contact: Contact): string {
  const { x, y, radius, normal, shearX, shearY, twist } = contact;
  return [x, y, radius, normal, shearX, shearY, twist].map((value) => Number(value.toFixed(3))).join(",");
}

export function parsed(text: string): Contact | null {
  const values = text.split(",").map(Number);
  if (values.length !== 7 || !values.every(Number.isFinite)) return null;
  const [x, y, radius, normal, shearX, shearY, twist] = values;
  return { x, y, radius, normal, shearX, shearY, twist };
}

/** In words, for who listens. */
export function worded({ x, y, radius, normal, shearX, shearY, twist }: Contact): string {
  const shear = Math.hypot(shearX, shearY);
  const pulled = shear > 0.005 ? `, shear ${shear.toFixed(2)} newtons towards ${Math.round((Math.atan2(shearY, shearX) * 180) / Math.PI)} degrees` : "";
  const turned = Math.abs(twist) > 0.005 ? `, twist ${twist.toFixed(1)} newton millimetres` : "";
  return `${normal.toFixed(2)} newtons at x ${x.toFixed(1)}, y ${y.toFixed(1)} millimetres, radius ${radius.toFixed(1)} millimetres${pulled}${turned}`;
}
