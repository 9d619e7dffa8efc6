/** A guided tour: from force to stress, phase, fringes and camera, and back to force. */

import { button, byId, element } from "./dom";

interface Step {
  panel: string;
  title: string;
  text: string;
  preset?: string;
}

const STEPS: Step[] = [
  {
    panel: "panel-forces",
    title: "1. A force",
    text: "A soft cover lies on a clear layer that is bonded to a rigid base. Each arrow is the force on one tactel: its normal part presses, its tangential part drags along the strip. Drag an arrow's tail, or focus it and use the arrow keys.",
    preset: "single",
  },
  {
    panel: "panel-stress",
    title: "2. Stress",
    text: "Finite elements find the stress under that force. The clear layer is pressed right under it and pulled beside it. Light that runs through the depth sees the stress along the strip, σx. Show the mesh to see how the strip gives way.",
  },
  {
    panel: "panel-phase",
    title: "3. Phase",
    text: "Stressed, the clear layer has two refractive indices. Light that crosses it, meets the mirror under the cover and comes back is delayed by the integral of σx over the depth. All of this is linear: the phase is an influence matrix times the forces, one column for each.",
  },
  {
    panel: "panel-fringes",
    title: "4. Fringes",
    text: "Between circular polarisers the delay turns into light: intensity is sin²(p/2), dark wherever the phase is a whole number of turns. More force, more fringes. The paper's load presses 1 N at 10° on every tactel.",
    preset: "paper",
  },
  {
    panel: "panel-camera",
    title: "5. A noisy line",
    text: "A line camera sees the fringes as grey levels, rounded and with noise. This line is all that the sensor has. It tells neither the sign of the phase nor the number of whole turns, only how bright each pixel is.",
  },
  {
    panel: "panel-reading",
    title: "6. Back to force",
    text: "Yet the forces come back. The reader follows every phase that the grey levels allow along the strip, keeps the likeliest, and fits all pixels at once. The bars are two of its own standard deviations; they should hold the true value 19 times in 20. Press New noise to try again.",
  },
  {
    panel: "panel-reading",
    title: "7. When not to trust it",
    text: "A load and its negative give the same line; contact pushes, and that decides. Where nothing decides, as under pure shear or no load at all, the verdict says so. Try the presets, more noise or fewer bits, and watch the verdict and the bars.",
    preset: "slip",
  },
];

export class Tour {
  private readonly card = element("div", {
    class: "tour",
    role: "dialog",
    "aria-label": "Guided tour",
    tabindex: -1,
  });
  private at = -1;
  private giveBack = () => {};

  /** @param keep remembers the forces, and gives what brings them back */
  constructor(
    private readonly onPreset: (key: string) => void,
    private readonly keep: () => () => void,
  ) {
    this.card.hidden = true;
    document.body.append(this.card);
    byId("tour").addEventListener("click", () => this.begin());
    this.card.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.end();
    });
  }

  private begin(): void {
    if (this.at < 0) this.giveBack = this.keep();
    this.show(0);
  }

  private show(at: number): void {
    this.leave();
    this.at = at;
    const step = STEPS[at];
    if (step.preset) this.onPreset(step.preset);
    const panel = byId(step.panel);
    panel.classList.add("shown");
    panel.scrollIntoView({ block: "center", behavior: calm() ? "auto" : "smooth" });
    const close = button("Close", () => this.end());
    const back = button("Back", () => this.show(at - 1));
    back.disabled = at === 0;
    const last = at === STEPS.length - 1;
    const next = button(last ? "Finish" : "Next", () => (last ? this.end() : this.show(at + 1)));
    next.classList.add("primary");
    this.card.replaceChildren(
      element("h2", {}, step.title),
      element("p", {}, step.text),
      element("div", { class: "choices" }, close, back, next),
    );
    this.card.hidden = false;
    next.focus({ preventScroll: true });
  }

  private leave(): void {
    if (this.at >= 0) byId(STEPS[this.at].panel).classList.remove("shown");
  }

  private end(): void {
    this.leave();
    this.at = -1;
    this.card.hidden = true;
    this.giveBack();
    byId("tour").focus();
  }
}

function calm(): boolean {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}
