"""Frames of a strip under large strain in a row, and those of small strain under the same forces.

    python benchmarks/large_strain_live.py [seed] [frames ...]

Every tactel of the paper's strip, its contacts 0.5 mm wide, goes from one random force up to the
stated one to another and back in so many frames, three ways for each.  Phases are solved with
hyperelastic layers at 13 steps of the way, which a cubic spline in between joins.  Where frames are
hardly linear in the forces, as where much of the strip has a phase near a multiple of pi, each
takes more steps, whatever the strain.

strain: of the frames, and of their reader.  tracked: frames that were followed and not searched.
OK: frames read as OK.  inside: forces within their 95 % intervals.  frames/s: per second of
processor, with all solutions that it takes.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from scipy.interpolate import CubicSpline

import fringeforce as ff

FRAMES = (4000, 20000)
"""There and back in 0.4 and 2 s at 10,000 frames a second."""
LARGEST = (0.5, 1.0, 2.0)
"""Forces on a tactel [N]."""
LEAST, SLOPE = 0.1, 0.2
"""Least of them [N], and tangential over normal force, of one sign at one end and of the other."""
STEPS = 13
"""Solutions on the way, which errs by less than a thousandth of the noise between them."""
WAYS = 3
WARM = 256
"""Frames before the first that counts."""


def main() -> None:
    """Print the table."""
    seed, *given = [int(word) for word in sys.argv[1:]] or [0]
    design = ff.load_sensor("saad").replace(**{"tactels.contact_width": "0.5 mm"})
    models = {
        strain: ff.characterize(design.replace(**{"transducer.strain": strain}))
        for strain in ("linear", "finite")
    }
    readers = {strain: ff.Reader(model) for strain, model in models.items()}
    steps = np.linspace(0, 1, STEPS)
    print(f"{'N':>3s}  strain  frames  tracked      OK  inside  frames/s")
    for largest in LARGEST:
        for way in range(WAYS):
            drawn = np.random.default_rng((seed, way))
            ends = drawn.uniform(LEAST, largest, (2, design.tactels.count, 1))
            ends = ends * [[[1.0, SLOPE]], [[1.0, -SLOPE]]]
            on_the_way = ends[0] + np.multiply.outer(steps, ends[1] - ends[0])
            for strain, reader in readers.items():
                solved = CubicSpline(steps, models[strain].phase(on_the_way))
                for count in given or FRAMES:
                    rng = np.random.default_rng((seed, way, count))
                    share = (1 - np.cos(2 * np.pi * np.linspace(0, 1, WARM + count))) / 2
                    forces = ends[0] + np.multiply.outer(share, ends[1] - ends[0])[WARM:]
                    frames = models[strain].delivered(solved(share), rng)
                    reader.prepare()
                    reader.reset()
                    reader.read_on(frames[:WARM])
                    begun = time.process_time()
                    batch = reader.read_on(frames[WARM:])
                    taken = time.process_time() - begun
                    inside = np.abs(batch.forces - forces) < 1.96 * batch.std
                    good = np.mean([status is ff.Status.OK for status in batch.status])
                    print(
                        f"{largest:3g}  {strain:6s} {count:7d} {batch.tracked.mean():8.1%} "
                        f"{good:7.1%} {inside.mean():7.1%} {count / taken:9.0f}",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
