"""Tables of forces that people write."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra.numpy import arrays
from hypothesis.strategies import floats

import fringeforce as ff
from fringeforce.io.tables import load_forces, save_forces


@given(arrays(np.float64, (3, 4, 2), elements=floats(-100, 100)))
def test_forces_come_back_bit_by_bit(tmp_path_factory: pytest.TempPathFactory, forces) -> None:
    path = tmp_path_factory.mktemp("t") / "f.csv"
    save_forces(path, forces)
    np.testing.assert_array_equal(load_forces(path, 4), forces)


def test_polar_columns_and_absent_tactels_are_understood(tmp_path: Path) -> None:
    path = tmp_path / "f.csv"
    path.write_text("frame, tactel, magnitude_N, angle_deg\n0, 2, 2, 30\n2, 1, 1, 0\n")
    forces = load_forces(path, 3)
    assert forces.shape == (3, 3, 2)
    np.testing.assert_allclose(forces[0, 1], [np.sqrt(3), 1.0])
    np.testing.assert_allclose(forces[2, 0], [1, 0])
    assert np.count_nonzero(forces) == 3


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("tactel,normal\n1,2\n", ["normal_N", "magnitude_N"]),
        ("tactel,normal_N,tangential_N\n9,1,0\n", ["line 2", "tactel 9", "1 to 4"]),
        ("tactel,normal_N,tangential_N\n1,one,0\n", ["line 2", "one"]),
        ("tactel,normal_N,tangential_N\n1,nan,0\n", ["line 2", "finite"]),
        ("tactel,normal_N,tangential_N\n1,1,0\n1,2,0\n", ["line 3", "twice"]),
        ("tactel,normal_N,tangential_N\n", ["no loads"]),
        ("", ["(none)"]),
    ],
)
def test_a_wrong_row_is_named_by_its_line(tmp_path: Path, text: str, words: list[str]) -> None:
    path = tmp_path / "f.csv"
    path.write_text(text)
    with pytest.raises(ff.FringeforceError) as caught:
        load_forces(path, 4)
    assert all(word in str(caught.value) for word in words)


def test_a_table_that_fails_half_way_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "f.csv"
    save_forces(path, np.ones((1, 3, 2)))
    old = path.read_bytes()
    with pytest.raises(TypeError, match="iter"):
        save_forces(path, np.ones((2, 3)))
    assert path.read_bytes() == old
    assert list(tmp_path.iterdir()) == [path]


def test_a_table_for_no_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ff.FringeforceError, match="no folder"):
        save_forces(tmp_path / "no" / "f.csv", np.ones((1, 3, 2)))
