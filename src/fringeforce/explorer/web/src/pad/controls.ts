/** The controls of a pad's design. */

import { type Control, type Group, imaging, layers } from "../controls";

const side = (path: string, name: string): Control => ({ path, name, unit: "mm", range: [12, 60] });

export const PAD_GROUPS: Group[] = [
  {
    name: "Pad",
    controls: [side("transducer.length", "Length"), side("transducer.width", "Width")],
  },
  ...layers(0.1, 0.1),
  {
    name: "Tactels",
    controls: [
      { path: "tactels.count", name: "Count", title: "along x × y: places that read a force" },
      { path: "tactels.pitch", name: "Pitch", unit: "mm", range: [0.5, 5] },
    ],
  },
  imaging(
    {
      path: "camera.kind",
      name: "Camera",
      choices: [["polarisation", "polarisation"], ["ordinary", "ordinary"]],
    },
    { path: "camera.pixels", name: "Pixels", title: "along x × y" },
  ),
];
