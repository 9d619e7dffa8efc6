"""Whether readings name what departs from the drawing, in frames that no load explains.

    python benchmarks/diagnosis.py [frames a row] [seed]

Frames are those of `benchmarks/departures.py`, made by the exact Fourier series and not by the
reader's matrix, and read with the design as drawn; and frames under a far dimmer lamp, with a hair
of 50 of the 2,048 pixels, and with the picture of a lamp, 80 grey levels bright.

refused: frames that no load explains.  right: those whose finding names the departure, and `alone`
those where it names no other.  A finding that names several says that the frame cannot tell them
apart.  seconds: median and largest time of a finding, the preparation of the first left out.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import replace
from time import perf_counter

import numpy as np
from departures import BENCHES, SEED, exposed, loads
from numpy.typing import NDArray

import fringeforce as ff

FRAMES = 40
SHOWN = 30
"""Letters of a wrong finding."""
RIGHT = {
    "contacts 0.8 mm wide in the place of points": (" mm wide, not", "wider or narrower"),
    "all presses 0.05 mm beside the tactels": ("beside their tactels",),
    "each press 0.1 mm rms beside its tactel": ("beside their tactels, each",),
    "forces half way between tactels": ("beside their tactels",),
    "camera shifted by 0.05 mm": ("camera seems shifted",),
    "light 5 % darker at the ends": ("light seems uneven",),
    "lamp 3 % dim": ("dimmer than drawn",),
    "lamp 20 % dim": ("dimmer than drawn",),
    "residual retardance 0.1 rad": ("residual retardance",),
    "blur of 4 px": ("picture seems blurred",),
    "blur of 12 px": ("picture seems blurred",),
    "gamma 1.05": ("response seems to have a gamma",),
    "fringe visibility 0.95": ("visibility of the fringes",),
    "a hair over 50 pixels": ("but for what it shows from",),
    "a glint 2.5 mm wide": ("but for what it shows from",),
}
"""What a finding must say of each departure."""
LIT = BENCHES["none"]
MORE = {
    "lamp 20 % dim": replace(LIT, light=lambda _, light: 0.8 * light),
    "a hair over 50 pixels": LIT,
    "a glint 2.5 mm wide": LIT,
}
"""Rows besides those of `benchmarks/departures.py`."""


def dirty(name: str, frame: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """A frame with what lies on the strip, or shines on it, somewhere."""
    place, pixels = rng.integers(200, len(frame) - 200), np.arange(len(frame))
    if name == "a hair over 50 pixels":
        return np.where(np.abs(pixels - place) < 25, 20, frame).astype(np.uint8)
    if name == "a glint 2.5 mm wide":
        lit = frame + 80 * np.exp(-(((pixels - place) / 123) ** 2))
        return np.clip(np.rint(lit), 0, 255).astype(np.uint8)
    return frame


def claims(finding: str) -> list[str]:
    """What a finding names, without numbers and remedies."""
    named = finding.split(";")[0].split(", which this frame")[0].split(": dirt")[0]
    return named.replace("The ", "the ").replace("All ", "all ").split(", or ")


def right(name: str, claim: str) -> bool:
    """Whether a claim names a departure."""
    if name == "cover 5 % thicker":
        return "compliant layer seems" in claim and "thicker" in claim
    return any(words in claim for words in RIGHT.get(name, ()))


def main() -> None:
    """Print the table."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    sensor = ff.load_sensor("saad").replace(**{"transducer.edges": "roller"})
    reader = ff.Reader(ff.characterize(sensor))
    print(f"{'departure':<45}  refused  right  alone  seconds       named when wrong")
    for number, (name, bench) in enumerate((BENCHES | MORE).items()):
        rng = np.random.default_rng([seed, number])
        forces = loads(frames, sensor.tactels.count, rng)
        named, wrong, times = [], Counter[str](), []
        for frame in exposed(bench, sensor, forces, rng):
            reading = reader.search(dirty(name, frame, rng))
            if reading.status is not ff.Status.MODEL_MISMATCH:
                continue
            begun = perf_counter()
            found = claims(reading.findings[0])
            times.append(perf_counter() - begun)
            named.append((any(right(name, claim) for claim in found), len(found) == 1))
            if not named[-1][0]:
                wrong[found[0][:SHOWN]] += 1
        good = sum(is_right for is_right, _ in named)
        alone = sum(is_right and is_alone for is_right, is_alone in named)
        spent = f"{np.median(times):.2f} {max(times):.2f}" if times else "-"
        most = "; ".join(f"{count} {what}" for what, count in wrong.most_common(1))
        row = f"{name:<45}  {len(named):>7}  {good:>5}  {alone:>5}  {spent:<12}  {most}"
        print(row, flush=True)


if __name__ == "__main__":
    main()
