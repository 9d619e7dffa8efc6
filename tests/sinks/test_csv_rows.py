"""Compiled text of numbers: letter for letter what Python writes."""

import numpy as np

from fringeforce.acquisition.sinks.csv_rows import rows

WORDS = np.array([b"OK", b"NO_CONTACT"])


def _written(first: int, times: np.ndarray, numbers: np.ndarray, words: np.ndarray) -> bytes:
    text = ""
    for i, line in enumerate(numbers):
        for j, cells in enumerate(line):
            text += f"{first + i},{j + 1},{times[i]:.6f},"
            text += "".join(f"{value:.6g}," for value in cells) + words[i].decode() + "\r\n"
    return text.encode()


def test_numbers_of_any_size_are_written_as_python_writes_them() -> None:
    rng = np.random.default_rng(0)
    numbers = rng.normal(size=(400, 5, 7)) * 10.0 ** rng.uniform(-9, 12, (400, 5, 7))
    times, words = 1.7e9 + rng.random(400), WORDS[rng.integers(0, 2, 400)]
    assert rows(123456, times, numbers, words) == _written(123456, times, numbers, words)


def test_numbers_with_a_text_of_their_own_are_written_as_python_writes_them() -> None:
    special = [0.0, -0.0, np.nan, np.inf, -np.inf, 1.0, -10.0, 100000.0, 1e6, 999999.5, 0.1, 1e-4]
    special += [9.9999e-5, 9.999996e-5, 1e-100, 1.5e200, 123456.5, 0.30000000000000004, 1e15, 2.5]
    numbers, times = np.reshape(special, (2, 5, 2)), np.array([0.0, 1.9999999])
    assert rows(0, times, numbers, WORDS) == _written(0, times, numbers, WORDS)
