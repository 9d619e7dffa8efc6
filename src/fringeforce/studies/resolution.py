"""Resolution: how sure forces read from one frame are, tactel by tactel, over many loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from fringeforce.base.arrays import Array
from fringeforce.design.strip import Sensor
from fringeforce.models.strip import SensorModel
from fringeforce.studies.loads import load_maps
from fringeforce.studies.performance import covariances, light_reader
from fringeforce.studies.study_result import StudyResult

COMPONENTS = Sensor.components


@dataclass(frozen=True, eq=False)
class Resolution:
    """Uncertainty of one frame's forces over load maps.

    Attributes
    ----------
    loads : ndarray, shape (k, n, 2)
        The maps [N].
    bound : ndarray, shape (k, n, 2)
        Cramer-Rao bounds, with tolerances of light and camera [N]; infinite where the intensity is
        flat to first order.
    std : ndarray, shape (k, n, 2)
        Standard deviations that also count the curvature where the slope vanishes, as those of
        readings do [N].
    crosstalk : ndarray, shape (2n, 2n)
        Correlation of the forces' errors, root mean square over the maps, ordered like
        `loads[0].ravel()`.
    condition : float
        Condition number of the influence matrix at the pixels.
    """

    loads: Array
    bound: Array
    std: Array
    crosstalk: Array
    condition: float


def resolution(model: SensorModel, loads: Array) -> Resolution:
    """Bounds, standard deviations and crosstalk of a model under loads (k, n, 2) [N]."""
    reader = light_reader(model)
    spreads = covariances(reader, loads)
    std = np.sqrt(np.diagonal(spreads, axis1=1, axis2=2))
    correlation = spreads / (std[:, :, None] * std[:, None, :])
    return Resolution(
        loads=loads,
        bound=np.array([reader.bound(load) for load in loads]),
        std=std.reshape(loads.shape),
        crosstalk=np.sqrt((correlation**2).mean(axis=0)),
        condition=float(np.linalg.cond(model.frame_influence)),
    )


def resolution_study(model: SensorModel, largest: float = 1.0, seed: int = 0) -> StudyResult:
    """Resolution of a model for loads up to a largest normal force on a tactel [N]."""
    n = model.sensor.tactels.count
    found = resolution(model, load_maps(np.random.SeedSequence(seed), n, largest))
    typical, worst = np.median(found.std, axis=0), found.std.max(axis=0)
    bound = np.median(found.bound, axis=0)
    rows = tuple(
        (str(i + 1), *(f"{v[i, c] * 1e3:.3g}" for c in range(2) for v in (bound, typical, worst)))
        for i in range(n)
    )
    header = ("tactel", *(
        f"{name} {what} [mN]"
        for name in COMPONENTS
        for what in ("Cramer-Rao, median", "std, median", "std, worst")
    ))  # fmt: skip
    return StudyResult(
        "resolution", header, rows, _words(found, largest), lambda ax: _draw(ax, found), (8.0, 5.6)
    )


def _words(found: Resolution, largest: float) -> str:
    typical, worst = np.median(found.std, axis=0), found.std.max(axis=0)
    others = found.crosstalk - np.diag(np.diag(found.crosstalk))
    first, second = sorted(int(i) for i in np.unravel_index(np.argmax(others), others.shape))
    where = np.unravel_index(int(np.argmax(found.std)), found.std.shape)
    component = COMPONENTS[int(where[2])]
    return (
        f"Over {len(found.loads)} loads of up to {largest:g} N on a tactel, one frame tells normal "
        f"forces to {typical[:, 0].mean() * 1e3:.3g} mN and tangential ones to "
        f"{typical[:, 1].mean() * 1e3:.3g} mN (standard deviation, median load, mean over "
        f"tactels); the worst is {worst.max() * 1e3:.3g} mN, the {component} force of tactel "
        f"{int(where[1]) + 1}. Errors are most alike between {_name(first)} and "
        f"{_name(second)} (correlation {others.max():.2f}). The influence matrix has a "
        f"condition number of {found.condition:.3g}."
    )


def _name(index: int) -> str:
    return f"the {COMPONENTS[index % 2]} force of tactel {index // 2 + 1}"


def _draw(ax: Axes, found: Resolution) -> None:
    """Standard deviations of every tactel above, crosstalk below, normal forces first."""
    n = found.std.shape[1]
    ax.axis("off")
    above, below = ax.inset_axes((0, 0.6, 0.9, 0.4)), ax.inset_axes((0, 0, 0.9, 0.44))
    tactel = np.arange(1, n + 1)
    for component, name in enumerate(COMPONENTS):
        low, middle, high = np.percentile(found.std[..., component], [0, 50, 100], axis=0) * 1e3
        (line,) = above.plot(tactel, middle, "o-", label=f"{name}: median, least to worst")
        above.fill_between(tactel, low, high, alpha=0.2, color=line.get_color(), linewidth=0)
    above.set(xlabel="tactel", ylabel="standard deviation [mN]", xticks=tactel, ylim=(0, None))
    above.legend(fontsize=8)
    order = np.arange(2 * n).reshape(n, 2).T.ravel()
    image = below.imshow(
        found.crosstalk[np.ix_(order, order)], vmin=0, vmax=1, cmap="magma", aspect="auto"
    )
    middles = [(n - 1) / 2, n + (n - 1) / 2]
    below.set(xticks=middles, yticks=middles)
    below.set_xticklabels(["normal 1 ... n", "tangential 1 ... n"])
    below.set_yticklabels(["normal", "tangential"])
    below.axvline(n - 0.5, color="white", linewidth=0.8)
    below.axhline(n - 0.5, color="white", linewidth=0.8)
    below.grid(visible=False)
    scale = below.inset_axes((1.03, 0, 0.03, 1))
    ax.figure.colorbar(image, cax=scale, label="correlation of errors")
