"""What rigid cylinders press and drag on covers: Chebyshev's coefficients of their tractions.

    python benchmarks/contact_shapes.py [contacts] [seed]

Cylinders of 1 to 10 mm under 0.2 to 5 N use up to 0.9 of a friction of 0.3 to 1, on covers of 0.25
to 2 mm and 2 to 30 MPa on harder layers of 1.5 to 4 mm.  Their tractions come from contact
mechanics on the layers, with stick and slip, and are expanded on their own half width in U_k times
the semicircle of Hertz, as in the model of contacts on skins.

Each row: half widths over the thickness of the cover, contacts, then mean and standard deviation of
the coefficients.
"""

from __future__ import annotations

import sys
from itertools import pairwise

import numpy as np
from scipy.special import eval_chebyu

import fringeforce as ff
from fringeforce.models.presses import tractions

CONTACTS, SEED = 200, 0
COVERS, CLEAR = (0.25e-3, 2e-3), (1.5e-3, 4e-3)
SOFT, HARD = (2e6, 30e6), (30e6, 160e6)
RADII, FORCES = (1e-3, 10e-3), (0.2, 5.0)
FRICTION, USED = (0.3, 1.0), 0.9
DEGREES = np.arange(1, 9)
GROUPS = 0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0


def drawn(generator: np.random.Generator) -> tuple[ff.Sensor, ff.Press]:
    """A strip and a cylinder on its middle."""

    def between(ends: tuple[float, float]) -> float:
        return float(np.exp(generator.uniform(*np.log(ends))))

    friction, force = generator.uniform(*FRICTION), between(FORCES)
    press = ff.Press(
        x=0.0,
        normal=force,
        tangential=float(generator.uniform(-USED, USED)) * friction * force,
        radius=between(RADII),
        friction=friction,
    )
    changed = {
        "transducer.edges": "roller",
        "transducer.compliant.thickness": between(COVERS),
        "transducer.compliant.youngs_modulus": between(SOFT),
        "transducer.photoelastic.thickness": generator.uniform(*CLEAR),
        "transducer.photoelastic.youngs_modulus": between(HARD),
    }
    return ff.load_sensor("skin").replace(**changed), press


def main(contacts: int = CONTACTS, seed: int = SEED) -> None:
    """Expand tractions of random contacts, and print their coefficients."""
    ratios, found = np.empty(contacts), np.empty((2, contacts, len(DEGREES)))
    for number in range(contacts):
        sensor, press = drawn(np.random.default_rng([seed, number]))
        part = tractions(sensor, press)
        low, high = part.ends
        half = (high - low) / 2
        terms = eval_chebyu(DEGREES, ((part.places - (high + low) / 2) / half)[:, None])
        found[:, number] = (part.forces.T @ terms) / part.forces.sum(axis=0)[:, None]
        ratios[number] = half / sensor.transducer.compliant.thickness
    print(f"{'':22s}" + "".join(f"{f'c_{k}':>13s}" for k in DEGREES))
    for name, own in zip(("pressure", "shear"), found, strict=True):
        for low, high in pairwise(GROUPS):
            inside = (ratios >= low) & (ratios < high)
            if inside.any():
                stated = zip(own[inside].mean(axis=0), own[inside].std(axis=0), strict=True)
                print(
                    f"{name:9s}{low:3.1f} to {high:3.1f} {inside.sum():3d}"
                    + "".join(f"{mean:7.3f} {std:5.3f}" for mean, std in stated)
                )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
