"""What `read --plot` draws of a recording: what was read, and nothing of refused frames."""

import numpy as np
import pytest
from matplotlib.quiver import Quiver, QuiverKey

import fringeforce as ff
from fringeforce.plotting.axes import figure, pad_forces
from fringeforce.plotting.readings import _draw_many


def test_refused_frames_leave_gaps_and_applied_forces_lie_within_the_bands(
    model: ff.SensorModel,
) -> None:
    applied = np.multiply.outer([0.5, 0.6, 0.7, 0.8, 0.9], ff.polar(1.0, 10, n=11))
    frames = model.expose(applied, rng=0)
    frames[2] = 255
    readings = list(ff.Reader(model).stream(frames))
    canvas = _draw_many(model.sensor, readings, applied)
    band, normal, tangential = canvas.axes
    colours = np.asarray(band.images[0].get_array())[0]
    assert (colours[2] != colours[1]).any()
    assert (colours[[0, 1, 3, 4]] == colours[0]).all()
    for part, ax in enumerate((normal, tangential)):
        read = [line for line in ax.get_lines() if line.get_linestyle() == "-"
                and len(np.asarray(line.get_xdata())) == 5]  # fmt: skip
        assert len(read) == 11
        for line in read:
            drawn = np.asarray(line.get_ydata(), dtype=float)
            assert np.isfinite(drawn).tolist() == [True, True, False, True, True]
        truth = [np.asarray(line.get_ydata()) for line in ax.get_lines()
                 if line.get_linestyle() == "--"]  # fmt: skip
        assert len(truth) == 6
        for one in truth:
            assert any(np.array_equal(one, applied[:, k, part]) for k in range(11))


@pytest.mark.parametrize(("largest", "told"), [(0.37, "0.2 N"), (0.08, "50 mN"), (0.1, "0.1 N")])
def test_the_arrows_of_a_pad_have_one_of_a_round_force_beside_them(
    largest: float, told: str
) -> None:
    pad = ff.load_sensor("pad")
    forces = np.zeros((pad.tactels.total, 3))
    forces[40] = 1.0, 0.0, -largest
    with figure() as (_, ax):
        pad_forces(ax, pad, forces)
    (arrows,) = [one for one in ax.get_children() if isinstance(one, Quiver)]
    (key,) = [one for one in ax.get_children() if isinstance(one, QuiverKey)]
    assert key.text.get_text() == told
    value, unit = told.split()
    newtons = float(value) * {"N": 1.0, "mN": 1e-3}[unit]
    # both in the units of the map: the longest arrow stands for the largest force
    assert key.U / np.hypot(arrows.U, arrows.V).max() == pytest.approx(newtons / largest)


def test_a_pad_without_shear_has_no_key() -> None:
    pad = ff.load_sensor("pad")
    with figure() as (_, ax):
        pad_forces(ax, pad, np.ones((pad.tactels.total, 3)) * [1.0, 0.0, 0.0])
    assert not [one for one in ax.get_children() if isinstance(one, QuiverKey)]
