"""Whether readings name what departs from the drawing, in frames that no load explains.

    python benchmarks/diagnosis.py [frames a row] [seed]

Frames are those of `benchmarks/departures.py`, made by the exact Fourier series and not by the
reader's matrix, and read with the design as drawn.

refused: frames that no load explains.  right: those whose finding names the departure, and `alone`
those where it names no other.  A finding that names several says that the frame cannot tell them
apart.  seconds: median and largest time of a finding, the preparation of the first left out.
"""

from __future__ import annotations

import sys
from collections import Counter
from time import perf_counter

import numpy as np
from departures import BENCHES, SEED, exposed, loads

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
    "residual retardance 0.1 rad": ("residual retardance",),
    "blur of 4 px": ("picture seems blurred",),
    "blur of 12 px": ("picture seems blurred",),
    "gamma 1.05": ("response seems to have a gamma",),
    "fringe visibility 0.95": ("visibility of the fringes",),
}
"""What a finding must say of each departure."""


def claims(finding: str) -> list[str]:
    """What a finding names, without numbers and remedies."""
    named = finding.split(";")[0].split(", which this frame")[0]
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
    for number, (name, bench) in enumerate(BENCHES.items()):
        rng = np.random.default_rng([seed, number])
        forces = loads(frames, sensor.tactels.count, rng)
        named, wrong, times = [], Counter[str](), []
        for frame in exposed(bench, sensor, forces, rng):
            reading = reader.search(frame)
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
