"""What a reader of a skin makes of frames that depart from its drawing, one departure at a time.

    python benchmarks/skin_departures.py [frames a row] [seed] [part of a departure's name]

One or two rigid cylinders of `benchmarks/skin.py` press on the paper's strip with roller edges.
Their pressure and shear come from contact mechanics on the layers of the sensor that departs, and
its light from the exact Fourier series; the reader knows the drawing alone, without tolerances.

OK, AMBIGUOUS: share of frames.  far: of those that are OK, share with a force or place of a contact
or of the total more than six stated deviations off.  test: frames that contacts explain, and that
a score test of one departure refuses; right: of these, those whose finding names the departure.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skin import drawn

import fringeforce as ff
from fringeforce.models.as_built import smooth_field
from fringeforce.models.presses import tractions
from fringeforce.reading.skin_reader import SkinReader

Array = NDArray[np.float64]

FRAMES, SEED = 24, 0
MOST = 2
"""Cylinders at a time."""
FAR = 6.0
"""Stated standard deviations."""


@dataclass(frozen=True)
class Bench:
    """What makes a frame, and departs from the drawing in one way.

    Attributes
    ----------
    design : callable
        Values of the sensor that are not those of the drawing.
    residual : float
        Standard deviation of a smooth phase lead without load [rad].
    words : str
        What a finding must say.
    """

    design: Callable[[ff.Sensor], dict[str, Any]] = field(default=lambda _: {})
    residual: float = 0.0
    words: str = ""


def _value(path: str, value: float, words: str) -> Bench:
    return Bench(lambda _: {path: value}, words=words)


def _lamp(share: float) -> Bench:
    return Bench(
        lambda drawing: {"camera.amplitude": drawing.camera.amplitude * share},
        words="dimmer than drawn",
    )


def _blur(pixels: float) -> Bench:
    return Bench(
        lambda one: {"camera.blur": pixels * one.transducer.length / one.camera.pixels},
        words="picture seems blurred",
    )


def _cover(share: float) -> Bench:
    path = "transducer.compliant.thickness"
    return Bench(
        lambda one: {path: share * one.transducer.compliant.thickness},
        words="compliant layer seems",
    )


BENCHES = {
    "none": Bench(),
    "camera shifted by 0.005 mm": _value("camera.shift", 5e-6, "camera seems shifted"),
    "camera shifted by 0.02 mm": _value("camera.shift", 2e-5, "camera seems shifted"),
    "camera's scale 0.1 % larger": _value("camera.scale", 1.001, "camera's scale"),
    "camera's scale 0.5 % larger": _value("camera.scale", 1.005, "camera's scale"),
    "lamp 0.5 % dim": _lamp(0.995),
    "lamp 2 % dim": _lamp(0.98),
    "fringe visibility 0.99": _value("polariscope.visibility", 0.99, "visibility of the fringes"),
    "fringe visibility 0.95": _value("polariscope.visibility", 0.95, "visibility of the fringes"),
    "blur of 2 px": _blur(2.0),
    "blur of 5 px": _blur(5.0),
    "gamma 1.005": _value("camera.gamma", 1.005, "gamma"),
    "gamma 1.02": _value("camera.gamma", 1.02, "gamma"),
    "residual retardance 0.05 rad": Bench(residual=0.05, words="residual retardance"),
    "cover 2 % thicker": _cover(1.02),
    "cover 5 % thicker": _cover(1.05),
}


def exposed(
    bench: Bench, model: ff.SensorModel, presses: list[ff.Press], rng: np.random.Generator
) -> NDArray[Any]:
    """A frame of a sensor that departs, shape (n_pixels,)."""
    made = replace(model, sensor=model.sensor.replace(**bench.design(model.sensor)))
    phase = made.phase(presses)
    if bench.residual:
        length = model.sensor.polariscope.residual_length
        phase = phase + bench.residual * smooth_field(made.pixel_positions, length, rng)
    return made.delivered(phase, rng)


def off(reading: ff.Reading, sensor: ff.Sensor, presses: list[ff.Press]) -> float:
    """The largest error of a force or a place, in its stated deviations."""
    parts = [tractions(sensor, press) for press in presses]
    pairs = [(reading.total, np.arange(len(parts)))]
    if len(reading.contacts) == len(parts):
        felt = sorted(reading.contacts, key=lambda one: one.centre[0])
        pairs += [(one, np.array([number])) for number, one in enumerate(felt)]
    errors = list[Array]()
    for found, own in pairs:
        assert found is not None
        places = np.concatenate([parts[k].places for k in own])
        force = np.concatenate([parts[k].forces for k in own])
        # shear moves the centre of pressure beside the axis of a cylinder
        centre = force[:, 0] @ places / force[:, 0].sum()
        error = np.array([*found.force, found.centre[0]]) - [*force.sum(axis=0), centre]
        errors.append(np.abs(error) / found.std[[0, 1, 5]])
    return float(np.max(errors))


def row(bench: Bench, reader: SkinReader, frames: int, seed: int) -> str:
    """Figures of one departure."""
    verdicts, errors, findings = Counter[str](), list[float](), list[str]()
    for number in range(frames):
        rng = np.random.default_rng([seed, number])
        presses = drawn(rng, MOST)
        made = reader.model.sensor.replace(**bench.design(reader.model.sensor))
        reading = reader.read(exposed(bench, reader.model, presses, rng))
        verdicts[reading.status.name] += 1
        if reading.ok:
            errors.append(off(reading, made, presses))
        findings += reading.findings
    right = sum(bench.words in one for one in findings) if bench.words else 0
    far = f"{np.mean(np.array(errors) > FAR):>5.0%}" if errors else ""
    shares = [verdicts[name] / frames for name in ("OK", "AMBIGUOUS")]
    return f"{shares[0]:>5.0%} {shares[1]:>10.0%} {far:>5} {len(findings):>6} {right:>6}"


def main() -> None:
    """Print the table."""
    given = [int(one) for one in sys.argv[1:3]]
    frames, seed = given + [FRAMES, SEED][len(given) :]
    wanted = sys.argv[3] if len(sys.argv) > 3 else ""
    drawing = ff.load_sensor("skin").replace(**{"transducer.edges": "roller"})
    reader = SkinReader(ff.characterize(drawing))
    print(f"{frames} frames a row")
    print(f"{'departure':<32}{'OK':>6} {'AMBIGUOUS':>10} {'far':>5} {'test':>6} {'right':>6}")
    for name, bench in BENCHES.items():
        if wanted in name:
            print(f"{name:<32} {row(bench, reader, frames, seed)}", flush=True)


if __name__ == "__main__":
    main()
