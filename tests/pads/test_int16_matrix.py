"""Products with whole numbers are those of the matrix, but for half a step of each entry."""

import numpy as np

from fringeforce.models.int16_matrix import LARGEST_INTEGER, Packed


def test_both_products_are_those_of_the_matrix_within_half_a_step() -> None:
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(1300, 37)).astype(np.float32) * rng.uniform(0.01, 9, (1300, 1))
    matrix = np.concatenate([matrix, np.zeros((1, 37))]).astype(np.float32)
    packed, step = Packed.of(matrix), np.abs(matrix).max(axis=1) / LARGEST_INTEGER
    right, left = rng.normal(size=37).astype(np.float32), rng.normal(size=1301).astype(np.float32)
    exact = matrix.astype(float)
    off = np.abs(packed.forward(right) - exact @ right)
    rounding = 1e-6 * (np.abs(exact) @ np.abs(right))
    assert (off <= step / 2 * np.abs(right).sum() + rounding).all()
    off = np.abs(packed.adjoint(left) - left @ exact)
    assert (off <= (step / 2 * np.abs(left)).sum() + 1e-6 * (np.abs(left) @ np.abs(exact))).all()
