"""Creep: what readings owe to earlier loads, with and without what the design says of it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.design.strip import Sensor
from fringeforce.models.creep import creeps, without_creep
from fringeforce.models.strip import characterize
from fringeforce.reading.reader import Reader
from fringeforce.reading.reading import Status
from fringeforce.studies.study_result import StudyResult

HELD, RESTED = 60.0, 60.0
"""How long the load lasts, and how long nothing acts behind it [s]."""
BEGINS, RISES = 2.0, 0.5
"""When the load begins to rise, and for how long it does [s]."""
RATE = 5.0
"""Frames per second [1/s]."""
SHOWN = (5.0, 20.0, 60.0, 64.0, 70.0, 90.0, 120.0)
"""When the table looks [s]."""
SPREAD = 1.5
"""Standard deviation of the touch over the tactels, in pitches."""
WAYS = ("without", "with")


def creep_study(
    sensor: Sensor, load: float = 1.0, seed: int = 0, progress: Progress | None = None
) -> StudyResult:
    """Press, hold for a minute and release; read with and without the design's relaxation.

    Parameters
    ----------
    sensor : Sensor
        The design, which states a `relaxation` of both layers or of one, or an `optical_creep`;
        where their shares have tolerances, the sensor that is pressed is drawn from them.
    load : float
        Largest normal force on a tactel [N].
    seed : int
        Of the sensor and of noise.
    progress : callable, optional
        Told words, the readings done and their number.

    Raises
    ------
    InputError
        If the light of the design does not creep, or it has a skin.
    """
    if not creeps(sensor.transducer) or sensor.skin is not None:
        raise InputError(
            "This study takes tactels and light that creeps; give a design with relaxation = "
            '[["6 %", "0.4 s"], ["4 %", "15 s"]] under [transducer] or the table of one of its '
            "layers, or optical_creep of the clear one. By the stress-optic law light creeps with "
            "layers that relax unlike, and with optical_creep."
        )
    report = progress or (lambda title, done, total: None)
    times, forces = _touch(sensor, load)
    model = characterize(sensor)
    frames = model.expose(forces, rng=seed, as_built=seed, times=times)
    report("reading without", 0, 2)
    found = [Reader(characterize(without_creep(sensor))).read_batch(frames)]
    report("reading with", 1, 2)
    found.append(Reader(model).read_batch(frames, times=times))
    report("done", 2, 2)
    true = forces[..., 0].sum(axis=1)
    totals = [np.where(_told(one.status), one.forces[..., 0].sum(axis=1), np.nan) for one in found]
    header = "time [s]", "normal force [N]", *(f"read {way} [N]" for way in WAYS)
    rows = tuple(
        (f"{at:g}", f"{true[k]:.3f}", *(_number(total[k]) for total in totals))
        for at, k in ((at, int(np.argmin(np.abs(times - at)))) for at in SHOWN)
    )
    return StudyResult(
        "creep",
        header,
        rows,
        _words(times, true, totals),
        lambda ax: _draw(ax, times, true, totals),
        (9.0, 4.6),
    )


def _touch(sensor: Sensor, load: float) -> tuple[Array, Array]:
    """Times, shape (F,) [s], and forces, shape (F, n, 2) [N]."""
    end = BEGINS + RISES + HELD
    times = np.arange(0.0, end + RISES + RESTED, 1 / RATE)
    corners = [0.0, BEGINS, BEGINS + RISES, end, end + RISES]
    course = np.interp(times, corners, [0.0, 0.0, load, load, 0.0])
    count = sensor.tactels.count
    shape = np.exp(-np.square((np.arange(count) - (count - 1) / 2) / SPREAD) / 2)
    forces = np.zeros((len(times), count, 2))
    forces[..., 0] = course[:, None] * shape
    return times, forces


def _told(statuses: Iterable[Status]) -> Mask:
    """Which readings stand."""
    return np.isin([one.name for one in statuses], ["OK", "NO_CONTACT"])


def _number(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "refused"


def _words(times: Array, true: Array, totals: list[Array]) -> str:
    end = BEGINS + RISES + HELD
    parts = (times > BEGINS + RISES) & (times < end), times > end + RISES
    said = []
    for way, total in zip(WAYS, totals, strict=True):
        held, left = (np.abs(total - true)[part] for part in parts)
        most = true.max()
        said.append(
            f"{way} it, readings are off by up to {_most(held):.3f} N of {most:.2f} N while the "
            f"load lasts and by up to {_most(left):.3f} N after it is gone"
        )
    refused = [int(np.isnan(total).sum()) for total in totals]
    return (
        f"A touch is held for {HELD:g} s and released. Read with what the design says of creep and "
        f"without: {'; '.join(reversed(said))}. Of {len(times)} frames {refused[1]} and "
        f"{refused[0]} were refused."
    )


def _most(errors: Array) -> float:
    return float(np.nanmax(errors)) if np.isfinite(errors).any() else float("nan")


def _draw(ax: Axes, times: Array, true: Array, totals: list[Array]) -> None:
    ax.axis("off")
    above, below = ax.inset_axes((0, 0.55, 1, 0.45)), ax.inset_axes((0, 0, 1, 0.45))
    above.plot(times, true, color="0.3", label="applied")
    for way, total in zip(WAYS, totals, strict=True):
        above.plot(times, total, label=f"read {way} creep")
        below.plot(times, 1e3 * (total - true), label=f"{way} creep")
    above.set(ylabel="normal force [N]", xticklabels=[])
    above.legend(fontsize=8)
    below.axhline(0, color="0.6", linewidth=0.8)
    below.set(xlabel="time [s]", ylabel="error [mN]")
