"""Readings of sensors in which several values that turn the influence matrix are off together.

    python benchmarks/tolerances_together.py [sensors] [seed]

The paper's strip with roller edges, drawings that state tolerances of two to four values each.
Of each, sensors are built, solved anew with the values that were drawn, and expose one frame of up
to 2 N on every tactel, at up to 30 degrees from the normal; contacts are solved by the surface's
elements, and not by the reader's moments.

OK, AMBIGUOUS, refused: shares of the verdicts.  inside: forces of OK readings within their 95 %
intervals.  distance: Mahalanobis' squared distance over its dimension, mean and largest over OK
readings; 1 is right.  s: of processor, a cold read.
"""

from __future__ import annotations

import sys
from time import process_time

import numpy as np

import fringeforce as ff

SENSORS, SEED = 60, 0
LARGEST, STEEPEST = 2.0, 30.0
"""Of the loads [N], and from the normal [degrees]."""
INTERVAL = 1.96
"""Standard deviations."""
SHIFT = {"camera.shift": "0 +/- 0.1 mm"}
COVER = {"transducer.compliant.thickness": "0.5 mm +/- 4 %"}
DRAWINGS: dict[str, dict[str, str]] = {
    "camera and light": SHIFT
    | {"transducer.photoelastic.strain_optic_coefficient": "0.05 +/- 3 %"},
    "camera and layers": SHIFT
    | COVER
    | {
        "transducer.compliant.youngs_modulus": "11 MPa +/- 5 %",
        "transducer.photoelastic.thickness": "3 mm +/- 3 %",
    },
    "layers and light": {
        "transducer.compliant.thickness": "0.5 mm +/- 5 %",
        "transducer.photoelastic.strain_optic_coefficient": "0.05 +/- 4 %",
        "transducer.photoelastic.youngs_modulus": "110 MPa +/- 5 %",
    },
    "contacts and light": {
        "tactels.placement": "0 +/- 0.1 mm",
        "transducer.photoelastic.strain_optic_coefficient": "0.05 +/- 3 %",
    },
    "camera, contacts and cover": SHIFT | COVER | {"tactels.placement": "0 +/- 0.1 mm"},
}


def row(name: str, stated: dict[str, str], sensors: int, seed: int) -> str:
    """Cells of one drawing."""
    drawn = ff.load_sensor("saad").replace(**{"transducer.edges": "roller"}).replace(**stated)
    model = ff.characterize(drawn)
    reader, rng, count = ff.Reader(model), np.random.default_rng(seed), drawn.tactels.count
    reader.prepare()
    verdicts, inside, distances, spent = list[ff.Status](), list[float](), list[float](), 0.0
    for _ in range(sensors):
        built = model.as_built(rng)
        forces = ff.polar(rng.uniform(0, LARGEST, count), rng.uniform(-STEEPEST, STEEPEST, count))
        frame = built.expose(forces, rng)
        begun = process_time()
        reading = reader.search(frame)
        spent += process_time() - begun
        verdicts.append(reading.status)
        if reading.ok:
            error = (reading.forces - forces).ravel()
            inside.append(float(np.mean(np.abs(error) < INTERVAL * reading.std.ravel())))
            distance = error @ np.linalg.solve(reading.covariance, error)
            distances.append(float(distance) / error.size)
    told = np.mean([[v is ff.Status.OK, v is ff.Status.AMBIGUOUS] for v in verdicts], axis=0)
    return (
        f"{name:<28}{sensors:>8}{told[0]:>8.1%}{told[1]:>11.1%}{1 - told.sum():>9.1%}"
        f"{np.mean(inside):>9.1%}{np.mean(distances):>10.2f}{np.max(distances):>8.2f}"
        f"{spent / sensors:>8.2f}"
    )


def main() -> None:
    """Print the table."""
    sensors = int(sys.argv[1]) if len(sys.argv) > 1 else SENSORS
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    print(
        f"{'what is off':<28}{'sensors':>8}{'OK':>8}{'AMBIGUOUS':>11}{'refused':>9}{'inside':>9}"
        f"{'distance':>10}{'largest':>8}{'s':>8}"
    )
    for name, stated in DRAWINGS.items():
        print(row(name, stated, sensors, seed), flush=True)


if __name__ == "__main__":
    main()
