"""What a person sees of a reading: the rules of the GUM, and no array."""

import re

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.measured import measured


# JCGM 100:2008, section 7.2.2, states this mass; the others round at the edge of a digit
@pytest.mark.parametrize(
    ("value", "std", "words"),
    [
        (100.02147, 0.00035, "100.02147 +/- 0.00035 g"),
        (1.23456, 0.0996, "1.23 +/- 0.10 g"),
        (123.456, 14.2, "123 +/- 14 g"),
        (-0.02, 0.5, "-0.02 +/- 0.50 g"),
        (2.5, 0.0, "2.5 g"),
        (2.5, np.inf, "2.5 g"),
    ],
)
def test_two_digits_of_a_deviation_are_told(value: float, std: float, words: str) -> None:
    assert measured(value, std, "g") == words


def test_a_printed_reading_tells_every_force_within_its_deviation() -> None:
    model = ff.characterize(ff.load_sensor("saad"))
    forces = ff.polar(1.0, angle=10, n=11)
    reading = ff.Reader(model).read(model.expose(forces, rng=0))
    head, *lines = str(reading).splitlines()
    assert head.startswith("OK")
    told = np.array([re.findall(r"(-?[\d.]+) \+/- ([\d.]+) N", line) for line in lines])
    values, deviations = np.moveaxis(told.astype(float), -1, 0)
    np.testing.assert_allclose(values, reading.forces, atol=0.06 * reading.std.max())
    np.testing.assert_allclose(deviations, reading.std, rtol=0.06)


def test_a_skin_prints_its_contacts_and_a_refused_frame_its_reason() -> None:
    model = ff.characterize(ff.load_sensor("skin"))
    reader = ff.Reader(model)
    frame = model.expose([ff.Press(x=1e-3, normal=2.0, tangential=0.4, width=0.8e-3)], rng=0)
    read = reader.read(frame)
    assert str(read).splitlines()[1] == repr(read.contacts[0])
    told = re.findall(r"(-?[\d.]+) \+/- [\d.]+ m?[mN]", str(read))
    # newtons and millimetres, six deviations of any of them at most
    assert [float(value) for value in told] == pytest.approx([2.0, 0.4, 1.0, 0.8], abs=0.06)
    refused = reader.read(np.zeros_like(frame))
    assert str(refused) == "BAD_FRAME: All pixels are 0."
    assert repr(refused) == "<Reading BAD_FRAME>"


def test_printed_objects_hold_no_arrays() -> None:
    model = ff.characterize(ff.load_sensor("saad"))
    reading = ff.Reader(model).read(model.expose(ff.polar(1.0, angle=10, n=11), rng=0))
    for shown in (model, reading):
        assert len(repr(shown)) < 100
        assert "array" not in repr(shown)
