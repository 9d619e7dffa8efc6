"""Arrays of every kind in the place of frames, forces and times."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import fringeforce as ff
from damage.counting import Case, refused

PATH = "transducer.photoelastic.strain_optic_coefficient"
SAME = ("object", "strings", "read only", "big-endian", "other strides", "lists", "float16")
"""Kinds that hold the same numbers in another way."""
OTHER = ("bool", "-1", "negative strides")
"""Kinds that hold numbers that could be right, but are not."""
UNUSABLE = (
    "None",
    "masked",
    "complex",
    "bytes",
    "dates",
    "empty",
    "scalar",
    "cut",
    "ragged",
    "words",
    "set",
)
"""Kinds that hold nothing that could be meant."""


def arrays(model: ff.SensorModel) -> Iterator[Case]:
    """Arrays to read, read_batch, phase, expose and calibrate."""
    forces = ff.polar(1.0, 10, n=11)
    frame = model.expose(forces, rng=0)
    reader = ff.Reader(model)
    reader.read(frame)  # compiles its loops, which takes longer than an input may

    def read(values: Any) -> np.ndarray:
        reader.reset()
        reading = reader.read(values)
        finite = np.isfinite(reading.forces).all()
        assert finite or reading.status is not ff.Status.OK, "OK, but forces are not finite"
        if reading.status is ff.Status.BAD_FRAME:
            raise ff.FringeforceError(reading.detail)
        return reading.forces

    def batch(values: Any) -> np.ndarray:
        found = reader.read_batch(values)
        good = found.status == ff.Status.OK
        assert np.isfinite(found.forces[good]).all(), "OK, but forces are not finite"
        if (found.status == ff.Status.BAD_FRAME).any():
            raise ff.FringeforceError("a bad frame")
        return found.forces

    def phase(values: Any) -> np.ndarray:
        found = model.phase(values)
        assert np.isfinite(found).all(), "phase is not finite"
        return found

    def expose(values: Any) -> np.ndarray:
        return model.expose(values, rng=0)

    loads = np.random.default_rng(0).uniform(0.1, 1.5, (8, 11, 2)) * [1.0, 0.2]
    loads = loads.astype(np.float16).astype(float)  # so that float16 holds the same numbers
    small = ff.characterize(model.sensor.replace(**{"camera.pixels": 512}))
    frames, own = small.expose(loads, rng=1), forces.astype(np.float16).astype(float)

    def calibrate(values: Any, known: Any) -> np.ndarray:
        found = ff.calibrate(small.sensor, values, known, [PATH], aside=0)
        value = found.sensor.transducer.photoelastic.strain_optic_coefficient
        assert 0 < value < 1, "a value of no material"
        return np.array([value])

    calls = {
        "read": (read, frame),
        "batch": (batch, frame[None]),
        "phase": (phase, own),
        "expose": (expose, own),
        "calibrate frames": (lambda values: calibrate(values, loads), frames),
        "calibrate forces": (lambda values: calibrate(frames, values), loads),
    }
    for name, (call, good) in calls.items():
        expected = call(good)

        def same(
            values: Any, call: Any = call, expected: np.ndarray = expected, exact: bool = True
        ) -> None:
            found = call(values)
            if exact:
                np.testing.assert_allclose(found, expected, rtol=1e-6, err_msg="another result")
            assert np.isfinite(found).all(), "not finite"

        for kind, values in _kinds(np.asarray(good)).items():
            if name.startswith("calibrate") and kind in OTHER:
                continue  # good arrays of other numbers, on which a search may go on for minutes
            if kind in UNUSABLE:
                attempt = lambda same=same, values=values: refused(lambda: same(values))  # noqa: E731
            else:
                exact = kind in SAME
                attempt = lambda same=same, values=values, exact=exact: same(values, exact=exact)  # noqa: E731
            yield f"{name}({kind})", attempt


def _kinds(good: np.ndarray[Any, Any]) -> dict[str, Any]:
    real, fixed = good.astype(float), good.copy()
    fixed.flags.writeable = False
    mixed = {"nan": np.nan, "inf": np.inf, "-inf": -np.inf, "1e300": 1e300, "-1": -1.0}
    wide = np.zeros((*good.shape, 2), good.dtype)
    wide[..., 0] = good
    return {
        **{name: np.full(good.shape, value) for name, value in mixed.items()},
        "one nan": np.where(np.arange(good.size).reshape(good.shape) == 7, np.nan, real),
        "object": real.astype(object),
        "lists": real.tolist(),
        "None": None,
        "complex": real + 1j,
        "strings": real.astype(str),
        "words": np.full(good.shape, "frame"),
        "bytes": b"frame",
        "set": {1.0, 2.0},
        "dates": np.full(good.shape, np.datetime64("2020-01-01")),
        "bool": real > 0,
        "empty": np.empty(0),
        "scalar": 1.0,
        "one more axis": good[None, None, None],
        "cut": good[..., :-1],
        "ragged": [[1, 2], [3]],
        "negative strides": good[..., ::-1],
        "other strides": wide[..., 0],
        "read only": fixed,
        "big-endian": real.astype(">f8"),
        "float16": real.astype(np.float16),
        "masked": np.ma.masked_less(real, np.median(real)),
    }
