"""A pad that creeps by 11 %, pressed, held, slid, released and pressed again.

    python benchmarks/pad_creep.py [sensors] [seed]

The layers lose 6 % of their modulus in 0.4 s and 4 % in 15 s; pictures come four times a second.
Each pad is drawn from a tolerance of 20 % of each share.  Tactels: 5 x 5 on a pad of 25 mm, three
of which are pressed.  Skin: a sphere of 3 to 6 mm radius on a pad of 15 mm, whose pressure comes
from contact mechanics, with the lags of every slice of the pad integrated exactly between frames.
Readings: without compensation; with the drawing; with the pad's own terms.

OK: share of touched frames.  rms: error of the normal forces of tactels, of the total of a skin.
inside: of forces of touched tactels, or of total force and centre of pressure, within their 95 %
intervals.  far: OK frames with one of these beyond six deviations.  contact: of frames in which
nothing touches after a release, those that are OK, as if something touched.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from skin_creep import TERMS, TOLERANCE, Figures

import fringeforce as ff
from fringeforce.models.pad_presses import pad_tractions

Array = NDArray[np.float64]

TIMES = np.arange(0.0, 40.0, 0.25)
CORNERS = [0, 0.5, 1, 20, 22, 22.5, 28, 28.5, 34, 34.5, 40]
"""Times at which forces change their pace [s]."""
PUSHED = [0, 0, 1, 1, 1, 0, 0, 0.7, 0.7, 0, 0]
"""Shares of the largest force."""
SLID = np.interp(TIMES, [0, 20, 22, 25, 25.1, 40], [0, 0, 1, 1, -0.5, -0.5])
PUSH = np.interp(TIMES, CORNERS, PUSHED)
TACTELS = {"tactels": {"count": [5, 5]}, "camera": {"pixels": [96, 96]}}
SKIN = {
    "transducer.length": "15 mm",
    "transducer.width": "15 mm",
    "skin.extent": ["12 mm", "12 mm"],
    "camera.pixels": [96, 96],
}


def read(own: Figures, model: ff.PadModel, frames: Array, acting: list[Array | None]) -> None:
    """Count the readings of a recording under true values, none where nothing acts."""
    reader, began = ff.Reader(model), time.process_time()
    times = TIMES if reader.needs_times else None
    skin = model.sensor.skin is not None
    for reading, true in zip(reader.stream(frames, times=times), acting, strict=True):
        if true is None:
            own.free += 1
            own.contact += reading.ok
            continue
        own.ok.append(reading.ok)
        if not reading.ok:
            continue
        if skin:
            total = reading.total
            assert total is not None
            off = np.array([*total.force, *total.centre]) - true
            own.errors.append(float(off[0]))
            own.pulls.append(off / [*total.force_std, *total.place_std])
        else:
            touched = true.any(axis=1)
            off = (reading.forces - true)[touched]
            own.errors.extend(off[:, 0].tolist())
            own.pulls.append((off / reading.std[touched]).ravel())
    own.seconds += time.process_time() - began


def on_tactels(rng: np.random.Generator) -> tuple[Array, list[Array | None]]:
    """Forces of frames, and the same where something acts."""
    forces = np.zeros((len(TIMES), 25, 3))
    for tactel in rng.choice(25, 3, replace=False):
        forces[:, tactel, 0] = rng.uniform(1.0, 4.0) * PUSH
        forces[:, tactel, 1] = rng.uniform(-0.3, 0.3) * forces[:, tactel, 0]
    return forces, [one if one.any() else None for one in forces]


def on_skin(rng: np.random.Generator, pad: ff.Pad) -> tuple[list[list[ff.Press]], list]:
    """Presses of frames, and total force and centre of pressure where something acts."""
    (x, y), way = rng.uniform(-2e-3, 2e-3, 2), rng.uniform(-2e-3, 2e-3)
    most, radius, ratio = rng.uniform(1.5, 4.0), rng.uniform(3e-3, 6e-3), rng.uniform(-0.3, 0.3)
    pressed, acting = list[list[ff.Press]](), list[Array | None]()
    for share, slid in zip(PUSH, SLID, strict=True):
        if share == 0:
            pressed.append([])
            acting.append(None)
            continue
        normal = float(share * most)
        press = ff.Press(
            x=float(x + way * slid),
            y=float(y),
            normal=normal,
            tangential=(ratio * normal, 0.0),
            radius=radius,
        )
        pressed.append([press])
        part = pad_tractions(pad, press)
        force = part.forces.sum(axis=0)
        acting.append(np.array([*force, *(part.forces[:, 0] @ part.places / force[0])]))
    return pressed, acting


def design(name: str, values: dict, terms: Sequence[object]) -> ff.PadModel:
    """A pad whose layers relax."""
    pad = ff.load_sensor(name).replace(**values)
    return ff.characterize(pad.replace(**{"transducer.relaxation": terms}))


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore")  # forces are beyond small strain, and are taken for small
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    rng = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 0)
    stated = [{"share": f"{share} +/- 20 %", "time": lag} for share, lag in TERMS]
    print(f"{count} pads, {len(TIMES)} pictures each\n")
    print(
        f"{'':9s}{'reading':12s}{'OK':>7}{'mN rms':>8}{'inside':>9}{'far':>6}{'contact':>15}"
        f"{'seconds':>9}"
    )
    for name, kind, values in (("pad", "tactels", TACTELS), ("pad-skin", "skin", SKIN)):
        figures = {way: Figures() for way in ("without", "drawing", "own terms")}
        still, drawn = (design(name, values, terms) for terms in ([], stated))
        for _ in range(count):
            own = [(share * (1 + TOLERANCE * rng.standard_normal()), lag) for share, lag in TERMS]
            pad = design(name, values, own)
            if kind == "skin":
                loads, acting = on_skin(rng, pad.sensor)
            else:
                loads, acting = on_tactels(rng)
            frames = pad.expose(loads, rng=rng.integers(2**32), times=TIMES)
            for way, model in (("without", still), ("drawing", drawn), ("own terms", pad)):
                read(figures[way], model, frames, acting)
        for way, one in figures.items():
            print(f"{kind:9s}{way:12s}{one.row(1e-3)}")


if __name__ == "__main__":
    main()
