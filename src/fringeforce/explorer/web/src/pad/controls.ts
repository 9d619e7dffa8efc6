/** The controls of a pad's design. */

import { type Control, type Group, poisson, stiffness, thickness } from "../controls";

const side = (path: string, name: string): Control => ({ path, name, unit: "mm", range: [12, 60] });

export const PAD_GROUPS: Group[] = [
  {
    name: "Pad",
    controls: [side("transducer.length", "Length"), side("transducer.width", "Width")],
  },
  {
    name: "Cover",
    controls: [thickness("compliant", [0.1, 3]), stiffness("compliant", [0.1, 1000]), poisson("compliant")],
  },
  {
    name: "Clear layer",
    controls: [
      thickness("photoelastic", [0.5, 10]),
      stiffness("photoelastic", [0.1, 5000]),
      poisson("photoelastic"),
      {
        path: "transducer.photoelastic.strain_optic_coefficient",
        name: "Strain-optic coefficient",
        range: [0.005, 0.2],
        logarithmic: true,
      },
    ],
  },
  {
    name: "Tactels",
    controls: [
      { path: "tactels.count", name: "Count", title: "along x × y" },
      { path: "tactels.pitch", name: "Pitch", unit: "mm", range: [0.5, 5] },
    ],
  },
  {
    name: "Light and camera",
    controls: [
      { path: "polariscope.wavelength", name: "Wavelength", unit: "nm", range: [400, 700] },
      {
        path: "camera.kind",
        name: "Camera",
        choices: [["polarisation", "polarisation"], ["ordinary", "ordinary"]],
      },
      { path: "camera.pixels", name: "Pixels", title: "along x × y" },
      { path: "camera.bits", name: "Bits", range: [4, 16], whole: true },
      { path: "camera.amplitude", name: "Amplitude", range: [10, 245] },
      { path: "camera.offset", name: "Offset", range: [0, 60] },
      { path: "camera.noise", name: "Noise", title: "grey levels", range: [0, 40] },
      {
        path: "camera.noise_model",
        name: "Noise is",
        choices: [["uniform", "uniform"], ["gaussian", "Gaussian"]],
      },
    ],
  },
];
