"""Pads that depart from their drawing, read as drawn and with a tolerance.

    python benchmarks/pad_departures.py [frames a row] [tactels a side] [seed] [part of a name]

Frames are made by the exact double Fourier series at every pixel and 16 depths, and not by the
reader's influence.  Contacts are those of `benchmarks/pad.py`: points of one tactel and fingertips
under Hertz's pressure, uniform on every square, scaled down where they retard light by more than
3 rad; in the rows of finer squares each tactel's square is divided into nine, with a pressure of
their own.  Forces are then the sums over a tactel.

OK: frames whose reading is OK.  far: of these, those with a force off by more than 6 of its own
deviations.  inside: forces of OK readings inside their 95 % intervals.  named: of the frames that
are refused as drawn, those whose finding names the departure.  shows: deviations of one frame,
which tells the forces as well, by which the departure is off, median; 5.3 are refused.  seconds:
median of a reading with the tolerance, and of a finding.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pad import contacts, fingertip

import fringeforce as ff
from fringeforce.design.pad import Pad
from fringeforce.mechanics.solid.block import Patches
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_as_built import smooth_image
from fringeforce.models.pad_slices import slice_retardance
from fringeforce.optics import camera as camera_optics
from fringeforce.reading.pads.single_frame import PadFrameReader

Array = NDArray[np.float64]

FRAMES, TACTELS, SEED = 12, 7, 1
PIXELS = 23
"""Pixels along a tactel, as of the shipped pad."""
SLICES = 16
FAR, INTERVAL = 6.0, 1.959964
LARGEST = 3.0
"""Retardance over both passes to which contacts are scaled down [rad]."""
FINER = 3
"""Squares along a tactel in the rows of finer squares."""


@dataclass(frozen=True)
class Bench:
    """What makes a frame, and departs from the drawing in one way.

    Attributes
    ----------
    design : mapping
        Values of the pad that are not those of the drawing.
    finer : bool
        Whether tractions differ within a tactel.
    beside : float
        Standard deviation of the centres of the tractions beside their tactels [m].
    residual : float
        Standard deviation of the retardance without load [rad].
    light : callable
        Factor on the light of a frame.
    tolerance : mapping
        Values of a drawing that allows for it.
    words : tuple of str
        What a finding must say.
    told : mapping
        What departs by a single number, relative for layers and the amplitude.
    """

    design: dict[str, Any] = field(default_factory=dict)
    finer: bool = False
    beside: float = 0.0
    residual: float = 0.0
    light: Callable[[np.random.Generator], float] = lambda _: 1.0
    tolerance: dict[str, Any] = field(default_factory=dict)
    words: tuple[str, ...] = ()
    told: dict[str, float] = field(default_factory=dict)


BENCHES = {
    "none": Bench(),
    "camera shifted by 0.05 mm": Bench(
        {"camera.shift_x": 0.05e-3},
        tolerance={"camera.shift_x": "0 +/- 0.05 mm", "camera.shift_y": "0 +/- 0.05 mm"},
        words=("camera seems shifted along x",),
        told={"camera.shift_x": 0.05e-3},
    ),
    "camera's scale 0.5 % larger": Bench(
        {"camera.scale": 1.005},
        tolerance={"camera.scale": "1 +/- 0.005"},
        words=("camera's scale",),
        told={"camera.scale": 0.005},
    ),
    "lamp 3 % dim": Bench(
        light=lambda _: 0.97,
        tolerance={"camera.amplitude": "240 +/- 3 %"},
        words=("dimmer than drawn",),
        told={"camera.amplitude": 0.03},
    ),
    "lamp drifts by 2 %": Bench(
        light=lambda rng: rng.normal(0.98, 0.02),
        tolerance={"camera.drift": "3 %"},
        words=("dimmer than drawn", "brighter than drawn"),
    ),
    "fringe visibility 0.95": Bench(
        {"polariscope.visibility": 0.95},
        tolerance={"polariscope.visibility": "0.97 +/- 0.02"},
        words=("visibility of the fringes",),
        told={"polariscope.visibility": 0.02},
    ),
    "residual retardance 0.1 rad": Bench(
        residual=0.1,
        tolerance={"polariscope.residual": "0 +/- 0.1 rad"},
        words=("residual retardance",),
    ),
    "blur of 0.1 mm": Bench(
        {"camera.blur": 0.1e-3},
        tolerance={"camera.blur": "0.08 +/- 0.04 mm"},
        words=("picture seems blurred",),
    ),
    "cover 5 % thicker": Bench(
        {"transducer.compliant.thickness": 0.525e-3},
        tolerance={"transducer.compliant.thickness": "0.5 mm +/- 5 %"},
        words=("compliant layer seems",),
        told={"transducer.compliant.thickness": 0.05},
    ),
    "clear layer 5 % softer": Bench(
        {"transducer.photoelastic.youngs_modulus": 104.5e6},
        tolerance={"transducer.photoelastic.youngs_modulus": "110 MPa +/- 5 %"},
        words=("photoelastic layer seems",),
        # beside forces of any size the moduli show by their ratio
        told={"transducer.compliant.youngs_modulus": 0.05},
    ),
    "tractions 0.1 mm rms beside their tactels": Bench(
        beside=0.1e-3,
        tolerance={"tactels.placement": "0 +/- 0.1 mm"},
        words=("beside their tactels",),
    ),
    "tractions on 1.8 mm of 2 mm": Bench(
        {"tactels.size": 1.8e-3},
        tolerance={"tactels.size": "2 +/- 0.2 mm"},
        words=("wider or narrower",),
    ),
    "Hertz's pressure on finer squares": Bench(
        finer=True,
        tolerance={"tactels.placement": "0 +/- 0.3 mm", "tactels.size": "2 +/- 0.4 mm"},
        words=("beside their tactels", "wider or narrower"),
    ),
}


def drawing(side: int) -> Pad:
    """The shipped pad with so many tactels a side."""
    length = 2e-3 * side + 3e-3
    pad = ff.load_sensor("pad")
    return pad.replace(
        **{
            "transducer.length": length,
            "transducer.width": length,
            "tactels.count": [side, side],
            "tactels.size": 2e-3,
            "camera.pixels": [round(length / 2e-3) * PIXELS] * 2,
            "camera.amplitude": 240.0,
        }
    )


def touches(bench: Bench, pad: Pad, rng: np.random.Generator) -> tuple[Array, list[Any]]:
    """Forces of a frame, shape (n, 3), and the tractions that they are the sums of."""
    if not bench.finer:
        forces = contacts(rng, pad)
        side = bench.design.get("tactels.size", pad.tactels.side)
        places = pad.tactels.places + bench.beside * rng.standard_normal((len(forces), 2))
        return forces, [(Patches(places, side), forces)]
    count, pitch = pad.tactels.count[0], pad.tactels.pitch
    fine = pad.replace(
        tactels={
            "count": [FINER * count] * 2,
            "pitch": pitch / FINER,
            "size": pitch / FINER,
        }
    )
    small = np.zeros((fine.tactels.total, 3))
    for _ in range(rng.integers(1, 4)):
        centre = pad.tactels.places[rng.integers(pad.tactels.total)]
        moved = centre + rng.uniform(-0.5, 0.5, 2) * pitch
        share, size = fingertip(fine, moved, rng.uniform(2.5e-3, 5e-3)), rng.uniform(2, 15)
        angle, ratio = rng.uniform(0, 2 * np.pi), rng.uniform(0, 0.5)
        small += share[:, None] * size * [1, ratio * np.cos(angle), ratio * np.sin(angle)]
    blocks = small.reshape(count, FINER, count, FINER, 3)
    patches = Patches(fine.tactels.places, fine.tactels.side)
    return blocks.sum(axis=(1, 3)).reshape(-1, 3), [(patches, small)]


def exposed(
    bench: Bench, model: PadModel, rng: np.random.Generator
) -> tuple[NDArray[np.unsignedinteger], Array]:
    """One frame, and the forces behind it."""
    pad = model.sensor
    forces, loads = touches(bench, pad, rng)
    made = pad.replace(**bench.design)
    half = pad.transducer.length / 2
    x, y = (np.clip(places, -half, half) for places in made.pixel_positions)
    slices = slice_retardance(made, loads, x, y, SLICES)
    share = min(1.0, LARGEST / float(np.hypot(*(2 * slices.sum(axis=0))).max()))
    slices, forces = share * slices, share * forces
    if bench.residual:
        fields = [smooth_image(x, y, 5e-3, rng) for _ in range(2)]
        slices += bench.residual / (2 * SLICES) * np.stack(fields)
    light = bench.light(rng) * replace(model, sensor=made).seen(slices)
    return camera_optics.expose(pad.camera, light.reshape(model.frame_shape), rng), forces


def row(reader: ff.Reader, frames: list[Any], words: tuple[str, ...]) -> tuple[str, Counter[str]]:
    """Figures of one way of reading, and findings that are wrong."""
    errors, named, wrong, spent, thought = [], [], Counter[str](), [], []
    for frame, truth in frames:
        begun = perf_counter()
        reading = reader.search(frame)
        spent.append(perf_counter() - begun)
        if reading.status is ff.Status.OK:
            errors.append(np.abs(reading.forces - truth) / reading.std)
        elif reading.status is not ff.Status.MODEL_MISMATCH:
            wrong[reading.status.name] += 1
        elif words:
            begun = perf_counter()
            (finding,) = reading.findings
            thought.append(perf_counter() - begun)
            named.append(any(one in finding.split(";")[0] for one in words))
            if not named[-1]:
                wrong[finding[:70]] += 1
    text = f"{len(errors) / len(frames):>5.0%}"
    off = np.array(errors)
    text += (
        f" {(off > FAR).any(axis=(1, 2)).mean():>4.0%} {(off < INTERVAL).mean():>7.1%}"
        if len(errors)
        else f" {'':>4} {'':>7}"
    )
    text += f" {sum(named):>3}/{len(named):<3}" if words else f" {np.median(spent):>6.1f}"
    return text + (f" {np.median(thought):>5.1f}" if thought else " " * 6 * bool(words)), wrong


def deviations(single: PadFrameReader, frames: list[Any], told: dict[str, float]) -> str:
    """Deviations of one frame by which a departure is off, median."""
    if not told:
        return ""
    ((path, size),) = told.items()
    return f"{np.median([size / single.departure_bound(truth)[path] for _, truth in frames]):.1f}"


def main() -> None:
    """Print the table."""
    given = [int(one) for one in sys.argv[1:4]]
    frames, side, seed = given + [FRAMES, TACTELS, SEED][len(given) :]
    wanted = sys.argv[4] if len(sys.argv) > 4 else ""
    model = ff.characterize(drawing(side))
    plain, single = ff.Reader(model), PadFrameReader(model)
    print(f"{side} x {side} tactels, {model.frame_shape} pixels, {frames} frames a row")
    print(f"{'':<49}    as drawn                         with a tolerance")
    print(
        f"{'departure':<43} shows   OK  far  inside  named seconds   OK  far  inside seconds  else",
        flush=True,
    )
    for number, (name, bench) in enumerate(BENCHES.items()):
        if wanted not in name:
            continue
        rng = np.random.default_rng([seed, number])
        seen = [exposed(bench, model, rng) for _ in range(frames)]
        before, wrong = row(plain, seen, bench.words or ("",))
        loose = replace(model, sensor=model.sensor.replace(**bench.tolerance))
        after, other = row(ff.Reader(loose), seen, ())
        most = "; ".join(f"{count} {what}" for what, count in (wrong + other).most_common(2))
        shows = deviations(single, seen, bench.told)
        print(f"{name:<43} {shows:>5}  {before}  {after}  {most}", flush=True)


if __name__ == "__main__":
    main()
