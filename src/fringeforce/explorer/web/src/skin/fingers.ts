/** Round fingertips across a strip, in millimetres and newtons; friction holds them. */

import { clamped, hundredths } from "../numbers";

export interface Finger {
  x: number;
  radius: number;
  normal: number;
  tangential: number;
}

export const MOST = 6;
/** Of dry skin on the cover: the same as of `Press`. */
export const FRICTION = 0.6;
export const LIMITS = { radius: [1, 10], normal: [0, 5] } as const;
export const FINGER: Finger = { x: 0, radius: 4, normal: 1.5, tangential: 0 };

/** A finger within its limits: on the skin, and dragged no harder than friction holds. */
export function held(finger: Finger, half: number): Finger {
  const normal = hundredths(clamped(finger.normal, ...LIMITS.normal));
  const most = Math.floor(FRICTION * normal * 100) / 100;
  return {
    x: hundredths(clamped(finger.x, -half, half)),
    radius: hundredths(clamped(finger.radius, ...LIMITS.radius)),
    normal,
    tangential: clamped(hundredths(finger.tangential), -most, most),
  };
}

/** As the server takes it, in SI units. */
export function sent({ x, radius, normal, tangential }: Finger): Record<string, number> {
  return { x: x * 1e-3, radius: radius * 1e-3, normal, tangential };
}

/** For a link. */
export function written({ x, radius, normal, tangential }: Finger): string {
  return [x, radius, normal, tangential].join(",");
}

export function parsed(text: string): Finger | null {
  const values = text.split(",").map(Number);
  if (values.length !== 4 || !values.every(Number.isFinite)) return null;
  const [x, radius, normal, tangential] = values;
  return { x, radius, normal, tangential };
}

/** In words, for who listens. */
export function worded({ x, radius, normal, tangential }: Finger): string {
  return `${normal.toFixed(2)} newtons and ${tangential.toFixed(2)} newtons of shear at x ${x.toFixed(2)} millimetres, radius ${radius.toFixed(1)} millimetres`;
}
