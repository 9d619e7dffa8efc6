"""The climb to a top of the posterior through the phase, in compiled loops.

What is hard about the loss is that a force and its contact's place and width are multiplied; what
is costly is the frame.  So the frame is taken as quadratic in the phase and in what else is linear
(fields, light, camera) about a point, and all unknowns are fitted to that, contacts as bent as they
are, in coordinates of the phase that contacts can make.  A few such rounds reach a top: the
Gauss-Newton method for a function of functions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import apart, copied, sums, sums_entry
from fringeforce.estimation.frame_climb import factorised, substituted
from fringeforce.estimation.frame_exposure import (
    bend,
    bend_columns,
    contact_mixtures,
    contact_moments,
    dot,
    fill_exposure,
    fill_node_phase,
    workspace,
)
from fringeforce.estimation.frame_information import fill_products
from fringeforce.estimation.frame_loss import (
    Prior,
    add_cone,
    frame_loss,
    prior_loss,
    weighed_squares,
)
from fringeforce.estimation.frame_model import (
    LEAST_PROFILE,
    FrameModel,
    Layout,
    contacts_scatter,
)
from fringeforce.estimation.linearised_frame import empty_linearised, fill_linearised

Array = NDArray[np.float64]

LIKELY_STDS = 2.5
"""Standard deviations within which places and widths are likely."""
LEAST_GROWTH = 0.03
"""Growth of the loss by all that loads of their size before the frame can change a coordinate of
the phase, below which it is left out."""
FALL = 10.0
"""How many times the fall that an unheated round promises a climb may fall in all: of 210 climbs
after heated rounds two fell by more than four times, and long bends are climbed in small steps."""
GUARDED = 5
"""Rounds in which the phase is held back until the loss falls."""


def contact_coordinates(model: FrameModel) -> tuple[Array, FrameModel]:
    """Orthogonal profiles of the phase that contacts make, and the model with these as its nodes.

    Returns
    -------
    basis : ndarray, shape (r, m)
        Profiles.
    contacts : FrameModel
        Whose `node_phase` is the coordinates of the contacts' phase in them, shape (r,).
    """
    nodes = len(model.fixed)
    scaled = (model.profiles * _sizes(model)[:, None]).reshape(-1, nodes)
    turned = _likely_turns(model).reshape(-1, nodes)
    rows = [scaled, turned, model.curvature.reshape(-1, nodes)]
    _, size, rows = np.linalg.svd(np.concatenate(rows), full_matrices=False)
    kept = size > LEAST_PROFILE * size[0]
    rows, size = rows[kept], size[kept, None]
    basis, back = np.ascontiguousarray(rows * size), (rows / size).T
    contacts = model._replace(
        profiles=np.ascontiguousarray(model.profiles @ back),
        influence=np.ascontiguousarray(model.influence @ back),
        curvature=np.ascontiguousarray(model.curvature @ back),
        fixed=np.zeros(len(basis)),
        fields=np.empty((0, len(basis))),
    )
    return basis, contacts


def _likely_turns(model: FrameModel) -> Array:
    """Changes of the influence with every mode, root mean square for likely ones, (d, s, n, 2, m).

    Powers of an unknown that cancel each other count as what they leave.
    """
    steps, powers = (
        np.linspace(-LIKELY_STDS, LIKELY_STDS, 9),
        1 + np.arange(model.influence.shape[1]),
    )
    return np.einsum(
        "sq,dqncm->dsncm", steps[:, None] ** powers / np.sqrt(len(steps)), model.influence
    )


def _sizes(model: FrameModel) -> Array:
    """Root mean squares of the mixtures of moments of contacts that are as likely, shape (k,)."""
    at, steps = model.at, np.linspace(-LIKELY_STDS, LIKELY_STDS, 9)
    alone = model._replace(
        place=contacts_scatter(model.place, model.moving),
        moving=model.moving[:0],
        origin=model.origin[:0],
        drawn=model.drawn[:0],
        scaling=model.scaling[:0],
        at=at._replace(place=0, width=1, fields=1 + (at.fields > at.width)),
    )
    moments = np.empty((1, 4, len(model.mixing)))
    square = list[Array]()
    for place in steps if at.width > at.place or len(model.moving) else [0.0]:
        for width in steps if at.fields > at.width else [0.0]:
            contact_mixtures(alone, np.array([place, width]), moments)
            square.append(moments[0, 0] ** 2)
    return np.sqrt(np.mean(square, axis=0))


def by_coordinates(model: FrameModel, basis: Array) -> FrameModel:
    """The model with coordinates of the contacts' phase in the place of contacts, as its fields."""
    at, nodes = model.at, len(model.fixed)
    own = len(basis) - at.fields
    ends = (begin + own for begin in at[4:])
    return model._replace(
        moments=np.empty((0, *model.moments.shape[1:])),
        profiles=np.empty((0, *model.profiles.shape[1:])),
        influence=np.empty((0, 1, 0, 2, nodes)),
        moving=np.empty((0, 0)),
        origin=np.empty(0),
        drawn=np.empty(0),
        scaling=np.empty(0),
        curvature=np.empty((0, 0, nodes)),
        fields=np.concatenate([basis, model.fields]),
        at=Layout(0, 0, 0, 0, *ends),
    )


@apart
def _state(contacts, unknowns, state):
    """Coordinates of the contacts' phase, and the unknowns that are linear, into `state`."""
    begin, rank = contacts.at.fields, len(contacts.fixed)
    fill_node_phase(contacts, unknowns, state[:rank])
    for k in range(rank, len(state)):
        state[k] = unknowns[begin + k - rank]


@apart
def _turned(rows, wave, order, out):
    """Rows in the coordinates that a root by pivots makes, four terms at a time.

    A coordinate counts up to the row of the root whose pivot it is.
    """
    count, rank = wave.shape
    turn = np.empty((rank, count))
    for i in range(rank):
        for k in range(count):
            turn[i, k] = wave[k, order[i]]
    for x in range(len(rows)):
        own, row = out[x], rows[x]
        own[:] = 0.0
        i = 0
        while i + 3 < rank:
            a, b, c, d = row[order[i]], row[order[i + 1]], row[order[i + 2]], row[order[i + 3]]
            p, q, r, s = turn[i], turn[i + 1], turn[i + 2], turn[i + 3]
            for k in range(min(i + 4, count)):
                own[k] += (a * p[k] + b * q[k]) + (c * r[k] + d * s[k])
            i += 4
        for k in range(i, rank):
            a, p = row[order[k]], turn[k]
            for z in range(count):
                own[z] += a * p[z]


@apart
def _rooted(square, least, root, order):
    """Root of a positive semidefinite matrix by its largest pivots, in this order, then the others.

    Returns
    -------
    int
        Number of rows of the root that are filled in: pivots above `least`.
    """
    size, rank = len(square), 0
    left = np.empty(size)
    for i in range(size):
        left[i] = square[i, i]
    for k in range(size):
        top = np.argmax(left)
        if not left[top] > least:
            break
        order[k] = top
        pivot, own = np.sqrt(left[top]), root[k]
        row = square[top]
        for i in range(size):
            own[i] = row[i]
        for z in range(k):
            factor, other = root[z, top], root[z]
            for i in range(size):
                own[i] -= factor * other[i]
        for i in range(size):
            own[i] /= pivot
        for z in range(k):
            own[order[z]] = 0.0
        for i in range(size):
            left[i] -= own[i] * own[i]
        left[top] = -1.0
        for z in range(k):
            left[order[z]] = -1.0
        rank = k + 1
    last = rank
    for i in range(size):
        if left[i] != -1.0:
            order[last] = i
            last += 1
    return rank


@apart
def _shown(model, reduced, unknowns, columns, point):
    """Coordinates of the contacts' phase, and their change with every unknown.

    Rows of `columns` are those of the loads, places and widths, and of the modes of the influence;
    without rows the change is left out.
    """
    profiles, turned, bent = reduced.profiles, reduced.turning, len(columns) > 0
    order, at, rank = profiles.shape[2], model.at, len(point)
    moments = np.empty((len(profiles), 4, order))
    contact_moments(model, unknowns, moments)
    point[:] = 0.0
    if bent:
        columns[:] = 0.0
    one, beside, wide = np.empty(rank), np.empty(rank), np.empty(rank)
    moving, beyond = len(model.moving), np.zeros(rank)
    scaling = len(model.scaling) if bent else 0
    for j in range(len(profiles)):
        for c in range(2):
            force = unknowns[2 * j + c]
            one[:] = 0.0
            if bent:
                beside[:] = 0.0
                wide[:] = 0.0
            for k in range(0, order, 2):
                z = min(k + 1, order - 1)
                row, next_row = profiles[j, c, k], profiles[j, c, z]
                last = 1.0 if k + 1 < order else 0.0
                a, b = moments[j, 0, k], last * moments[j, 0, z]
                if not bent:
                    for i in range(rank):
                        one[i] += a * row[i] + b * next_row[i]
                    continue
                p, q = moments[j, 1, k], last * moments[j, 1, z]
                r, s = moments[j, 2, k], last * moments[j, 2, z]
                for i in range(rank):
                    x, y = row[i], next_row[i]
                    one[i] += a * x + b * y
                    beside[i] += p * x + q * y
                    wide[i] += r * x + s * y
            for k in range(order if scaling > 0 else 0):
                factor, row = force * moments[j, 3, k], profiles[j, c, k]
                for i in range(rank):
                    beyond[i] += factor * row[i]
            if bent and at.width > at.place:
                own = columns[at.place + j]
                for i in range(rank):
                    own[i] += model.place * force * beside[i]
            for d in range(moving if bent else 0):
                own, factor = columns[at.fields + d], model.moving[d, j] * force
                for i in range(rank):
                    own[i] += factor * beside[i]
            if bent and at.fields > at.width:
                own = columns[at.width + j]
                for i in range(rank):
                    own[i] += force * wide[i]
            for d in range(len(turned)):
                e, power = unknowns[at.modes + d], 1.0
                for q in range(turned.shape[1]):
                    row, slope = turned[d, q, j, c], force * (q + 1) * power
                    power *= e
                    for i in range(rank):
                        one[i] += power * row[i]
                    if bent:
                        own = columns[at.fields + d]
                        for i in range(rank):
                            own[i] += slope * row[i]
            for i in range(rank):
                point[i] += force * one[i]
            if bent:
                copied(one, columns[2 * j + c])
    for d in range(scaling):
        own, factor = columns[at.fields + d], model.scaling[d]
        for i in range(rank):
            own[i] += factor * beyond[i]
    bend(reduced.curvature, unknowns, point)
    if bent:
        bend_columns(reduced.curvature, unknowns, columns)


class Reduced(NamedTuple):
    """A frame that is quadratic in the state, with what is linear eliminated.

    Attributes
    ----------
    root : ndarray, shape (l, l)
        Root of the information about what is linear, prior included.
    cross : ndarray, shape (l, r)
        What that shares with the coordinates of the contacts' phase, over the root.
    wave : ndarray, shape (k, r)
        Root of what is left of the information about the coordinates: it turns and scales them so
        that the frame tells each as well.
    order : ndarray of int, shape (k,)
        The coordinate that is the pivot of each of its rows.
    profiles, turning : ndarray, shapes (n, 2, K, k) and (d, Q, n, 2, k)
        Influence of the contacts and its modes in the turned coordinates.
    curvature : ndarray, shape (2n, 2n, k)
        Second order of the contacts' phase in these.
    """

    root: Array
    cross: Array
    wave: Array
    order: NDArray[np.intp]
    profiles: Array
    turning: Array
    curvature: Array


@sums
def _is_linear(contacts, x):
    """Whether a part of the state behind the coordinates is linear: modes of the influence not."""
    begin = contacts.at.modes - contacts.at.fields
    return not begin <= x < begin + len(contacts.influence)


@apart
def _reduced(contacts, prior, known):
    """Eliminate what is linear from the information about a state."""
    at, rank = contacts.at, len(contacts.fixed)
    linear = at.size - at.fields
    own, root = np.zeros((linear, linear)), np.empty((linear, linear))
    for x in range(linear):
        for z in range(linear):
            if _is_linear(contacts, x) and _is_linear(contacts, z):
                own[x, z] = known[rank + x, rank + z]
        own[x, x] += prior.precision[at.fields + x] if _is_linear(contacts, x) else 1.0
    factorised(own, np.zeros((linear, linear)), 0.0, root)
    cross = np.zeros((linear, rank))
    for x in range(linear):
        row = cross[x]
        if _is_linear(contacts, x):
            copied(known[rank + x, :rank], row)
        for z in range(x):
            factor, other = root[z, x], cross[z]
            for i in range(rank):
                row[i] -= factor * other[i]
        for i in range(rank):
            row[i] /= root[x, x]
    square = known[:rank, :rank].copy()
    for x in range(linear):
        row = cross[x]
        for i in range(rank):
            factor, line = row[i], square[i]
            for k in range(rank):
                line[k] -= factor * row[k]
    wave, order = np.empty((rank, rank)), np.empty(rank, np.int64)
    least = LEAST_GROWTH * np.min(prior.precision[: at.loads])
    count = _rooted(square, least, wave, order)
    shape = contacts.profiles.shape
    profiles = np.empty((shape[0] * shape[1] * shape[2], count))
    _turned(contacts.profiles.reshape(len(profiles), rank), wave[:count], order, profiles)
    ways = contacts.influence.shape
    turned = np.empty((ways[0] * ways[1] * ways[2] * ways[3], count))
    _turned(contacts.influence.reshape(len(turned), rank), wave[:count], order, turned)
    loads = len(contacts.curvature)
    curved = np.empty((loads, loads, count))
    for a in range(loads):
        _turned(contacts.curvature[a, : a + 1], wave[:count], order, curved[a, : a + 1])
        for b in range(a):
            curved[b, a] = curved[a, b]
    return Reduced(
        root,
        cross,
        wave[:count],
        order[:count],
        profiles.reshape(shape[0], shape[1], shape[2], count),
        turned.reshape(ways[0], ways[1], ways[2], ways[3], count),
        curved,
    )


@apart
def _told(contacts, prior, reduced, slope, start, pulled, told):
    """What a slope of the loss by the state pulls at what is linear, and at the coordinates."""
    at, rank, root, cross = contacts.at, len(contacts.fixed), reduced.root, reduced.cross
    pull = slope[:rank].copy()
    for x in range(len(pulled)):
        if _is_linear(contacts, x):
            miss = start[at.fields + x] - prior.mean[at.fields + x]
            pulled[x] = slope[rank + x] + prior.precision[at.fields + x] * miss
        else:
            pulled[x] = 0.0
        for z in range(x):
            pulled[x] -= root[z, x] * pulled[z]
        pulled[x] /= root[x, x]
        row = cross[x]
        for i in range(rank):
            pull[i] -= row[i] * pulled[x]
    for k in range(len(told)):
        top = reduced.order[k]
        total = pull[top]
        for z in range(k):
            total -= reduced.wave[z, top] * told[z]
        told[k] = total / reduced.wave[k, top]


@apart
def _walked(contacts, prior, reduced, told, held, about, start, heat, steps, tolerance):
    """The unknowns that fit best, what is linear aside, by Levenberg and Marquardt's steps.

    Returns
    -------
    unknowns : ndarray, shape (size,)
        The best ones.
    value : float
        Their loss, less that of `about` without the prior.
    """
    at, count = contacts.at, len(told)
    origin, apart = np.empty(count), np.empty(count)
    none = np.empty((0, count))
    _shown(contacts, reduced, about, none, origin)
    moving = at.fields + len(contacts.influence)
    columns, point = np.empty((moving, count)), np.empty(count)
    beside, there = np.empty((moving, count)), np.empty(count)
    hessian, cone = np.empty((moving, moving)), np.empty((moving, moving))
    root, gradient, step = np.empty((moving, moving)), np.empty(moving), np.empty(moving)
    # without products of unknowns the loss is quadratic, but for the cone
    bent = at.fields > at.place or len(contacts.influence) > 0 or len(contacts.curvature) > 0
    unknowns, trial, damping = start.copy(), start.copy(), 1e-2 if bent else 1e-8
    _shown(contacts, reduced, unknowns, columns, point)
    value = _value(contacts, prior, told, held, origin, point, unknowns, heat)
    for turn in range(steps):
        renewed = bent or turn == 0
        if renewed:
            fill_products(columns, columns, moving, hessian)
        for i in range(count):
            apart[i] = (1 + held) * (point[i] - origin[i]) + told[i]
        for x in range(moving):
            k = x if x < at.fields else at.modes + x - at.fields
            gradient[x] = dot(columns[x], apart)
            gradient[x] += prior.precision[k] * (unknowns[k] - prior.mean[k])
            if renewed:
                for z in range(x + 1):
                    hessian[x, z] *= 1 + held
                hessian[x, x] += prior.precision[k]
        add_cone(prior, at.loads, unknowns, heat, cone, gradient)
        better, reached = False, value
        while damping < 1e6:
            if factorised(hessian, cone, damping, root):
                substituted(root, gradient, step)
                for x in range(moving):
                    k = x if x < at.fields else at.modes + x - at.fields
                    trial[k] = unknowns[k] + step[x]
                ahead = beside if bent and turn + 1 < steps else none
                _shown(contacts, reduced, trial, ahead, there)
                reached = _value(contacts, prior, told, held, origin, there, trial, heat)
                if reached <= value:
                    better = True
                    break
            damping *= 6
        if not better:
            break
        gain, value = value - reached, reached
        copied(trial, unknowns)
        if bent:
            columns, beside = beside, columns
        point, there = there, point
        if gain < tolerance and damping < 0.1:
            break
        damping = max(damping / 8, 1e-8)
    return unknowns, value


@sums
def _value(contacts, prior, told, held, origin, point, unknowns, heat):
    """Loss of unknowns at a point of the coordinates, less that at their origin and no prior."""
    total = prior_loss(prior, contacts.at.loads, unknowns, heat)
    for i in range(len(point)):
        far = point[i] - origin[i]
        total += far * ((1 + held) * far + 2 * told[i])
    return total


@apart
def _follow(contacts, reduced, before, pulled, start, unknowns):
    """What is linear follows the others, in `unknowns`."""
    rank, linear, root = len(contacts.fixed), len(pulled), reduced.root
    state = np.empty(rank)
    fill_node_phase(contacts, unknowns, state)
    for x in range(linear):
        pulled[x] += dot(reduced.cross[x], state) - dot(reduced.cross[x], before[:rank])
    for x in range(linear - 1, -1, -1):
        pulled[x] /= root[x, x]
        for z in range(x):
            pulled[z] -= root[z, x] * pulled[x]
        if _is_linear(contacts, x):
            unknowns[contacts.at.fields + x] = start[contacts.at.fields + x] - pulled[x]


@apart
def _fitted(contacts, prior, about, held, before, start, heat, steps, tolerance):
    """The unknowns that fit best to a frame that is quadratic in the state about one.

    Returns
    -------
    unknowns : ndarray, shape (size,)
        The best ones.
    hope : float
        How much the loss falls if the frame is so.
    """
    reduced = _reduced(contacts, prior, about.hessian)
    pulled, told = np.empty(len(reduced.root)), np.empty(len(reduced.order))
    _told(contacts, prior, reduced, about.gradient, start, pulled, told)
    hope = dot(pulled, pulled) + prior_loss(prior, contacts.at.loads, start, heat)
    unknowns, value = _walked(
        contacts, prior, reduced, told, held, start, start, heat, steps, tolerance
    )
    _follow(contacts, reduced, before, pulled, start, unknowns)
    return unknowns, hope - value


@sums_entry
def settled(model, contacts, plain, prior, frame, start, heats, rounds, steps, tolerance, bound):
    """Maximise the posterior from a start whose phase is nearly right.

    Parameters
    ----------
    model, contacts : FrameModel
        As of `by_coordinates` and `contact_coordinates`.
    plain : Prior
        Which knows nothing, of the state.
    prior : Prior
        What is known of the unknowns.
    frame : ndarray, shape (P,)
        Grey levels; not finite where a pixel is not used.
    start : ndarray, shape (size,)
        Unknowns.
    heats : ndarray, shape (h,)
        Factors on the variance of the noise and of the cone in the first rounds; then it is 1.
    rounds : int
        Most rounds after those.
    steps : int
        Most steps of the fit in each round.
    tolerance : float
        Fall of the loss below which it is at its smallest.
    bound : float
        Loss above which a top is of no use: rounds end where `FALL` times the fall that one
        promises does not lead below.

    Returns
    -------
    unknowns, loss, square, count
        As of `climb`.
    """
    return _settled(
        model, contacts, plain, prior, frame, start, heats, rounds, steps, tolerance, bound
    )


@apart
def _settled(model, contacts, plain, prior, frame, start, heats, rounds, steps, tolerance, bound):
    """As `settled`."""
    here, there, out = workspace(model), workspace(model), empty_linearised(model)
    unknowns = start.copy()
    before, after = np.empty(len(out.gradient)), np.empty(len(out.gradient))
    _state(contacts, unknowns, before)
    fill_exposure(model, before, here)
    loss = 0.0
    for turn in range(len(heats) + rounds):
        heat = heats[turn] if turn < len(heats) else 1.0
        sigma = np.sqrt(model.variance * heat)
        if turn <= len(heats):
            loss = frame_loss(model, plain, frame, before, here[4], sigma, heat)
            loss += prior_loss(prior, contacts.at.loads, unknowns, heat)
        fill_linearised(model, plain, frame, before, here, sigma, heat, out)
        held, better, reached, hoped, trial = 0.0, False, loss, 0.0, unknowns
        for _ in range(GUARDED):
            trial, hoped = _fitted(
                contacts, prior, out, held, before, unknowns, heat, steps, 0.3 * tolerance
            )
            if held == 0 and turn >= len(heats) and loss - FALL * hoped > bound:
                break
            _state(contacts, trial, after)
            fill_exposure(model, after, there)
            reached = frame_loss(model, plain, frame, after, there[4], sigma, heat)
            reached += prior_loss(prior, contacts.at.loads, trial, heat)
            if reached <= loss:
                better = True
                break
            held = 4 * held + 1
        if not better:
            if turn < len(heats):
                continue
            break
        gain, loss, unknowns = loss - reached, reached, trial
        here, there = there, here
        before, after = after, before
        # where the fall is as promised the next one has nothing left but its error
        if turn >= len(heats) and (gain < tolerance or abs(gain - hoped) < tolerance):
            break
    square, count, broken = weighed_squares(model, frame, here[4])
    return unknowns, loss, square, count, broken


@sums_entry
def state_of(contacts, unknowns, size):
    """The state of so many parts that unknowns make, shape (size,); as of `settled`."""
    state = np.empty(size)
    _state(contacts, unknowns, state)
    return state


@sums_entry
def changed(contacts, prior, about, state, unknowns, pulls, starts, steps):
    """Unknowns that change the phase most nearly as wanted, as the frame tells it.

    Parameters
    ----------
    contacts, prior
        As of `settled`.
    about : Linearised
        The loss of the state.
    state, unknowns : ndarray, shapes (state,) and (size,)
        What is changed.
    pulls : ndarray, shape (k, state)
        Information that the state shares with each change.
    starts : ndarray, shape (k, size)
        Unknowns from which they are looked for.
    steps : int
        Most steps of a fit.

    Returns
    -------
    found : ndarray, shape (k, size)
        Unknowns.
    kept : ndarray, shape (k,)
        What of the squared change, in deviations, they follow, less what the prior's loss grows by.
    """
    return _changed(contacts, prior, about, state, unknowns, pulls, starts, steps)


@apart
def _changed(contacts, prior, about, state, unknowns, pulls, starts, steps):
    """As `changed`."""
    found, kept = np.empty((len(pulls), len(unknowns))), np.empty(len(pulls))
    reduced = _reduced(contacts, prior, about.hessian)
    pulled, told = np.empty(len(reduced.root)), np.empty(len(reduced.order))
    before = prior_loss(prior, contacts.at.loads, unknowns, 1.0)
    for k in range(len(pulls)):
        _told(contacts, prior, reduced, -pulls[k], unknowns, pulled, told)
        kept[k] = dot(pulled, pulled) + before
        start = unknowns.copy()
        copied(starts[k, : contacts.at.fields], start[: contacts.at.fields])
        best, value = _walked(contacts, prior, reduced, told, 0.0, unknowns, start, 1.0, steps, 0.1)
        copied(best, found[k])
        kept[k] -= value
        _follow(contacts, reduced, state, pulled, unknowns, found[k])
    return found, kept


def knowing_nothing(model: FrameModel) -> Prior:
    """A prior of the unknowns of a model that leaves them free."""
    nothing = np.zeros(model.at.size)
    return Prior(nothing, nothing, -1.0, 1.0)
