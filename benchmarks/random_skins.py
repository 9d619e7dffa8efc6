"""Readings of skins of random but sensible strips, against their covariance.

    python benchmarks/random_skins.py [designs] [seed] [frames of each]

Every strip has roller edges, a cover of 0.25 to 2 mm of 2 to 30 MPa on a clear layer of 1.5 to 4 mm
of 30 to 160 MPa, a skin of 6 to 30 mm with a friction of 0.3 to 1, and 512 to 4,096 pixels with a
uniform noise of 1 to 5 grey levels.  One to three contacts at a time press with 0.2 to 5 N each and
use up to 0.9 of their friction: two of three are cylinders of 1 to 10 mm in radius, by contact
mechanics on the layers with stick and slip, the others even or Hertz pressures 0.1 to 1.5 mm wide.
The light of all is from the exact Fourier series; the reader has finite elements.  Contacts have
their middles on the skin, and lie across its ends, too; they are apart by at least 2.5 mm and two
covers.  Frames whose phase changes by more than
1 rad from pixel to pixel are left out.

OK, AMBIGUOUS, refused: shares of the verdicts.  beyond: shares of the OK readings whose total force
and centre of pressure are farther off than their covariance allows by chance.  squared distance:
mean square of Mahalanobis' distance of these three over three; one if the covariance is right.
"""

from __future__ import annotations

import sys
from collections import Counter

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

import fringeforce as ff
from fringeforce.contacts.press import Tractions
from fringeforce.models.presses import tractions

Array = NDArray[np.float64]

DESIGNS, SEED, EACH = 40, 0, 12
MOST, APART, USED = 3, 2.5e-3, 0.9
PACE = 1.0
"""Largest phase between neighbouring pixels [rad]."""
RARE, NEVER = 1e-3, 1e-9
"""Chances of errors that are counted."""
TOTAL = [0, 1, 5]
"""Normal and tangential force and centre of pressure among what a total states."""


def uniform_log(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def random_design(rng: np.random.Generator) -> ff.Sensor:
    """A strip with a skin that somebody might build."""
    cover, clear = uniform_log(rng, 0.25e-3, 2e-3), rng.uniform(1.5e-3, 4e-3)
    extent = uniform_log(rng, 6e-3, 30e-3)
    return ff.load_sensor("skin").replace(
        **{
            "transducer.edges": "roller",
            "transducer.length": extent + 2 * (cover + clear) * rng.uniform(0.6, 1.2),
            "transducer.compliant.thickness": cover,
            "transducer.compliant.youngs_modulus": uniform_log(rng, 2e6, 30e6),
            "transducer.photoelastic.thickness": clear,
            "transducer.photoelastic.youngs_modulus": uniform_log(rng, 30e6, 160e6),
            "skin.extent": extent,
            "skin.friction": rng.uniform(0.3, 1.0),
            "camera.pixels": int(uniform_log(rng, 512, 4096)),
            "camera.noise": rng.uniform(1, 5),
        }
    )


def random_press(sensor: ff.Sensor, x: float, rng: np.random.Generator) -> ff.Press:
    """One contact at a place."""
    assert sensor.skin is not None
    friction, normal = sensor.skin.friction, uniform_log(rng, 0.2, 5.0)
    shear = rng.uniform(-USED, USED) * friction * normal
    if rng.random() < 2 / 3:
        radius = uniform_log(rng, 1e-3, 10e-3)
        return ff.Press(x=x, normal=normal, tangential=shear, friction=friction, radius=radius)
    return ff.Press(
        x=x,
        normal=normal,
        tangential=shear,
        friction=friction,
        width=rng.uniform(0.1e-3, 1.5e-3),
        profile="flat" if rng.random() < 0.5 else "hertz",
    )


def random_presses(
    sensor: ff.Sensor, rng: np.random.Generator
) -> tuple[list[ff.Press], list[Tractions]]:
    """Contacts with middles on the skin and apart, and their tractions."""
    assert sensor.skin is not None
    half, cover = sensor.skin.extent / 2, sensor.transducer.compliant.thickness
    while True:
        places = np.sort(rng.uniform(-half, half, int(rng.integers(1, MOST + 1))))
        if (np.diff(places) < max(APART, 2 * cover)).any():
            continue
        presses = [random_press(sensor, float(x), rng) for x in places]
        try:
            return presses, [tractions(sensor, one) for one in presses]
        except ff.InputError:  # beyond the strip
            continue


def main(designs: int = DESIGNS, seed: int = SEED, each: int = EACH) -> None:
    """Print the table."""
    verdicts, squares = Counter[str](), list[float]()
    for number in range(designs):
        sensor = random_design(np.random.default_rng([seed, number]))
        model = ff.characterize(sensor)
        reader = ff.Reader(model)
        for k in range(each):
            rng = np.random.default_rng([seed, number, k])
            presses, acting = random_presses(sensor, rng)
            if np.abs(np.diff(model.phase(presses))).max() > PACE:
                continue
            reading = reader.search(model.expose(presses, rng=rng))
            verdicts[reading.status.name] += 1
            if not reading.ok or reading.total is None:
                print(f"{seed} {number} {k}: {reading.status.name}", file=sys.stderr, flush=True)
                continue
            force = np.concatenate([one.forces for one in acting])
            place = force[:, 0] @ np.concatenate([one.places for one in acting])
            total = reading.total
            error = np.array([*total.force, total.centre[0]])
            error -= [*force.sum(axis=0), place / force[:, 0].sum()]
            known = total.covariance[np.ix_(TOTAL, TOTAL)]
            squares.append(float(error @ np.linalg.solve(known, error)))
            if (chance := chdtrc(len(TOTAL), squares[-1])) < RARE:
                print(f"{seed} {number} {k}: chance {chance:.1e}", file=sys.stderr, flush=True)
    whole, chances = sum(verdicts.values()), chdtrc(len(TOTAL), np.array(squares))
    shares = {"OK": verdicts["OK"] / whole, "AMBIGUOUS": verdicts["AMBIGUOUS"] / whole}
    cells = {
        "frames": f"{whole}",
        "OK": f"{shares['OK']:.1%}",
        "AMBIGUOUS": f"{shares['AMBIGUOUS']:.1%}",
        "refused": f"{abs(1 - sum(shares.values())):.1%}",
        f"beyond {RARE:g}": f"{np.mean(chances < RARE):.2%}",
        f"beyond {NEVER:g}": f"{np.mean(chances < NEVER):.2%}",
        "squared distance": f"{np.mean(squares) / len(TOTAL):.3f}",
        "median": f"{np.median(squares) / len(TOTAL):.3f} (0.789 expected)",
    }
    print("  ".join(f"{head:>{len(cell)}}" for head, cell in cells.items()))
    print("  ".join(f"{cell:>{len(head)}}" for head, cell in cells.items()))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
