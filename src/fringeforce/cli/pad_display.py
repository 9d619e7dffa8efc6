"""What a terminal shows of a pad: a map of the normal forces, and what all forces amount to."""

from __future__ import annotations

import numpy as np
from rich.table import Table
from rich.text import Text

from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.base.arrays import Array
from fringeforce.contacts.resultant import resultant
from fringeforce.design.pad import Pad

SHADES = "··", "░░", "▒▒", "▓▓", "██"
ROUND = 1.2
"""Long over short axis up to which a contact is round, and has no direction worth telling."""
COLUMNS, ROWS = 24, 16
"""Most squares of the map along x and y."""


def pad_picture(pad: Pad, readings: Readings, scale: float) -> Table:
    """The last reading: a map of N, full at `scale` newtons, beside the sum of all forces."""
    forces, std = readings.forces[-1], readings.std[-1]
    table = Table.grid(padding=(0, 4))
    table.add_column(no_wrap=True)
    known = readings.status[-1].trusted
    table.add_row(_map(pad, forces[:, 0], scale), _sums(pad, forces, std, scale, known))
    return table


def pad_skin_picture(pad: Pad, readings: Readings, scale: float) -> Table:
    """The last reading of a skin: the map of N on its squares beside a row for each contact."""
    table = Table.grid(padding=(0, 4))
    table.add_column(no_wrap=True)
    table.add_row(_map(pad, readings.forces[-1][:, 0], scale), _contacts(readings, scale))
    return table


def _map(pad: Pad, normal: Array, scale: float) -> Text:
    """Seen from above, y upwards; where tactels share a square, the largest of them."""
    grid = normal.reshape(pad.tactels.count)
    along, across = (-(-n // most) for n, most in zip(grid.shape, (COLUMNS, ROWS), strict=True))
    wide = np.pad(
        grid, ((0, -grid.shape[0] % along), (0, -grid.shape[1] % across)), constant_values=-np.inf
    )
    squares = wide.reshape(wide.shape[0] // along, along, -1, across).max(axis=(1, 3))
    share = np.nan_to_num(squares / scale, nan=0.0, neginf=0.0)
    levels = np.rint(np.clip(share, 0, 1) * (len(SHADES) - 1)).astype(int)
    rows = ("".join(SHADES[level] for level in column) for column in levels.T[::-1])
    return Text("\n".join(rows), style="cyan")


def _contacts(readings: Readings, scale: float) -> Table:
    """Force, place and axes of all contacts together, then of each."""
    assert readings.resultants is not None
    table = Table.grid(padding=(0, 2))
    for head in ("contact", "N / N", "T / N", "x / mm", "y / mm", "axes / mm", "turned"):
        table.add_column(Text(head, style="dim"), justify="right", no_wrap=True)
    table.show_header = True
    for number, one in enumerate(readings.resultants[-1]):
        std, (x, y) = one.std, 1e3 * one.centre
        normal, along, across = one.force
        axes = [] if one.axes is None or number == 0 else (1e3 * one.axes).tolist()
        turned = one.orientation if number and axes and axes[0] > ROUND * axes[1] else None
        pressed = normal > 0
        table.add_row(
            Text(str(number) if number else "all", style="dim"),
            f"{normal:.3f} ± {std[0]:.3f}",
            f"{along:+.3f}, {across:+.3f}",
            f"{x:+.2f}" if pressed else "",
            f"{y:+.2f}" if pressed else "",
            " x ".join(f"{length:.2f}" for length in axes),
            "" if turned is None else f"{turned:+.0f}°",
        )
    table.add_row()
    table.add_row("map", Text(f"N to {scale:g} N", style="dim"))
    return table


def _sums(pad: Pad, forces: Array, std: Array, scale: float, known: bool) -> Table:
    table = Table.grid(padding=(0, 2))
    table.add_column(style="dim", no_wrap=True)
    table.add_column(no_wrap=True)
    if np.isfinite(forces).all():
        found = resultant(pad.tactels.places, forces, np.arange(pad.tactels.total))
        most = int(forces[:, 0].argmax())
        normal, along, across = found.force
        table.add_row("N", f"{normal:+.3f} N")
        table.add_row("T", f"{along:+.3f} N, {across:+.3f} N")
        x, y = 1e3 * found.centre
        pressed = known and normal > 0
        table.add_row("centre", f"{x:+.2f} mm, {y:+.2f} mm" if pressed else "nowhere")
        table.add_row("moment", f"{1e3 * found.moment[2]:+.2f} mN m")
        table.add_row("most", f"{forces[most, 0]:+.3f} ± {std[most, 0]:.3f} N, tactel {most + 1}")
        table.add_row()
    table.add_row("map", Text(f"N to {scale:g} N, y upwards", style="dim"))
    return table
