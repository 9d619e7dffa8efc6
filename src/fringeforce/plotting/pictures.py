"""What was found in a picture, drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fringeforce.base.storage import writing
from fringeforce.pictures.sampling import Sampler
from fringeforce.plotting.axes import STYLE

COLOURS = {"R": "tab:red", "G": "tab:green", "B": "tab:blue"}


def draw_region(sampler: Sampler, picture: NDArray[Any], path: Path) -> None:
    """Write a picture with the strip's corners and band, and the line that was taken from it.

    Parameters
    ----------
    sampler : Sampler
        Of the strip.
    picture : ndarray, shape (rows, columns) or (rows, columns, 3)
        To draw.
    path : path
        PNG to write.
    """
    region, top = sampler.region, 2**sampler.region.bits - 1
    lines = np.atleast_2d(sampler.line(picture))
    share = np.clip(picture / top, 0, 1)
    clipped = picture >= top if picture.ndim == 2 else (picture >= top).any(axis=2)
    drawn = np.repeat(share[..., None], 3, axis=2) if share.ndim == 2 else share.copy()
    drawn[clipped] = (1, 0, 1)
    with mpl.rc_context(STYLE), writing(path):
        canvas = Figure(figsize=(8, 5), layout="constrained")
        above, below = canvas.subplots(2, 1)
        above.imshow(drawn, interpolation="nearest" if picture.shape[1] < 800 else "antialiased")
        above.plot(*region.outline().T, color="yellow", lw=0.8, label="strip")
        above.plot(*region.outline(region.margin).T, color="cyan", lw=0.8, label="averaged")
        start = np.array(region.corners)[[0, 3]].mean(axis=0)
        above.annotate(
            "x", region.points([0.12, 0.5]), start, color="yellow", va="center",
            arrowprops={"arrowstyle": "->", "color": "yellow"},
        )  # fmt: skip
        above.set_title(
            f"{region.length:.0f} x {region.width:.0f} pixels, tilt {region.tilt:.2f} degrees; "
            f"{100 * clipped.mean():.2g} % saturated",
            fontsize="small",
        )
        above.grid(visible=False)
        above.legend(loc="upper right", fontsize="small", labelcolor="white")
        place = (np.arange(sampler.pixels) + 0.5) / sampler.pixels
        for name, line in zip(sampler.channels, lines, strict=True):
            below.plot(place, line, lw=0.8, color=COLOURS.get(name), label=name)
            full = line >= top
            below.plot(place[full], line[full], ".", ms=3, color="magenta")
        below.axhline(top, color="grey", lw=0.5, ls="--")
        below.set(xlabel="share of the strip's length", ylabel="grey level", xlim=(0, 1))
        if len(lines) > 1:
            below.legend(fontsize="small")
        canvas.savefig(path, dpi=120)
