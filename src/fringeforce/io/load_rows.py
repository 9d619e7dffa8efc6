"""What the rows of a table of loads say: forces, frames, tactels and contacts."""

from __future__ import annotations

import numpy as np

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.base.errors import FileFormatError
from fringeforce.io.load_columns import Columns

LARGEST = 10_000_000
"""Largest number of a frame or a contact; frames of more are no bench's, and fit no memory."""

STRONGEST = 1e6
"""Largest force [N]; more is another unit, or no number of newtons at all."""


def forces_of(table: Columns, components: tuple[str, ...]) -> Array:
    """Forces of every row, shape (rows, components) [N].

    Raises
    ------
    FileFormatError
        If a column is missing or a cell is empty.
    """
    name, pad = table.name, len(components) == 3
    if "magnitude" in table.values and not pad:
        size, angle = table.get("magnitude"), table.get("angle")
        found = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=1)
        needed = {"magnitude": size, "angle": angle}
    else:
        along = "tangential" if "tangential" in table.values and not pad else "tangential_x"
        columns = ("normal", along, "tangential_y")[: len(components)]
        needed = {column: table.get(column) for column in columns if column in table.values}
        found = np.stack([needed.get(c, np.zeros(len(table.lines))) for c in columns], axis=1)
    enough = "normal" in needed or {"magnitude", "angle"} <= set(table.values)
    if not enough or (pad and "tangential" in table.values):
        either = "" if pad else ", or magnitude_N and angle_deg"
        wanted = " and ".join(f"{one}_N" for one in components)
        raise FileFormatError(
            f"{name} has the columns {', '.join(table.header) or '(none)'}; loads need {wanted}"
            f"{either}, with tactel or x_mm for where."
        )
    if {"tangential", "tangential_x"} <= set(table.values):
        both = f"{table.written['tangential']} and {table.written['tangential_x']}"
        raise FileFormatError(f"{name}: the columns {both} say the same; leave one out.")
    if not pad and np.nan_to_num(table.get("tangential_y")).any():
        raise FileFormatError(
            f"{name}: the column {table.written['tangential_y']} is not zero; a strip has forces "
            "along x alone. Leave it out, or turn the axes."
        )
    for meaning, values in needed.items():
        if meaning != "angle" and (np.abs(values) > STRONGEST).any():
            row = int((np.abs(values) > STRONGEST).argmax())
            raise FileFormatError(
                f"{table.where(row)}: {table.written[meaning]} is {values[row]:g} N; no sensor "
                f"stands more than {STRONGEST:g} N. The name of the column tells the unit."
            )
        if np.isnan(values).any():
            row = int(np.isnan(values).argmax())
            raise FileFormatError(
                f"{table.where(row)}: {table.written[meaning]} is empty; forces must be finite "
                "numbers, and zero where there is none."
            )
    return found


def frame_numbers(table: Columns, frames: int | None = None) -> Index:
    """Frame of every row, counted from 0; all rows are one frame without a column of them."""
    number = table.values.get("frame", np.zeros(len(table.lines)))
    whole = np.isfinite(number) & (number >= 0) & (number == np.round(number))
    last = LARGEST if frames is None else frames - 1
    whole &= number <= last
    if not whole.all():
        row = int(whole.argmin())
        raise FileFormatError(
            f"{table.where(row)}: frame {number[row]:g}; frames are whole numbers from 0 to {last}."
        )
    return number.astype(np.intp)


def tactel_numbers(table: Columns, count: int, given: Mask | None = None) -> Index:
    """Tactel of every row, counted from 0.

    Raises
    ------
    FileFormatError
        If there is none of a number, or a frame names one twice.
    """
    number = table.get("tactel")
    asked = np.ones(len(number), bool) if given is None else given
    wrong = asked & ~((number >= 1) & (number <= count) & (number == np.round(number)))
    if wrong.any():
        row = int(wrong.argmax())
        raise FileFormatError(
            f"{table.where(row)}: tactel {number[row]:g}; this sensor's tactels are whole numbers "
            f"from 1 to {count}."
        )
    when = np.nan_to_num(table.get("frame", "time", "date"))
    seen: set[tuple[float, float]] = set()
    for row in np.flatnonzero(asked).tolist():
        pair = float(when[row]), float(number[row])
        if pair in seen:
            raise FileFormatError(
                f"{table.where(row)}: tactel {pair[1]:g} of frame {pair[0]:g} is given twice."
            )
        seen.add(pair)
    return np.where(asked, np.nan_to_num(number) - 1, -1).astype(np.intp)


def force_stds(table: Columns, components: tuple[str, ...]) -> Array:
    """Standard deviations of the forces of every row, shape (rows, components) [N]."""
    names = (
        ("normal_std", "force_std"),
        ("tangential_x_std", "tangential_std", "force_std"),
        ("tangential_y_std", "tangential_std", "force_std"),
    )
    return np.stack([table.get(*some) for some in names[: len(components)]], axis=1)


def contact_numbers(table: Columns) -> Index:
    """Contact of every row, counted from 0; -1 is the sum of all, as `fringeforce read` writes."""
    number = table.values.get("contact")
    if number is None:
        return np.zeros(len(table.lines), np.intp)
    wrong = ~((number >= 0) & (number <= LARGEST) & (number == np.round(number)))
    if wrong.any():
        row = int(wrong.argmax())
        raise FileFormatError(
            f"{table.where(row)}: contact {number[row]:g}; contacts are whole numbers from 1."
        )
    return number.astype(np.intp) - 1
