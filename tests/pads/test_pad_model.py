"""From forces to images: against the mechanics, products of Jones matrices, finite differences."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.design.pad import Pad
from fringeforce.mechanics.solid.block import Patches, SolidInfluence
from fringeforce.mechanics.solid.fourier import stress_influence
from fringeforce.mechanics.solid.influence import pad_influence
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_slices import block_of
from fringeforce.models.pad_uncertainty import pad_response
from fringeforce.optics.integrated import equivalent_retarder
from fringeforce.optics.photoelasticity import stress_optic_constant
from fringeforce.reading.pads.light import FrameLight, Place
from fringeforce.reading.pads.sampling import for_covariance, lattice
from whole_numbers import in_whole_numbers


@pytest.fixture(scope="module")
def forces(pad: Pad) -> np.ndarray:
    rng = np.random.default_rng(0)
    return rng.normal(size=(pad.tactels.total, 3)) * [1.0, 0.5, 0.5]


@pytest.fixture(scope="module")
def exact(pad: Pad) -> SolidInfluence:
    x, y = pad.pixel_positions
    patches = Patches(pad.tactels.places, pad.tactels.side)
    return stress_influence(block_of(pad), patches, x[::5], y[::4], slices=6)


def test_slices_are_those_of_the_mechanics(
    pad: Pad, model: PadModel, exact: SolidInfluence, forces: np.ndarray
) -> None:
    constant = stress_optic_constant(pad.transducer.photoelastic, pad.polariscope.wavelength)
    expected = constant * np.stack(
        [
            np.einsum("xysnc,nc,s->syx", stress, forces, exact.weights)
            for stress in (exact.difference, 2 * exact.shear)
        ],
        axis=1,
    )
    found = model.slices(forces)[:, :, ::4, ::5]
    # truncated depth profiles, and splines
    assert np.abs(found - expected).max() < 4e-3 * np.abs(expected).max()
    total = 2 * np.abs(expected.sum(axis=0)).max()
    assert np.abs(2 * (found - expected).sum(axis=0)).max() < 2e-3 * total


def test_a_weak_load_shows_its_depth_integral(model: PadModel, forces: np.ndarray) -> None:
    _, light = model.picture(model.modes(0.1 * forces), model.pictures[0])
    whole = model.retardance(0.1 * forces).reshape(2, -1)
    np.testing.assert_allclose(equivalent_retarder(light), whole, atol=4e-3)


def test_pixels_of_a_mosaic_see_their_own_analysers(model: PadModel, forces: np.ndarray) -> None:
    image = model.intensity(forces)
    angles, tall = [0.0, 45.0, 135.0, 90.0], model.sensor
    for kind, angle in enumerate(angles):
        single = tall.replace(
            **{
                "camera.kind": "ordinary",
                "polariscope.channels": [{"arrangement": "analyser", "angle": angle}],
            }
        )
        whole = replace(model, sensor=single).intensity(forces)
        row, column = divmod(kind, 2)
        np.testing.assert_allclose(image[row::2, column::2], whole[row::2, column::2], atol=1e-6)


@pytest.mark.parametrize("blur", [None, "60 um"])
def test_derivatives_of_an_image_are_finite_differences(
    model: PadModel, forces: np.ndarray, blur: str | None
) -> None:
    blurred = model.sensor.replace(camera={"blur": blur}) if blur else model.sensor
    model = replace(model, sensor=blurred)
    pull = np.random.default_rng(2).normal(size=model.kinds.shape).astype(np.float32)
    modes = model.modes(forces)
    seen, light = model.picture(modes, model.pictures[0])
    found = model.retarding.adjoint(model.picture_adjoint(modes, model.pictures[0], light, pull))
    step, size = np.random.default_rng(3).normal(size=forces.shape), 2e-3
    ahead, behind = (model.intensity(forces + s * step).ravel() for s in (size, -size))
    slope = float(pull.astype(float) @ (ahead - behind)) / (2 * size)
    assert float((found * step).sum()) == pytest.approx(slope, rel=5e-3)
    assert seen.max() <= 1 + 1e-6


def test_single_pixels_agree_with_images(model: PadModel, forces: np.ndarray) -> None:
    model = in_whole_numbers(model)
    few, modes = lattice(model, 17), model.modes(forces)
    every = modes.reshape(*modes.shape[:2], -1)
    np.testing.assert_allclose(few.modes(forces.ravel()), every[:, :, few.pixels], atol=2e-5)


def jacobian(model: PadModel, forces: np.ndarray, size: float = 2e-2) -> np.ndarray:
    """Derivatives of all pixels by all forces, shape (P, 3 n), by differences of images."""
    steps = size * np.eye(forces.size).reshape(-1, *forces.shape)
    ahead, behind = (model.intensity(forces + sign * steps) for sign in (1, -1))
    return (ahead - behind).reshape(forces.size, -1).T / (2 * size)


@pytest.mark.parametrize(("blur", "masked"), [(None, False), (None, True), ("130 um", False)])
def test_a_lattice_says_of_the_curvature_what_all_pixels_say(
    pad: Pad, model: PadModel, forces: np.ndarray, blur: str | None, masked: bool
) -> None:
    if blur:  # one pixel
        model = replace(model, sensor=pad.replace(camera={"blur": blur}))
    used = np.ones(pad.camera.pixels[::-1], dtype=bool)
    if masked:
        used[10:40, 5:50] = False
        used[np.random.default_rng(5).random(used.shape) < 0.1] = False
    slopes, weights = jacobian(model, forces), used.ravel()
    exact = slopes.T @ (weights[:, None] * slopes)
    few = for_covariance(model)
    light = FrameLight(model, pad_response(model.sensor), np.zeros(used.size))
    shone = light.shone(model.modes(forces), np.zeros(0))
    place = Place(forces=forces.ravel(), **vars(shone))
    found = few.information(place, 0, weights if masked else None)
    ratio = np.linalg.eigvals(np.linalg.solve(found * used.size, exact)).real
    assert ratio.min() > 0.8
    assert ratio.max() < 1.25


@pytest.mark.slow
def test_finite_elements_between_rollers_shine_as_the_series_does(
    model: PadModel, forces: np.ndarray
) -> None:
    pad, found = model.sensor, model.influence
    patches = Patches(pad.tactels.places, pad.tactels.side)
    solid = pad_influence(block_of(pad), patches, found.x, found.y)
    elements = characterize_pad(pad, solid)
    apart = elements.retardance(forces) - model.retardance(forces)
    assert np.abs(apart).max() < 0.02 * np.abs(model.retardance(forces)).max()


def test_stresses_can_be_given(pad: Pad, model: PadModel, forces: np.ndarray) -> None:
    free = pad.replace(**{"transducer.sides": "free"})
    x, y = (np.linspace(-s / 2, s / 2, 48) for s in (13e-3, 11e-3))
    patches = Patches(pad.tactels.places, pad.tactels.side)
    given = characterize_pad(free, stress_influence(block_of(pad), patches, x, y, 6))
    np.testing.assert_allclose(given.intensity(forces), model.intensity(forces), atol=1e-5)
    with pytest.raises(ff.FringeforceError, match="even number"):
        characterize_pad(free, stress_influence(block_of(pad), patches, x[:-1], y, 6))


def test_a_saved_model_exposes_the_same_images(
    model: PadModel, forces: np.ndarray, tmp_path: Path
) -> None:
    model.save(tmp_path / "pad.h5")
    again = ff.load_model(tmp_path / "pad.h5")
    assert again.sensor == model.sensor
    assert dict(again.provenance) == dict(model.provenance)
    np.testing.assert_array_equal(again.expose(forces, 3), model.expose(forces, 3))
    (tmp_path / "cut.h5").write_bytes((tmp_path / "pad.h5").read_bytes()[:5000])
    with pytest.raises(ff.FringeforceError, match=r"cut\.h5"):
        ff.load_model(tmp_path / "cut.h5")


def test_forces_of_another_pad_are_refused(model: PadModel) -> None:
    with pytest.raises(ff.FringeforceError, match="20 tactels"):
        model.expose(np.zeros((19, 3)))
