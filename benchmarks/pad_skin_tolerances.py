"""Skins of pads that are not as drawn, read with the tolerances of their drawing and without.

    python benchmarks/pad_skin_tolerances.py [frames a row] [seed] [part of a name]

Every frame is of a pad of its own, drawn from the tolerances of its row.  What presses is that of
`benchmarks/pad_skin.py`: spheres, punches, edges, and two or three spheres, with pressures and
shears from contact mechanics on the layers of the very pad, and light from the exact series through
64 slices.

OK, ambiguous: frames.  wrong: read as OK, but a total or its centre lies more than six stated
deviations off.  inside: share of N, T and the centre of pressure within their 95 % intervals, and
the root mean square of deviations.  without: every fourth frame read as drawn: OK, of these wrong
ones, and refused ones.  named: of the refused, those whose finding names what departs.  All
tolerances at once, `all`, take minutes a frame, and are read where their row is asked for alone.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np
from pad_skin import FAR, INTERVAL, KINDS, SLICES, drawn

import fringeforce as ff
from fringeforce.contacts.press import Tractions
from fringeforce.design.tolerances import Tolerances
from fringeforce.models import as_built, pad_presses
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_as_built import BuiltPad, built_pad
from fringeforce.models.pad_presses import press_slices
from fringeforce.optics import camera
from fringeforce.reading.reading import Status

FRAMES, SEED = 20, 1
SELDOM = 4
ROWS = {
    "nothing": {},
    "amplitude": {"camera.amplitude": "235 +/- 3 %"},
    "drift": {"camera.drift": "3 %"},
    "visibility": {"polariscope.visibility": "0.96 +/- 0.02"},
    "residual": {"polariscope.residual": "0 +/- 0.1 rad"},
    "blur": {"camera.blur": "0.12 +/- 0.03 mm"},
    "shift": {"camera.shift_x": "0 +/- 0.1 mm", "camera.shift_y": "0 +/- 0.1 mm"},
    "scale": {"camera.scale": "1 +/- 0.01"},
    "cover": {"transducer.compliant.thickness": "0.5 mm +/- 3 %"},
    "modulus": {"transducer.photoelastic.youngs_modulus": "110 MPa +/- 3 %"},
    "effect": {"transducer.photoelastic.strain_optic_coefficient": "0.05 +/- 3 %"},
}  # fmt: skip
ROWS["all"] = {path: value for row in ROWS.values() for path, value in row.items()}
BRIGHT = {"camera.amplitude": 235.0, "camera.offset": 5.0}
"""Room for what is brighter than drawn."""
WORDS = {
    "amplitude": ("camera.amplitude",),
    "drift": ("camera.amplitude", "camera.drift"),
    "cover": ("transducer.",),
    "modulus": ("transducer.",),
    "effect": ("transducer.",),
}
"""What a finding names, where it is not the path of the row."""


def exposed(built: BuiltPad, loads: list[Tractions], generator: np.random.Generator) -> np.ndarray:
    """A frame of tractions on a pad."""
    pad = built.model.sensor
    slices = press_slices(pad, loads, *pad.pixel_positions)
    light = built.seen(slices).reshape(built.model.frame_shape)
    return camera.expose(pad.camera, light, generator, frame_axes=2)


def row(base: PadModel, name: str, frames: int, seed: int) -> str:
    """Read frames of pads that depart in one way, and say how well."""
    model = base.with_tolerances(**{**BRIGHT, **ROWS[name]})
    sensor = model.sensor
    exact = {"tolerances": Tolerances(), "camera": sensor.camera.model_copy(update={"drift": 0.0})}
    plain = replace(model, sensor=sensor.model_copy(update=exact))
    readers = ff.Reader(model), ff.Reader(plain)
    paths = WORDS.get(name, tuple(ROWS[name]))
    found, seconds = list[np.ndarray](), list[float]()
    ambiguous = refused = named = 0
    plainly = {"OK": 0, "wrong": 0}
    for number in range(frames):
        generator = np.random.default_rng([seed, number])
        # as `PadModel.as_built`, without the influence of squares, which nothing here needs
        own = replace(model, sensor=as_built.drawn(model.sensor, generator))
        built = built_pad(model.sensor, own, generator)
        loads = drawn(own.sensor, KINDS[number % len(KINDS)], generator)
        frame = exposed(built, loads, generator)
        places = np.concatenate([part.places for part in loads])
        force = np.concatenate([part.forces for part in loads])
        centre = force[:, 0] @ places / force[:, 0].sum()
        begin = time.process_time()
        reading = readers[0].search(frame)
        seconds.append(time.process_time() - begin)
        ambiguous += reading.status is Status.AMBIGUOUS
        truth = np.concatenate([force.sum(axis=0), centre])
        if reading.ok:
            found.append(_deviations(reading, truth))
        if number % SELDOM:
            continue
        other = readers[1].search(frame)
        if other.ok:
            plainly["OK"] += 1
            plainly["wrong"] += bool((np.abs(_deviations(other, truth)) > FAR).any())
        else:
            refused += 1
            if name not in ("nothing", "all"):
                named += any(path in finding for path in paths for finding in other.findings)
    off = np.array(found).reshape(-1, 5)
    wrong = int((np.abs(off) > FAR).any(axis=1).sum())
    cells = [f"{name:11s}{len(off):4d}{ambiguous:10d}{wrong:7d}"]
    for own in (off[:, :1], off[:, 1:3], off[:, 3:]):
        cells.append(f"{np.mean(np.abs(own) < INTERVAL):8.1%}{np.sqrt(np.mean(own**2)):5.2f}")
    cells.append(f"{plainly['OK']:6d}{plainly['wrong']:6d}{refused:8d}{named:7d}")
    cells.append(f"{np.median(seconds):9.2f}")
    return "".join(cells)


def _deviations(reading: ff.Reading, truth: np.ndarray) -> np.ndarray:
    total = reading.total
    assert total is not None
    return (np.concatenate([total.force, total.centre]) - truth) / total.std[[0, 1, 2, 6, 7]]


def main(frames: int = FRAMES, seed: int = SEED, part: str = "") -> None:
    """Print a row for every tolerance."""
    pad_presses.SLICES = SLICES
    model = ff.characterize(ff.load_sensor("pad-skin"))
    assert isinstance(model, PadModel)
    print(
        f"{'':11s}{'OK':>4s}{'ambiguous':>10s}{'wrong':>7s}{'inside N':>13s}{'inside T':>13s}"
        f"{'centre':>13s}{'without':>8s}{'wrong':>6s}{'refused':>8s}{'named':>7s}{'seconds':>9s}"
    )
    for name in ROWS:
        if part == name or (name != "all" and part in name):
            print(row(model, name, frames, seed), flush=True)


if __name__ == "__main__":
    numbers = [int(one) for one in sys.argv[1:3]]
    main(*numbers, part="".join(sys.argv[3:4]))
