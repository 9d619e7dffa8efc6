"""Every linear map passes the dot test: <A x, y> = <x, A' y> (Claerbout, Earth Soundings, 1992)."""

import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator

from fringeforce.base.linear_map import LinearMap
from fringeforce.models.int16_matrix import Packed
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_series import PadSeries
from fringeforce.models.splines import Band
from fringeforce.optics.area_camera import Lens


@pytest.fixture
def operators(model: PadModel) -> dict[str, LinearOperator]:
    blurred = Lens.of(model.sensor.replace(camera={"blur": "60 um"}))
    assert blurred is not None
    matrix = np.random.default_rng(0).normal(size=(70, 30)).astype(np.float32)
    samples, series = np.linspace(-1, 1, 12), PadSeries(model.sensor, model.influence)
    maps: dict[str, LinearMap] = {
        "splines": Band.of(samples, np.linspace(-1.1, 1.1, 50)),
        "whole numbers": Packed.of(matrix),
        "influence of a pad": model.influence,
        "retardance of a pad": model.retarding,
        "change of it with the cover": series.changes("transducer.compliant.thickness", 2e-5)[1],
        "change of it with the pitch": series.changes("tactels.pitch", 1e-5)[0],
        "lens": blurred,
    }
    return {name: one.operator for name, one in maps.items()}


def test_every_adjoint_is_the_transpose(operators: dict[str, LinearOperator]) -> None:
    rng = np.random.default_rng(1)
    for name, operator in operators.items():
        x, y = (rng.normal(size=size).astype(np.float32) for size in operator.shape[::-1])
        ahead, back = operator.matvec(x), operator.rmatvec(y)
        size = float(np.linalg.norm(ahead) * np.linalg.norm(y))
        assert np.vdot(ahead, y) == pytest.approx(np.vdot(x, back), abs=1e-5 * size), name


def test_every_map_is_linear(operators: dict[str, LinearOperator]) -> None:
    rng = np.random.default_rng(2)
    for name, operator in operators.items():
        one, other = rng.normal(size=(2, operator.shape[1])).astype(np.float32)
        whole, parts = operator @ (2 * one - other), 2 * (operator @ one) - operator @ other
        np.testing.assert_allclose(whole, parts, atol=1e-4 * np.abs(parts).max(), err_msg=name)
