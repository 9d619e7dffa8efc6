"""Figures: each function draws on axes that it is given and changes nothing else."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from fringeforce.design.pad import Pad
from fringeforce.design.strip import Transducer
from fringeforce.mechanics.mesh import Mesh
from fringeforce.optics.colour import light_colour

MILLI, MEGA = 1e3, 1e6
STYLE: Any = {
    "axes.grid": True,
    "axes.prop_cycle": cycler(
        # Okabe and Ito's colours, told apart by colour-blind readers
        color=["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"]
    ),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.constrained_layout.use": True,
    "font.size": 10,
    "grid.color": "#e6e6e6",
    "legend.frameon": False,
    "savefig.dpi": 130,
}


@contextmanager
def figure(width: float = 8.0, height: float = 3.6) -> Iterator[tuple[Figure, Axes]]:
    """A figure with one pair of axes in the package's style; the size is in inches."""
    with mpl.rc_context(STYLE):
        canvas = Figure(figsize=(width, height))
        yield canvas, canvas.add_subplot()


def curves(
    ax: Axes, x: ArrayLike, values: Mapping[str, ArrayLike], ylabel: str, **style: Any
) -> None:
    """Labelled curves over the position along the strip.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    x : array_like, shape (m,)
        Positions [m].
    values : mapping of str to array_like, shape (m,)
        Curves by their label.
    ylabel : str
        Quantity and unit.
    **style
        For every line.
    """
    position = np.asarray(x) * MILLI
    for label, value in values.items():
        ax.plot(position, value, label=label, **style)
    ax.set(xlabel="x [mm]", ylabel=ylabel, xlim=(position[0], position[-1]))
    if len(values) > 1:
        ax.legend()


def mesh(ax: Axes, elements: Mesh, interface: float, tactels: ArrayLike) -> None:
    """The elements of a strip, its layers and its tactels.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    elements : Mesh
        The mesh.
    interface : float
        Height of the interface [m].
    tactels : array_like, shape (n,)
        Where the line loads act [m].
    """
    x, z = elements.x * MILLI, elements.z * MILLI
    ax.axhspan(interface * MILLI, 0, color="#f3e6d8", zorder=0)
    ax.axhspan(z[0], interface * MILLI, color="#e3eef7", zorder=0)
    ax.vlines(x, z[0], z[-1], color="#555555", linewidth=0.4)
    ax.hlines(z, x[0], x[-1], color="#555555", linewidth=0.4)
    ax.plot(np.asarray(tactels) * MILLI, np.full(np.shape(tactels), 0.25), "v", color="#d55e00")
    ax.hlines(z[0] - 0.08, x[0], x[-1], color="black", linewidth=3)
    ax.set(xlabel="x [mm]", ylabel="z [mm]", aspect="equal", xlim=(x[0], x[-1]))
    ax.grid(visible=False)


def strip(ax: Axes, transducer: Transducer, tactels: ArrayLike, forces: ArrayLike) -> None:
    """The layers of a strip and the forces on its skin, as arrows along which they push.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    transducer : Transducer
        The strip.
    tactels : array_like, shape (n,)
        Where the forces act [m].
    forces : array_like, shape (n, 2)
        Normal and tangential forces [N].
    """
    half = transducer.length / 2 * MILLI
    top, bottom = transducer.compliant.thickness * MILLI, transducer.photoelastic.thickness * MILLI
    ax.axhspan(-top, 0, color="#f3e6d8")
    ax.axhspan(-top - bottom, -top, color="#e3eef7")
    ax.axhspan(-top - bottom - 0.4, -top - bottom, color="#777777")
    normal, tangential = np.asarray(forces, dtype=float).T
    longest = max(np.hypot(normal, tangential).max(initial=0.0), 1e-12)
    unit = 2.2 / longest
    arrows = unit * np.array([tangential, -normal])
    place = np.asarray(tactels) * MILLI
    tails = place - arrows[0], -arrows[1]
    drawn = ax.quiver(
        *tails, *arrows, angles="xy", scale_units="xy", scale=1, width=0.0025, color="#d55e00"
    )
    ax.text(-half + 0.2, -top / 2, "compliant", va="center", fontsize=7)
    ax.text(-half + 0.2, -top - bottom / 2, "photoelastic", va="center", fontsize=8)
    ax.set(xlim=(-half, half), ylim=(-top - bottom - 0.4, 2.6), yticks=[], xticks=[])
    arrow_key(ax, drawn, longest, unit, height=0.94)
    ax.grid(visible=False)
    ax.spines[:].set_visible(False)


def forces(ax: Axes, values: ArrayLike, deviations: ArrayLike) -> None:
    """Forces of one frame with bars of two standard deviations, tactel by tactel.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    values, deviations : array_like, shape (n, 2)
        Normal and tangential forces and their standard deviations [N].
    """
    read, spread = np.asarray(values), np.asarray(deviations)
    tactel = np.arange(1, len(read) + 1)
    for shift, name, force, std in zip(
        (-0.12, 0.12), ("normal", "tangential"), read.T, spread.T, strict=True
    ):
        ax.errorbar(tactel + shift, force, 2 * std, fmt="o", capsize=3, label=name)
    ax.axhline(0, color="#888888", linewidth=0.8)
    ax.set(xlabel="tactel", ylabel="force [N]", xticks=tactel)
    ax.legend()


def history(ax: Axes, values: ArrayLike, labels: Sequence[str], ylabel: str) -> None:
    """Forces of many frames over their number, a line for each column.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    values : array_like, shape (k, n)
        Forces [N]; gaps where they are not a number.
    labels : sequence of str, length n
        What the columns are called in the legend, which leaves those out that begin with "_".
    ylabel : str
        Quantity and unit.
    """
    ax.plot(np.asarray(values), label=labels)
    ax.set(xlabel="frame", ylabel=ylabel)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.legend()


def tractions(ax: Axes, places: ArrayLike, values: ArrayLike, deviations: ArrayLike) -> None:
    """Pressure and shear along a skin, with a band of two deviations.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    places : array_like, shape (n,)
        Along the strip [m].
    values, deviations : array_like, shape (n, 2)
        Pressure and shear, and their standard deviations [Pa].
    """
    x = np.asarray(places) * MILLI
    both = np.asarray(values).T / MEGA, np.asarray(deviations).T / MEGA
    for label, value, std in zip(("pressure", "shear"), *both, strict=True):
        (line,) = ax.plot(x, value, label=label)
        ax.fill_between(
            x, value - 2 * std, value + 2 * std, color=line.get_color(), alpha=0.25, linewidth=0
        )
    ax.set(xlabel="x [mm]", ylabel="traction [MPa]", xlim=(x[0], x[-1]))
    ax.legend()


def pressures(ax: Axes, places: ArrayLike, values: ArrayLike) -> None:
    """Pressure along a skin, frame after frame, as a map.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    places : array_like, shape (n,)
        Along the strip [m].
    values : array_like, shape (k, n)
        Pressure [Pa]; not a number where a frame has no reading.
    """
    x, pressure = np.asarray(places) * MILLI, np.asarray(values).T / MEGA
    image = ax.imshow(
        pressure,
        origin="lower",
        aspect="auto",
        cmap="magma_r",
        vmin=0.0,
        extent=(-0.5, pressure.shape[1] - 0.5, x[0], x[-1]),
        interpolation="nearest",
    )
    ax.grid(visible=False)
    ax.set(xlabel="frame", ylabel="x [mm]")
    bar = ax.figure.colorbar(image, ax=ax, label="pressure [MPa]")
    bar.outline.set_visible(False)


def pad_forces(ax: Axes, pad: Pad, values: ArrayLike) -> None:
    """Forces on a pad, seen from above: normal ones as colours, tangential ones as arrows.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    pad : Pad
        The design.
    values : array_like, shape (n, 3)
        N, T_x, T_y [N].
    """
    forces, (x, y) = np.asarray(values, dtype=float), MILLI * pad.tactels.places.T
    edge = MILLI * (pad.tactels.pitch / 2)
    limit = max(np.abs(forces[:, 0]).max(initial=0.0), 1e-12)
    extent = (x.min() - edge, x.max() + edge, y.min() - edge, y.max() + edge)
    image = ax.imshow(
        forces[:, 0].reshape(pad.tactels.count).T,
        origin="lower", extent=extent, cmap="PuOr_r", vmin=-limit, vmax=limit,
    )  # fmt: skip
    longest = np.hypot(*forces[:, 1:].T).max(initial=0.0)
    unit = 2 * MILLI * pad.tactels.pitch / max(longest, 1e-12)
    arrows = ax.quiver(
        x, y, *(unit * forces[:, 1:].T), angles="xy", scale_units="xy", scale=1, width=0.004
    )
    sides = MILLI / 2 * np.array([pad.transducer.length, pad.transducer.width])
    ax.set(xlabel="x [mm]", ylabel="y [mm]", xlim=(-sides[0], sides[0]), ylim=(-sides[1], sides[1]))
    ax.grid(visible=False)
    arrow_key(ax, arrows, longest, unit, height=1.03)
    ax.figure.colorbar(image, ax=ax, label="normal force [N]")


def arrow_key(ax: Axes, arrows: Quiver, longest: float, unit: float, height: float) -> None:
    """How long an arrow of a round force is, at the right end of the axes.

    Parameters
    ----------
    ax : Axes
        Where the arrows are.
    arrows : Quiver
        What drew them.
    longest : float
        The largest force; no key if there is none [N].
    unit : float
        Length of an arrow of one newton, in what x is in.
    height : float
        Where it is, as a share of the axes' height.
    """
    if not longest > 0:
        return
    ten = 10.0 ** math.floor(math.log10(longest))
    force = next(ten * step for step in (5, 2, 1) if ten * step <= longest * (1 + 1e-9))
    words = f"{force:g} N" if force >= 0.1 else f"{1e3 * force:g} mN"
    length = unit * force / float(np.ptp(ax.get_xlim()))
    ax.quiverkey(
        arrows, 1 - length, height, unit * force, words, labelpos="W", labelsep=0.05,
        fontproperties={"size": 8},
    )  # fmt: skip


def residuals(ax: Axes, left: ArrayLike, frames: Sequence[int], pixels: Sequence[int]) -> None:
    """What a model leaves of frames with known loads, a row for each; what was left out is marked.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    left : array_like, shape (F, P)
        Residuals in units of the noise.
    frames, pixels : sequence of int
        Frames and pixels that a calibration left out.
    """
    image = ax.imshow(left, aspect="auto", cmap="RdBu_r", vmin=-4, vmax=4, interpolation="nearest")
    count, width = np.shape(left)
    # marks stand just outside the picture, so that they hide nothing
    ax.plot(np.full(len(frames), -0.01 * width), frames, ">", color="black", clip_on=False)
    ax.plot(pixels, np.full(len(pixels), -0.02 * count - 0.5), "v", color="black", clip_on=False)
    ax.set(xlabel="pixel", ylabel="frame", xlim=(-0.5, width - 0.5), ylim=(count - 0.5, -0.5))
    ax.grid(visible=False)
    ax.figure.colorbar(image, ax=ax, label="residual / noise")


def fringes(ax: Axes, x: ArrayLike, intensity: ArrayLike, width: float, wavelength: float) -> None:
    """The strip as an eye behind the polariscope sees it, in the colour of the light.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    x : array_like, shape (m,)
        Positions [m].
    intensity : array_like, shape (m,)
        Normalised intensity.
    width : float
        Width of the strip [m].
    wavelength : float
        Wavelength of the light [m].
    """
    position = np.asarray(x) * MILLI
    light = np.asarray(intensity)[None, :, None] * light_colour(wavelength)
    half = width * MILLI / 2
    extent = (position[0], position[-1], -half, half)
    # screens are not linear: the exponent turns light into the signal that shows it
    ax.imshow(light ** (1 / 2.2), extent=extent, aspect="auto", interpolation="bilinear")
    ax.set(xlabel="x [mm]", ylabel="y [mm]")
    ax.grid(visible=False)


def convergence(
    ax: Axes, unknowns: Sequence[ArrayLike], errors: Sequence[ArrayLike], labels: Sequence[str]
) -> None:
    """Errors over the number of unknowns, both logarithmic, a line for each family of meshes."""
    for n, error, label in zip(unknowns, errors, labels, strict=True):
        ax.loglog(n, error, "o-", label=label)
    ax.set(xlabel="unknowns", ylabel="relative error of the influence matrix")
    ax.legend()
