"""Labels are what made the image, and optics do what their labels say."""

from dataclasses import replace
from typing import Any

import h5py
import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.contacts.shapes import Punch
from fringeforce.datasets.example import example
from fringeforce.datasets.making import Dataset
from fringeforce.datasets.optics import Optics, drawn_optics, image_of
from fringeforce.datasets.study_file import DatasetStudy, OpticsRanges
from fringeforce.design.pad import Pad
from fringeforce.models.pad import PadModel, characterize_pad

pytestmark = pytest.mark.slow

Touches = tuple[DatasetStudy, Pad]


def perfect(pad: Pad) -> Optics:
    return drawn_optics(OpticsRanges(noise=(0.0, 0.0)), pad, np.random.default_rng(0))


def load(pad: Pad, normal: float = 0.05) -> np.ndarray[Any, np.dtype[np.float64]]:
    forces = np.zeros((pad.tactels.total, 3))
    forces[12], forces[8] = (normal, 0.2 * normal, 0.1 * normal), (normal / 2, 0, 0)
    return forces


def picture(model: PadModel, forces: Any, **changes: Any) -> np.ndarray[Any, Any]:
    optics = replace(perfect(model.sensor), **changes)
    return image_of(model, forces, optics, np.random.default_rng(0)).astype(float)


def test_without_errors_the_image_is_the_models(pad_model: PadModel) -> None:
    camera = pad_model.sensor.camera
    forces = load(pad_model.sensor, 0.5)
    expected = camera.amplitude * pad_model.intensity(forces) + camera.offset
    np.testing.assert_allclose(picture(pad_model, forces), expected, atol=0.51)


def test_the_image_of_a_body_is_that_of_a_press_and_not_of_its_tactels(
    pad_model: PadModel,
) -> None:
    camera = pad_model.sensor.camera
    body = Punch(place=(0.4e-3, -0.3e-3), normal=2.0, shear=(0.5, 0.2), radius=0.8e-3)
    press = ff.Press(
        x=0.4e-3, y=-0.3e-3, normal=2.0, tangential=(0.5, 0.2), width=1.6e-3, profile="punch"
    )
    imprint = body.imprint(pad_model.sensor)
    expected = camera.amplitude * pad_model.intensity([press]) + camera.offset
    # rounding, and a level between two ways to divide the pressure into small forces
    np.testing.assert_allclose(picture(pad_model, [imprint.tractions]), expected, atol=1.5)
    assert np.abs(picture(pad_model, imprint.forces) - expected).max() > 20


def test_labels_are_the_contacts_behind_the_image(
    made: Dataset, touches: Touches, pad_model: PadModel
) -> None:
    with h5py.File(made.shards[0]) as file:
        images, forces = np.asarray(file["image"]), np.asarray(file["forces"])
        contacts, optics = np.asarray(file["contacts"]), np.asarray(file["optics"])
        dead = np.asarray(file["dead"])
    for number, load in enumerate(forces):
        mine = contacts[contacts["image"] == number]
        whole = [mine[name].sum() for name in ("normal", "shear_x", "shear_y")]
        np.testing.assert_allclose(load.sum(axis=0), whole, atol=1e-5)
        o = optics[number]
        label = Optics(
            **{
                name: float(o[name])
                for name in ("light", "vignetting", "noise", "blur", "wavelength_error")
            },
            gradient=(float(o["gradient_x"]), float(o["gradient_y"])),
            extinction_ratio=float(o["extinction_ratio"]),
            shift=(float(o["shift_x"]), float(o["shift_y"])),
            dead=np.stack(
                [dead[dead["image"] == number][c] for c in ("row", "column", "level")], 1
            ),
        )
        acting = [one.tractions for _, one in example(pad_model, touches[0], number).contacts]
        again = image_of(pad_model, acting, replace(label, noise=0.0), np.random.default_rng(0))
        left = images[number].astype(float) - again
        clipped = (images[number] == 0) | (images[number] == 255)
        assert left[~clipped].std() == pytest.approx(label.noise, abs=0.35)
        assert abs(left[~clipped].mean()) < 0.3


def test_an_image_depends_on_its_number_and_the_seed_alone(
    touches: Touches, pad_model: PadModel
) -> None:
    study, _ = touches
    one = example(pad_model, study, 7)
    more = study.model_copy(update={"number": 1000, "shard": 100, "format": "png"})
    np.testing.assert_array_equal(example(pad_model, more, 7).image, one.image)
    for other in (
        example(pad_model, study, 8),
        example(pad_model, study.model_copy(update={"seed": 1}), 7),
    ):
        assert not np.array_equal(other.forces, one.forces)
    # the noise of one study's optics does not choose another's contacts
    calm = study.model_copy(update={"optics": OpticsRanges()})
    np.testing.assert_array_equal(example(pad_model, calm, 7).forces, one.forces)


def test_light_gradient_and_vignetting_scale_what_is_above_the_offset(pad_model: PadModel) -> None:
    pad = pad_model.sensor
    forces, offset = load(pad, 0.3), pad.camera.offset
    plain = picture(pad_model, forces) - offset
    dim = picture(pad_model, forces, light=0.6) - offset
    np.testing.assert_allclose(dim, 0.6 * plain, atol=0.9)
    tilted = picture(pad_model, forces, gradient=(0.1, -0.1)) - offset
    x, y = np.linspace(-1, 1, 64), np.linspace(-1, 1, 64)[:, None]
    np.testing.assert_allclose(tilted, plain * (1 + 0.1 * x - 0.1 * y), atol=1.2)
    dark = picture(pad_model, forces, vignetting=0.3) - offset
    np.testing.assert_allclose(dark, plain * (1 - 0.15 * (x**2 + y**2)), atol=1.0)


def test_a_shifted_camera_sees_the_neighbouring_place(pad_model: PadModel) -> None:
    forces = load(pad_model.sensor, 0.3)
    plain, shifted = picture(pad_model, forces), picture(pad_model, forces, shift=(1.0, -2.0))
    np.testing.assert_allclose(shifted[2:, :-1], plain[:-2, 1:], atol=1)


def test_another_wavelength_is_that_of_another_design(pad_model: PadModel) -> None:
    pad = pad_model.sensor
    forces = load(pad, 0.5)
    other = characterize_pad(pad.replace(**{"polariscope.wavelength": "660 nm"}))
    expected = pad.camera.amplitude * other.intensity(forces) + pad.camera.offset
    found = picture(pad_model, forces, wavelength_error=660e-9 - 632.8e-9)
    np.testing.assert_allclose(found, expected, atol=0.6)


def test_blur_and_extinction_are_those_of_a_design(pad_model: PadModel) -> None:
    pad = pad_model.sensor
    forces = load(pad, 0.5)
    drawn = pad.replace(
        **{"camera.blur": "150 um", "polariscope.plates": {"extinction_ratio": 0.02}}
    )
    expected = PadModel(drawn, pad_model.influence).intensity(forces)
    found = picture(pad_model, forces, blur=150e-6, extinction_ratio=0.02)
    np.testing.assert_allclose(
        found, pad.camera.amplitude * expected + pad.camera.offset, atol=0.51
    )


def test_noise_and_dead_pixels_are_as_labelled(pad_model: PadModel) -> None:
    pad = pad_model.sensor
    ranges = OpticsRanges(noise=(4.0, 4.0), dead_pixels=(5, 5), light=(0.5, 0.5))
    optics = drawn_optics(ranges, pad, np.random.default_rng(3))
    quiet = picture(pad_model, load(pad, 0.4), light=0.5)
    noisy = image_of(pad_model, load(pad, 0.4), optics, np.random.default_rng(1)).astype(float)
    rows, columns, levels = optics.dead.T
    assert len(set(zip(rows, columns, strict=True))) == 5
    np.testing.assert_array_equal(noisy[rows, columns], levels)
    assert set(levels) <= {0, 255}
    bright = quiet > 25  # where no noise is cut off
    bright[rows, columns] = False
    spread = 4 * 4 / np.sqrt(2 * bright.sum())  # four deviations of an estimate
    assert (noisy - quiet)[bright].std() == pytest.approx(4.0, abs=spread)


def test_forces_that_no_slice_can_follow_are_refused(pad_model: PadModel) -> None:
    with pytest.raises(InputError, match="smaller forces"):
        picture(pad_model, load(pad_model.sensor, 500.0))
