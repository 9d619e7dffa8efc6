"""From measured frames with known loads to the model of the sensor on the bench.

Maximum likelihood on raw grey levels: design values through the finite elements, the camera's
place and the lighting, all together.  Phases are never recovered, so small loads do no harm.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.base.blas_threads import one_blas_thread
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.calibration import checks
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.design_entries import STRAIN_OPTIC, checked_paths
from fringeforce.calibration.fit import BenchFit, fitted
from fringeforce.calibration.fitted_model import calibrated_strip
from fringeforce.calibration.light.references import References
from fringeforce.calibration.load_log import LoadLog
from fringeforce.calibration.pads.calibrated import calibrated_pad
from fringeforce.calibration.pads.search import PadSearch
from fringeforce.calibration.strip_search import StripSearch
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.models.pad import PadModel
from fringeforce.models.presses import Presses
from fringeforce.models.strip import SensorModel

PARAMETERS = (
    STRAIN_OPTIC,
    "transducer.compliant.youngs_modulus",
    "transducer.compliant.thickness",
)
"""Design values that drawings know worst."""


class Kind(NamedTuple):
    """How one kind of sensor is calibrated: where it is searched, and what is made of the fit."""

    search: type[Any]
    model: Callable[[Any, BenchFit, Array, BenchLoads | TimedLoads], Any]


KINDS = {"strip": Kind(StripSearch, calibrated_strip), "pad": Kind(PadSearch, calibrated_pad)}
"""By the kind of the sensor."""


def usual_parameters(sensor: Sensor | Pad) -> tuple[str, ...]:
    """Design values that a drawing knows worst, the photoelastic effect as it states it."""
    effect = sensor.transducer.photoelastic.effect
    return tuple(path.replace("strain_optic_coefficient", effect) for path in PARAMETERS)


@overload
def calibrate(
    sensor: Sensor,
    frames: ArrayLike,
    forces: ArrayLike | BenchLoads | LoadLog | Presses,
    parameters: Sequence[str] | None = None,
    progress: Progress | None = None,
    references: References | None = None,
    columns: bool = False,
    *,
    times: ArrayLike | None = None,
    aside: int = 5,
    load_cell: tuple[float, float] = (0.0, 0.0),
) -> SensorModel: ...


@overload
def calibrate(
    sensor: Pad,
    frames: ArrayLike,
    forces: ArrayLike | BenchLoads | LoadLog | Presses,
    parameters: Sequence[str] | None = None,
    progress: Progress | None = None,
    references: References | None = None,
    *,
    times: ArrayLike | None = None,
    aside: int = 5,
    load_cell: tuple[float, float] = (0.0, 0.0),
) -> PadModel: ...


def calibrate(
    sensor: Sensor | Pad,
    frames: ArrayLike,
    forces: ArrayLike | BenchLoads | LoadLog | Presses,
    parameters: Sequence[str] | None = None,
    progress: Progress | None = None,
    references: References | None = None,
    columns: bool = False,
    *,
    times: ArrayLike | None = None,
    aside: int = 5,
    load_cell: tuple[float, float] = (0.0, 0.0),
) -> SensorModel | PadModel:
    """Make the model agree with the sensor on the bench.

    Estimated together, as the most probable of all (maximum a posteriori): the chosen design
    values; the camera's shift and scale along the strip; amplitude and offset of the light and the
    retardance without load, as smooth fields; blur and gamma; of several channels the light of each
    and cross-talk that the design gives a tolerance; and of every frame the forces, places
    and widths of its contacts about what is written down, and gain and offset of its light.  Of a
    strip the retardance may be rougher than `residual_length` says, as far as frames make that
    likely, down to the thickness of the cover.  What the design or the list of loads states as a
    tolerance is taken as stated; how far all else scatters, the frames tell.  Where the strain of a
    strip is finite, each frame is solved at its contacts as they are found.  Dead pixels and wrong
    loads are found, left out and named in the result's `calibration`; its `imaging` carries the
    covariance, which readings add to their own.

    Parameters
    ----------
    sensor : Sensor or Pad
        The drawing; its camera's noise is taken as known.  Of a pad light, residual and camera are
        those of its tolerances (one offset of the light), and columns are not corrected.
    frames : array_like, shape (F, n_pixels), or (F, rows, columns) of a pad, channels behind F
        Grey levels; unloaded frames have zero forces and determine the offset.
    forces : array_like, shape (F, n, components), BenchLoads, LoadLog, or sequences of Press
        Known normal and tangential forces of tactels [N]; or contacts at any place, for every
        frame; or a log of them by time, whose constant delay is found.
    parameters : sequence of str, optional
        Dotted paths of the design values to estimate; the photoelastic effect, the cover's modulus
        and its thickness if not given; "tactels.positions" means the place of every
        tactel, expected within 0.2 pitches of the drawing.  Their common shift looks like the
        camera's but for the strip's ends, so little more than that is known of it.  Young's
        moduli of both layers and the strain-optic coefficient matter only as E_1/E_2 and K_s/E_2:
        given all three, the combination that no frame shows is named and the drawing kept along it.
    progress : callable, optional
        Called with a title, the steps done and the steps expected.
    references : References, optional
        Frames that show the light alone.  With them every pixel of a strip has an amplitude and an
        offset of its own; what their noise leaves unknown is added to the noise of readings.  Of a
        pad frames without load are taken alone.
    columns : bool
        Also fit corrections to the columns that no design value explains: smooth along the strip,
        and by no more than the frames themselves make probable, which may be nothing.
    times : array_like, shape (F,), optional
        When the frames were taken [s]; with a log by time.
    aside : int
        Every so many loaded frames one is put aside at first and checked, if there are enough;
        none if zero.
    load_cell : tuple of float
        Standard deviations of the gain of the load cell, relative, and of its zero [N], which are
        the same in all frames, for each component of the force.  The gain is hardly told from the
        strength of the photoelastic effect: it adds to what is uncertain of that.

    Returns
    -------
    SensorModel or PadModel
        With `imaging`, of a pad `known`, and `calibration`.

    Raises
    ------
    InputError
        If frames and forces do not fit the sensor or each other, or a path cannot be calibrated.

    Examples
    --------
    >>> drawing = ff.load_sensor("saad")
    >>> path = "transducer.photoelastic.strain_optic_coefficient"
    >>> made = ff.characterize(drawing.replace(**{path: 0.054}))
    >>> presses = np.random.default_rng(0).uniform(0.1, 1.5, (6, 11, 2)) * [1.0, 0.2]
    >>> model = ff.calibrate(drawing, made.expose(presses, rng=0), presses, [path])
    >>> round(model.sensor.transducer.photoelastic.strain_optic_coefficient, 3)
    0.054
    """
    report = progress or (lambda title, done, expected: None)
    levels, known = checks.checked_bench(sensor, frames, forces, times)
    if columns and (isinstance(known, TimedLoads) or known.tactels is None):
        raise InputError("columns=True corrects the columns of tactels; give loads of tactels.")
    paths = checked_paths(sensor, tuple(parameters or usual_parameters(sensor)))
    lights = (references or References()).checked(sensor)
    if not all(np.isfinite(std) and std >= 0 for std in load_cell):
        raise InputError(
            f"load_cell = {load_cell}: the standard deviations of gain and zero are finite and not "
            "negative."
        )
    checks.check_changes(levels, sensor)
    kind = KINDS[sensor.kind]
    with one_blas_thread():
        search = kind.search(sensor, levels, known, paths, lights, load_cell)
        return kind.model(search, fitted(search, report, aside, columns), levels, known)
