/** Touches that teach something; places are shares of half the pad's sides. */

import { type Contact, FINGER } from "./contacts";

interface Preset {
  key: string;
  name: string;
  hint: string;
  contacts: Partial<Contact>[];
}

const FIVE: Partial<Contact>[] = [
  { x: -0.66, y: -0.4, radius: 3, normal: 14, shearX: 2.5, shearY: 1.5 },
  { x: -0.36, y: 0.42, radius: 2.5, normal: 10, shearX: 1, shearY: -1.5 },
  { x: 0, y: 0.6, radius: 2.5, normal: 11, shearY: -2 },
  { x: 0.36, y: 0.42, radius: 2.5, normal: 9, shearX: -1, shearY: -1.5 },
  { x: 0.66, y: 0.05, radius: 2.2, normal: 7, shearX: -1.5, shearY: -0.5 },
];

export const PRESETS: Preset[] = [
  { key: "finger", name: "One finger", hint: "A fingertip pushes to the right", contacts: [{ shearX: 4, normal: 20 }] },
  {
    key: "pinch",
    name: "Pinch",
    hint: "Two fingertips pull together",
    contacts: [
      { x: -0.5, radius: 3, shearX: 5 },
      { x: 0.5, radius: 3, shearX: -5 },
    ],
  },
  { key: "five", name: "Five fingers", hint: "A hand that holds", contacts: FIVE },
  {
    key: "edge",
    name: "Edge",
    hint: "A sharp edge across the pad",
    contacts: [-0.6, -0.36, -0.12, 0.12, 0.36, 0.6].map((y) => ({ y, x: y / 3, radius: 1.2, normal: 6 })),
  },
  { key: "twist", name: "Twist", hint: "A fingertip turns on the spot", contacts: [{ radius: 5, normal: 25, twist: 40 }] },
  { key: "none", name: "Nothing", hint: "Nothing touches the pad", contacts: [] },
];

/** Share of the forces of a preset on a soft pad. */
const GENTLY = 0.2;

/** Contacts of a preset on a pad of half sides [mm]. */
export function presetContacts(key: string, half: [number, number], soft: boolean): Contact[] {
  const preset = PRESETS.find((one) => one.key === key) ?? PRESETS[0];
  const share = soft ? GENTLY : 1;
  return preset.contacts.map((part) => {
    const contact = { ...FINGER, ...part };
    return {
      ...contact,
      x: contact.x * half[0],
      y: contact.y * half[1],
      normal: contact.normal * share,
      shearX: contact.shearX * share,
      shearY: contact.shearY * share,
      twist: contact.twist * share,
    };
  });
}
