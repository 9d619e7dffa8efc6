"""Skins of strips that are not as drawn, read with the tolerances of their drawing.

    python benchmarks/skin_tolerances.py [sensors a row] [seed] [part of a name]

Every sensor is drawn from the tolerances of its row and solved anew.  It exposes a frame of one to
three cylinders anywhere, 2 mm apart, of 0.3 to 2 N with shear up to 0.3 of that, which is read
cold, and a way of 60 frames on which one of them slides by 2 mm, presses and shears, which are
followed.  Pressures and shears are those of contact mechanics on the layers of the very sensor, and
light comes from the exact series.

OK, AMBIGUOUS, refused: cold frames.  wrong: read as OK, but force or centre of pressure lie beyond
1e-9 of their covariance.  inside: share of normal and tangential force and centre of pressure
within their 95 % intervals.  distance: Mahalanobis' squared distance of the three, over three; 1 is
right.  s: of processor, a cold read, the median.  on the way: OK and wrong frames, their distance
(frames of one sensor have its tolerances in common), and frames a second of processor.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from time import process_time

import numpy as np
from scipy.stats import chi2

import fringeforce as ff
from fringeforce.models.presses import tractions

SENSORS, SEED = 40, 0
APART, REACH = 2e-3, 4.5e-3
"""Contacts from each other, and from the middle [m]."""
WAY = 60
"""Frames."""
WRONG, INTERVAL = 1e-9, 1.96
ROWS = {
    "nothing": {},
    "camera": {"camera.shift": "0 +/- 0.2 mm"},
    "scale": {"camera.scale": "1 +/- 0.01"},
    "effect": {"transducer.photoelastic.strain_optic_coefficient": "0.05 +/- 3 %"},
    "layers": {
        "transducer.compliant.thickness": "0.5 +/- 0.02 mm",
        "transducer.compliant.youngs_modulus": "11 MPa +/- 5 %",
        "transducer.photoelastic.youngs_modulus": "110 MPa +/- 5 %",
    },
    "light": {
        "polariscope.visibility": "0.97 +/- 0.02",
        "polariscope.residual": "0 +/- 0.05 rad",
        "camera.drift": "3 %",
    },
}
ROWS["camera, layers"] = ROWS["camera"] | ROWS["layers"]
ROWS["camera, effect, light"] = ROWS["camera"] | ROWS["effect"] | ROWS["light"]


def pressed(rng: np.random.Generator) -> list[ff.Press]:
    """Cylinders anywhere."""
    while True:
        places = np.sort(rng.uniform(-REACH, REACH, rng.integers(1, 4)))
        if all(b - a > APART for a, b in pairwise(places)):
            break
    found = []
    for x in places:
        normal, radius = rng.uniform(0.3, 2.0), rng.uniform(1e-3, 8e-3)
        shear = rng.uniform(-0.3, 0.3) * normal
        found.append(ff.Press(x=x, normal=normal, tangential=shear, radius=radius))
    return found


def sliding(rng: np.random.Generator) -> list[ff.Press]:
    """A cylinder on its way."""
    start, turn, radius = rng.uniform(-3e-3, 1e-3), rng.uniform(0, 6), rng.uniform(2e-3, 6e-3)
    found = []
    for along in np.linspace(0, 1, WAY):
        normal = 0.9 + 0.5 * np.sin(turn + 2 * along)
        shear = 0.3 * normal * np.sin(turn + 3 * along)
        place = start + 2e-3 * along
        found.append(ff.Press(x=place, normal=normal, tangential=shear, radius=radius))
    return found


def deviations(
    reading: ff.Reading, sensor: ff.Sensor, presses: list[ff.Press]
) -> tuple[np.ndarray, float]:
    """Errors of force and centre of pressure in deviations, and their squared distance."""
    parts, total = [tractions(sensor, press) for press in presses], reading.total
    assert total is not None
    force = np.concatenate([part.forces for part in parts])
    places = np.concatenate([part.places for part in parts])
    true = [*force.sum(axis=0), force[:, 0] @ places / force[:, 0].sum()]
    off = np.array([*total.force, total.centre[0]]) - true
    known = total.covariance[np.ix_([0, 1, 5], [0, 1, 5])]
    return off / np.sqrt(np.diag(known)), float(off @ np.linalg.solve(known, off))


def row(name: str, sensors: int, seed: int) -> str:
    """Cells of one row."""
    stated = {"transducer.edges": "roller", "camera.amplitude": 215.0} | ROWS[name]
    model = ff.characterize(ff.load_sensor("skin").replace(**stated))
    reader, rng = ff.Reader(model), np.random.default_rng(seed)
    reader.prepare()
    verdicts, each, seconds = list[ff.Status](), list[np.ndarray](), list[float]()
    squares, way, spent, frames = list[float](), list[float](), 0.0, 0
    for _ in range(sensors):
        built, presses = model.as_built(rng), pressed(rng)
        frame, begun = built.expose(presses, rng=rng), process_time()
        reading = reader.search(frame)
        seconds.append(process_time() - begun)
        verdicts.append(reading.status)
        if reading.ok:
            off, square = deviations(reading, built.model.sensor, presses)
            each.append(off)
            squares.append(square)
        moving = sliding(rng)
        exposed = [built.expose([press], rng=rng) for press in moving]
        reader.reset()
        for press, frame in zip(moving, exposed, strict=True):
            begun = process_time()
            reading = reader.read(frame)
            # the first frame of a way is searched
            spent += 0.0 if press is moving[0] else process_time() - begun
            frames += 1
            if reading.ok:
                way.append(deviations(reading, built.model.sensor, [press])[1])
    told = np.mean([[v is ff.Status.OK, v is ff.Status.AMBIGUOUS] for v in verdicts], axis=0)
    limit = chi2.isf(WRONG, 3)
    inside = np.mean(np.abs(each) < INTERVAL)
    return (
        f"{name:<22}{told[0]:>7.1%}{told[1]:>11.1%}{1 - told.sum():>9.1%}"
        f"{np.sum(np.array(squares) > limit):>7}{inside:>8.1%}{np.mean(squares) / 3:>10.2f}"
        f"{np.median(seconds):>7.2f}{len(way) / frames:>10.1%}{np.sum(np.array(way) > limit):>7}"
        f"{np.mean(way) / 3:>10.2f}{sensors * (WAY - 1) / spent:>10.0f}"
    )


def main() -> None:
    """Print the table."""
    sensors = int(sys.argv[1]) if len(sys.argv) > 1 else SENSORS
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    part = sys.argv[3] if len(sys.argv) > 3 else ""
    print(f"{'':<22}{'cold':<59}{'on the way':>12}")
    print(
        f"{'what is off':<22}{'OK':>7}{'AMBIGUOUS':>11}{'refused':>9}{'wrong':>7}{'inside':>8}"
        f"{'distance':>10}{'s':>7}{'OK':>10}{'wrong':>7}{'distance':>10}{'frames/s':>10}"
    )
    for name in ROWS:
        if part in name:
            print(row(name, sensors, seed), flush=True)


if __name__ == "__main__":
    main()
