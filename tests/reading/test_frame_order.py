"""Frames whose channels or pixels come in another order than the design says."""

import numpy as np

import fringeforce as ff
from fringeforce.reading.frame_order import FITS

COLOURS = [{"wavelength": "635 nm"}, {"wavelength": "525 nm"}, {"wavelength": "470 nm"}]


def test_channels_in_another_order_are_named(sensor: ff.Sensor) -> None:
    """Such as blue, green and red, as some libraries have the colours of pictures."""
    model = ff.characterize(sensor.replace(**{"polariscope.channels": COLOURS}))
    frame = model.expose(ff.polar(1.0, angle=10, n=11), rng=0)
    reader = ff.Reader(model)
    assert reader.search(frame).ok
    reading = reader.search(frame[::-1])
    assert reading.status is ff.Status.MODEL_MISMATCH
    how = "its channels are taken in the order 3, 2, 1"
    assert reading.findings == (FITS.format(how=how),)


def test_a_camera_that_was_turned_round_after_its_light_was_measured_is_named() -> None:
    """Light that falls from one end to the other is that of one way round."""
    tilted = {"camera.amplitude": 200.0, "camera.pixels": 1024}
    drawn = ff.load_sensor("saad").replace(**tilted)
    rng, forces = np.random.default_rng(0), np.tile([0.8, 0.1], (4, 11, 1))
    forces[:, :6] *= 0.5
    made = ff.characterize(drawn)
    along = np.linspace(0.75, 1.15, 1024)
    frames = made.delivered(made.phase(forces), rng, light=along)
    model = ff.calibrate(drawn, frames, forces, ["transducer.compliant.youngs_modulus"])
    new = made.delivered(made.phase(forces[0]), rng, light=along)
    reader = ff.Reader(model)
    assert reader.search(new).ok
    reading = reader.search(new[::-1])
    assert reading.status is ff.Status.MODEL_MISMATCH
    assert reading.findings == (FITS.format(how="it is turned end for end"),)


def test_no_other_order_is_named_where_none_fits(model: ff.SensorModel) -> None:
    levels = np.clip(
        np.linspace(0, 255, 2048) + np.random.default_rng(0).normal(0, 3, 2048), 0, 255
    )
    reading = ff.Reader(model).search(np.round(levels))
    assert reading.status is ff.Status.MODEL_MISMATCH
    assert "The frame fits" not in " ".join(reading.findings)
