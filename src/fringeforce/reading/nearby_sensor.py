"""About which values a reading takes exactly what several of them change together.

What single values of the design, the camera and contacts change in the influence of a strip is a
series in each of them about a centre, and there what they change together is exact.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.ndimage import minimum_filter1d

from fringeforce.base.arrays import Array, Index
from fringeforce.design.strip import Sensor
from fringeforce.estimation.frame_exposure import node_columns, node_phase
from fringeforce.estimation.frame_information import information
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.linearised_frame import Linearised, linearise, pulled_phase
from fringeforce.estimation.posterior import Posterior
from fringeforce.models.node_splines import coefficients, sampled
from fringeforce.models.uncertainty import RATIO, REGISTRATION, Uncertainty

PRODUCTS = 1e-3
"""Products of what values of the design, the camera and contacts change in the influence, over its
peak, from which a reading takes them exactly: of ten radians the noise of a pixel."""
PITCH = "tactels.pitch"
"""Path of the value that moves all contacts."""


def off(uncertain: Uncertainty) -> Array:
    """Modes of the influence matrix for which products are exact, shape (d,)."""
    modes = uncertain.modes[: len(uncertain.frame.influence)]
    return np.array([uncertain.centre.get(mode.name, 0.0) for mode in modes])


def centre_near(
    sensor: Sensor, uncertain: Uncertainty, beside: bool, posterior: Posterior, unknowns: Array
) -> Mapping[str, float] | None:
    """A centre near what was found, as of `Uncertainty.centre`; none where products are small.

    Of what was calibrated the values are nearly known, and large strain has a centre of its own.
    Centres lie on a grid, so that frames of one sensor share them.

    Parameters
    ----------
    sensor : Sensor
        As drawn.
    uncertain : Uncertainty
        About the centre of the reading.
    beside : bool
        Whether contacts may lie beside their tactels, or be wider.
    posterior : Posterior
        Of the frame.
    unknowns : ndarray, shape (size,)
        The best explanation.
    """
    frame = uncertain.frame
    if uncertain.matrix.calibrated or len(frame.curvature) or not len(frame.influence):
        return None
    modes = _likeliest_modes(sensor, uncertain, posterior, unknowns)
    contacts = _contacts_turn(uncertain) if beside else np.zeros(2)
    turns = np.append(np.abs(modes - off(uncertain)) * uncertain.turns, contacts)
    if (turns.sum() ** 2 - np.square(turns).sum()) / 2 < PRODUCTS:
        return None
    others = uncertain.turns.sum() + contacts.sum() - uncertain.turns
    step = np.minimum(2 * PRODUCTS / np.maximum(uncertain.turns * others, PRODUCTS), 1.0)
    return {
        mode.name: float(e)
        for mode, e in zip(uncertain.modes, step * np.rint(modes / step), strict=False)
        if e and mode.name != RATIO
    }


def _likeliest_modes(
    sensor: Sensor, uncertain: Uncertainty, posterior: Posterior, unknowns: Array
) -> Array:
    """The likeliest modes of the influence matrix if contacts lie where they are found, (d,).

    The model has what a shift of the camera changes under contacts as drawn, so that it holds
    modes where it is exact.  This is a step of Gauss and Newton with what it changes under the
    contacts that were found.
    """
    model, at = posterior.model, posterior.model.at
    own = slice(at.modes, at.modes + len(model.influence))
    rows, change = _seen_elsewhere(sensor, uncertain, model, unknowns)
    if not len(rows):
        return unknowns[own]
    about = Linearised(*linearise(model, posterior.prior, posterior.frame, unknowns))
    known = information(model, posterior.frame, unknowns, change)
    turned = np.zeros((at.size, len(known)))  # of the unknowns in what was summed
    turned[np.arange(at.size), np.arange(at.size)] = 1.0
    turned[rows, at.size + np.arange(len(rows))] = 1.0
    hessian = turned @ known @ turned.T + np.diag(posterior.prior.precision) + about.cone
    gradient = about.gradient.copy()
    gradient[rows] += change @ pulled_phase(about)
    return np.asarray((unknowns - np.linalg.solve(hessian, gradient))[own])


def _seen_elsewhere(
    sensor: Sensor, uncertain: Uncertainty, model: FrameModel, unknowns: Array
) -> tuple[Index, Array]:
    """Unknowns of values that move what the camera sees of contacts that are beside tactels.

    Returns
    -------
    rows : ndarray, shape (k,)
        Where they stand.
    change : ndarray, shape (k, m)
        What they change in the phase beyond what the model has, at the nodes [rad].
    """
    at, nodes, columns = model.at, len(model.fixed), node_columns(model, unknowns)
    places = uncertain.places
    rows, change = list[int](), list[Array]()
    for row, mode in enumerate(uncertain.modes[: len(model.influence)], at.modes):
        if at.width == at.place:
            break
        if mode.name in REGISTRATION:
            loaded = unknowns.copy()
            loaded[at.fields : at.modes] = 0.0
            lead = node_phase(model, loaded) - model.fixed
            slope = np.gradient(lead @ sampled(len(places), nodes), places)
            slope *= minimum_filter1d(uncertain.shown, 3)
            whole = coefficients(uncertain.matrix.step(mode.name) * slope, nodes)
        elif mode.name == PITCH:
            moved = sensor.tactels.positions * (mode.std / sensor.tactels.pitch / model.place)
            whole = moved @ columns[at.place : at.width]
        else:
            continue
        rows.append(row)
        change.append(whole - columns[row])
    return np.array(rows, dtype=np.intp), np.array(change).reshape(len(rows), nodes)


def _contacts_turn(uncertain: Uncertainty) -> Array:
    """What uncertain places and widths change in the influence, over its peak, shape (2,)."""
    frame, at = uncertain.frame, uncertain.frame.at
    sizes = np.abs(frame.moments).max(axis=(0, 1, 3))
    place = frame.place / frame.reach * (at.width > at.place)
    width = frame.width * frame.width_std / (6 * frame.reach**2) * (at.fields > at.width)
    return np.array([place, width]) * sizes[1:3] / sizes[0]
