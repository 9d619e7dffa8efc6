"""Starts for the posterior of a frame: loads and all that is uncertain, with nothing known before.

The light comes from the frame's own extremes.  Then a beam search follows the phase along the strip
(`branches`) with a state that is linear in the phase: loads; force times place and force times
squared place and width of each contact, which shift and widen it; fields of phase; and modes of the
influence matrix under the mean load.  Contacts push: before anything is seen the normal forces have
the mean that the pace of the fringes tells.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.bad_pixels import OUTLIER
from fringeforce.estimation.frame_model import FrameModel, turned_moments
from fringeforce.estimation.phase.branches import branches
from fringeforce.estimation.phase.folding import block_edges, block_means
from fringeforce.estimation.phase.reflections import TOUCH, mirror_images
from fringeforce.estimation.phase_fit import LIKELY_STDS
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.reading.contact_prior import LOADS, SHEAR_RATIO
from fringeforce.reading.frame_light import CONTRAST, FrameLight, Light, Lines

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

DENSE = 1.3
"""Pace of the phase beyond which pixels no longer follow fringes [rad per pixel]."""
STRIDE = 0.5
"""Largest change of the phase from one single load that is tried to the next [rad]."""
LEVEL_ERROR = 0.01
"""Standard deviation of a block's normalised intensity by all that the extremes do not tell."""
LARGE = 0.02
"""Change of a load's phase over the phase of all loads together from which a mode is large."""
TURN = 0.35
"""Change of the influence, over its peak, from one search to the next: with twice as much, of a
camera that is shifted by a third of the cover's thickness, a search leads to no explanation."""
TELLING_SHARE = 0.03
"""Share of the size of the loads below which a force does not tell its contact's place."""
GROWTH = 600.0
"""Expected growth of the loss, in the linear state, up to which mirror images are fitted.  Once
they are, one in three below 40 is an explanation of weight, one in twenty from 100 to 400, and some
are beyond 10,000: the quadratic loss is too high for small bends beside a multiple of pi."""
IMAGES_FITTED, IMAGE_STEPS = 64, 8
"""Images that are fitted, and steps of each fit: 30 tactels have so many within `GROWTH`, and
contacts three deviations beside their tactels are hardly approached in four."""
CANDIDATES = 24
"""Starts of one attempt that are climbed."""
FIRST_EFFORTS = 2
"""Efforts, from either end, of a search that is one of several."""
BINS = 4
"""Pixels that count as one while explanations are looked for."""
LEAST_PHASE = 0.3
"""Phase that the loads of a frame are expected to cause at least, root mean square [rad]."""


@dataclass(frozen=True)
class Effort:
    """One attempt at a frame.

    Attributes
    ----------
    push : float
        Mean of the normal forces over their standard deviation; 0 for a mean of zero.
    phase_error : float
        Standard deviation of a block's phase beyond its noise [rad].  It stands for errors that
        neighbouring blocks share, so it is larger than each has.
    contrast_error : float
        Relative error of the contrast.
    extent : float
        Phase that a block of pixels may span [rad].
    width : int
        Hypotheses that are kept.
    cut : float
        Squared deviations behind the best at which a hypothesis is given up.
    scale : float
        Size of the loads over the estimate from the frame's own fringes.
    light : str
        "extremes", "drawn", or "fitted" for that of the best explanation so far.
    backward : bool
        Whether to scan from the last pixel to the first.
    """

    push: float = 1.5
    phase_error: float = 0.15
    contrast_error: float = 0.02
    extent: float = 0.4
    width: int = 256
    cut: float = 60.0
    scale: float = 1.0
    light: str = "extremes"
    backward: bool = False


EFFORTS = (
    Effort(),
    Effort(backward=True),
    Effort(phase_error=0.1, extent=0.6),
    Effort(phase_error=0.1, extent=0.6, backward=True),
    Effort(phase_error=0.06, contrast_error=0.01, light="fitted"),
    Effort(phase_error=0.06, contrast_error=0.01, light="fitted", backward=True),
    Effort(push=0.0, phase_error=0.05),
    Effort(push=0.0, phase_error=0.05, backward=True),
    Effort(contrast_error=0.05, light="drawn"),
    Effort(contrast_error=0.05, light="drawn", backward=True),
    Effort(extent=0.25, width=512, cut=120.0),
    Effort(scale=1.6),
    Effort(scale=0.7),
)
"""Attempts in the order in which they are made; the first two explain nine frames in ten."""


@dataclass(frozen=True, eq=False)
class PosteriorSearch:
    """Finds starts for frames of one strip.

    Attributes
    ----------
    model : FrameModel
        What makes frames, with errors of shape under unit loads.
    centre : ndarray, shape (d,), optional
        Modes of the influence matrix of the sensor, if they are nearly known; as drawn if not
        given.
    """

    model: FrameModel
    centre: Array | None = None

    @cached_property
    def light(self) -> FrameLight:
        """What tells the light of frames."""
        return FrameLight(self.model)

    @cached_property
    def _large(self) -> NDArray[np.bool_]:
        """Modes that turn the influence so much that each load needs a column of its own."""
        under_push = np.abs(self._slopes[:, :, 0]).max(axis=(1, 2))
        whole = np.abs(self.model.moments[:, 0, 0].sum(axis=0)).max()
        return under_push > LARGE * max(whole, 1e-12)

    @cached_property
    def _slopes(self) -> Array:
        """Change of the influence matrix of contacts as drawn with its modes, (d, n, 2, m)."""
        _, slopes = turned_moments(self.model, np.zeros(len(self.model.influence)))
        return slopes[:, :, :, 0]

    @cached_property
    def _begin(self) -> Array:
        """Modes of the influence matrix with which a search begins, shape (d,)."""
        return np.zeros(len(self.model.influence)) if self.centre is None else self.centre

    @cached_property
    def _begins(self) -> list[Array]:
        """Modes of other sensors with which a search begins, the likeliest first.

        Of the mode that turns the influence most: what it does is far from linear.
        """
        peak = max(np.abs(self.model.moments[:, 0, 0]).max(), np.finfo(float).tiny)
        turns = np.abs(self._slopes[:, :, 0]).max(axis=(1, 2)) / peak
        if self.centre is not None or not len(turns):
            return []
        own = np.eye(len(turns))[np.argmax(turns)]
        steps = np.arange(1, 1 + int(LIKELY_STDS * turns.max() / TURN)) * TURN / turns.max()
        return [way * step * own for step in steps for way in (1.0, -1.0)]

    @cached_property
    def _at_nodes(self) -> dict[str, Array]:
        return self._turned_nodes(np.where(self._large, self._begin, 0.0))

    def _nodes_under(self, modes: Array) -> dict[str, Array]:
        """Columns of the state at the nodes, shape (m, k) each, per unit load where they scale.

        Parameters
        ----------
        modes : ndarray, shape (d,)
            Of the influence matrix, of which the large ones count.
        """
        large = self._large & (modes != self._begin)
        return (
            self._turned_nodes(np.where(self._large, modes, 0.0)) if large.any() else self._at_nodes
        )

    def _turned_nodes(self, modes: Array) -> dict[str, Array]:
        model, at = self.model, self.model.at
        (moments, turned), nodes = turned_moments(model, modes), len(model.fixed)
        parts, slopes = {"load": moments[:, :, 0]}, turned[:, :, :, 0]
        if moments.shape[2] > 2:
            mean, spread = self._squares
            parts["load"] = parts["load"] + mean * moments[:, :, 2]
            slopes = slopes + mean * turned[:, :, :, 2]
            if at.width > at.place:
                parts["shifted"] = moments[:, :, 1] * (model.place / model.reach)
            parts["widened"] = moments[:, :, 2] * spread
        if self._large.any():
            parts["apart"] = slopes[self._large]
        parts["turned"] = slopes[:, :, 0].sum(axis=1)
        parts["fields"] = model.fields
        parts["fixed"] = model.fixed[None]
        return {name: part.reshape(-1, nodes).T for name, part in parts.items()}

    @cached_property
    def _squares(self) -> tuple[float, float]:
        """Mean and deviation of the second moment of a contact's traction about its tactel."""
        model, square = self.model, self.model.reach**2
        width, std = model.width**2, model.width_std**2
        spread = 2 * model.place**4 + (4 * width * std + 2 * std**2) / 144
        return (width + std) / 12 / square, np.sqrt(spread) / square

    @cached_property
    def _columns(self) -> dict[str, Array]:
        """The same of a sensor as drawn at the pixels of one channel."""
        return self._at_pixels(self._at_nodes)

    def _at_pixels(self, nodes: dict[str, Array]) -> dict[str, Array]:
        model = self.model
        pixels = len(model.amplitude) // len(model.bias)
        first, weights = model.first[:pixels], model.weights[:pixels]
        return {
            name: np.asarray(sum(part[first + t] * weights[:, t, None] for t in range(4)))
            for name, part in nodes.items()
        }

    def _state(self, modes: Array) -> Array:
        """All of these side by side, in the order of `_scale`, the fixed phase last."""
        nodes = self._nodes_under(modes)
        own = self._columns if nodes is self._at_nodes else self._at_pixels(nodes)
        return np.concatenate([*(own[name] for name in self._units), own["fixed"]], 1)

    def pushing(self, pace: Array) -> float:
        """Mean normal force of contacts whose fringes run as fast as the frame's [N]."""
        steps, least = self._push
        return max(float(np.sqrt(np.square(pace[:-1]).sum() / steps)), least)

    @cached_property
    def _push(self) -> tuple[float, float]:
        """Squared steps of the phase that a newton on all makes, and the least push [N]."""
        load = self._columns["load"]
        unit = np.diff(load, axis=0)
        even = np.square(unit[:, ::2].sum(axis=1)).sum()
        loose = np.square(unit * np.tile([1 / 1.5, SHEAR_RATIO], unit.shape[1] // 2)).sum()
        size = float(np.sqrt(np.square(load[:, ::2].sum(axis=1)).mean()))
        return float(even + loose), LEAST_PHASE / max(size, 1e-12)

    def starts(
        self, lines: Lines, light: Light, effort: Effort, modes: Array | None = None
    ) -> tuple[Array, Array, float]:
        """Unknowns to climb from, the likeliest first.

        Parameters
        ----------
        lines : Lines
            Of the frame.
        light : Light
            Of the frame.
        effort : Effort
            How to search.
        modes : ndarray, shape (d,), optional
            Of the influence matrix of the sensor with which to begin; as drawn if not given.

        Returns
        -------
        starts : ndarray, shape (k, size)
            Loads [N] and standardised unknowns.
        scores : ndarray, shape (k,)
            Squared deviations of the search, ascending.
        push : float
            Mean normal force that the pace of the fringes tells [N].
        """
        modes = self._begin if modes is None else modes
        pace, contrast = self.light.true_pace(lines, light)
        push = effort.scale * self.pushing(pace)
        edges, plain = block_edges(pace, effort.extent), self.light.plain(lines, light)
        blocks = [
            self._folded(lines, plain, light, effort, edges, contrast, c)
            for c in range(len(self.model.bias))
        ]
        fold, variance, single, bias, ratio = (
            np.stack(rows, axis=1) for rows in zip(*blocks, strict=True)
        )
        known = np.isfinite(variance)
        means = block_means(self._state(modes), edges)
        means = means[np.nonzero(known)[0]] * ratio[known][:, None]
        scale = self._scale(push, effort.push)
        state = means[:, :-1] * np.concatenate(list(scale.values()))
        fixed = means[:, -1] + bias[known]
        if effort.push:
            fixed = fixed + push * means[:, : self.model.at.loads : 2].sum(axis=1)
        order = slice(None, None, -1 if effort.backward else 1)
        means, scores = branches(
            fold[known][order],
            variance[known][order],
            single[known][order],
            np.ascontiguousarray(fixed[order]),
            np.ascontiguousarray(state[order]),
            effort.width,
            OUTLIER,
            effort.cut,
        )
        about = np.zeros(self.model.at.size)
        about[self.model.at.modes :][: len(modes)] = modes
        found = self._unknowns(means, scale, about, bool(effort.push) * push)
        self.light.lit(found, light)
        return found, scores, push

    @cached_property
    def _single(self) -> int | None:
        """Which load alone changes the phase, or None if there are several."""
        told = np.flatnonzero(np.abs(self.model.moments[:, :, 0]).max(axis=2).ravel())
        return int(told[0]) if len(told) == 1 else None

    def scanned(self, lines: Lines, load: int) -> tuple[Array, Array, float]:
        """Starts over the whole range of the one load that changes the phase, as `starts`."""
        model, columns = self.model, self._columns
        unit, fixed = columns["load"][:, load], columns["fixed"][:, 0]
        most = DENSE / np.abs(np.diff(unit)).max()
        forces = np.linspace(0.0, most, 2 + int(most * np.abs(unit).max() / STRIDE))
        lights = (
            [lines.light] if lines.light is self.light.drawn else [lines.light, self.light.drawn]
        )
        found, scores = np.zeros((len(lights), len(forces), model.at.size)), list[Array]()
        for own, light in zip(found, lights, strict=True):
            own[:, load] = forces
            self.light.lit(own, light)
            errors = np.zeros(len(forces))
            for c, (seen, line) in enumerate(
                zip(lines.seen, self.light.plain(lines, light), strict=True)
            ):
                phase = (np.outer(forces, unit) + fixed) * model.dispersion[c] + model.bias[c]
                bright = (1 - light.visibility * np.cos(phase)) / 2
                error = np.square(bright - line) / (lines.variance[c] + LEVEL_ERROR**2)
                errors += np.minimum(error, OUTLIER**2)[:, seen].sum(axis=1)
            scores.append(errors)
        flat = np.concatenate(scores)
        order = np.argsort(flat, kind="stable")
        push = self.pushing(self.light.true_pace(lines, lines.light)[0])
        return found.reshape(-1, model.at.size)[order], flat[order], push

    def _scale(self, push: float, pushing: float) -> dict[str, Array]:
        """Standard deviations of the parts of the state, for loads of about this size [N]."""
        sizes = {name: push * unit for name, unit in self._units.items()}
        sizes["load"][::2] = push / pushing if pushing else LOADS * push
        return sizes | {"fields": self._units["fields"]}

    @cached_property
    def _units(self) -> dict[str, Array]:
        """The same for loads of a newton, whose normal part `_scale` fills in."""
        moved = np.tile([1.0, SHEAR_RATIO], len(self.model.moments))
        sizes = {name: moved for name in ("load", "shifted", "widened") if name in self._at_nodes}
        if "apart" in self._at_nodes:
            sizes["apart"] = np.tile(moved, np.count_nonzero(self._large))
        return sizes | {"turned": 1.0 * ~self._large, "fields": np.ones(len(self.model.fields))}

    def _folded(
        self,
        lines: Lines,
        plain: Array,
        light: Light,
        effort: Effort,
        edges: NDArray[np.intp],
        contrast: Array,
        channel: int,
    ) -> tuple[Array, Array, NDArray[np.bool_], Array, Array]:
        """Folded phase of every block of a channel: fold, variance, single, bias, dispersion."""
        model, seen = self.model, lines.seen[channel].astype(float)
        count = np.add.reduceat(seen, edges[:-1])
        size = np.maximum(count, 1)
        line = plain[channel]
        mean = np.add.reduceat(seen * line, edges[:-1]) / size
        kept = np.add.reduceat(contrast[channel], edges[:-1]) / np.diff(edges)
        swing = (1 - 2 * mean) / (light.visibility * kept)
        turns = np.rint(model.bias[channel] / np.pi)
        share = np.clip((1 - swing * (-1) ** turns) / 2, 0, 1)
        error = effort.contrast_error**2 + np.square(0.3 * np.log(1 / np.maximum(kept, CONTRAST)))
        error = error * np.square(swing / 2) + LEVEL_ERROR**2
        noise = lines.variance[channel] / size / np.square(light.visibility * kept) + error
        fold = 2 * np.arcsin(np.sqrt(share))
        spread = noise / (share * (1 - share) + np.sqrt(noise) / 2) + effort.phase_error**2
        distance = np.minimum(fold, np.pi - fold)
        single = 2 * distance < 1.5 * np.sqrt(spread)
        return (
            np.where(single, np.where(fold < np.pi / 2, 0.0, np.pi), fold),
            np.where(count > 0, np.where(single, spread + distance**2, spread), np.inf),
            single,
            np.full(len(size), model.bias[channel] - np.pi * turns),
            np.full(len(size), model.dispersion[channel]),
        )

    def _unknowns(
        self, changes: Array, scale: dict[str, Array], about: Array, push: float
    ) -> Array:
        """Unknowns that differ from others by changes of the state, shape (k, size).

        Force times place and force times squared width become place and width of each contact, as
        its two forces tell them best.

        Parameters
        ----------
        changes : ndarray, shape (k, states)
            In standard deviations.
        scale : mapping
            Standard deviations of the parts of the state.
        about : ndarray, shape (size,)
            The others.
        push : float
            Normal force of all contacts beside them [N].
        """
        model, at = self.model, self.model.at
        ends = np.cumsum([len(size) for size in scale.values()])[:-1]
        split = dict(zip(scale, np.split(changes, ends, axis=1), strict=True))
        parts = {name: part * scale[name] for name, part in split.items()}
        found = np.tile(about, (len(changes), 1))
        before = about[: at.loads].reshape(-1, 2)
        forces = before + parts["load"].reshape(len(changes), len(before), 2) + [push, 0.0]
        found[:, : at.loads] = forces.reshape(len(changes), at.loads)
        weight = np.square(forces).sum(axis=2) + (TELLING_SHARE * scale["load"].max()) ** 2
        places = np.zeros(forces.shape[:2])
        if "shifted" in parts:
            moved = before * about[at.place : at.width, None]
            moved = moved + parts["shifted"].reshape(forces.shape)
            places = np.clip((forces * moved).sum(axis=2) / weight, -LIKELY_STDS, LIKELY_STDS)
            found[:, at.place : at.width] = places
        if at.fields > at.width:
            mean, spread = self._squares
            here = model.width + model.width_std * about[at.width : at.fields]
            square = np.square(np.maximum(here, 0) / model.reach) / 12 - mean
            if at.width > at.place:
                square += np.square(model.place / model.reach * about[at.place : at.width])
            moved = before * (square / spread)[:, None]
            moved = moved + parts["widened"].reshape(forces.shape)
            square = (forces * moved).sum(axis=2) / weight * spread + mean
            square = square - np.square(model.place * places / model.reach)
            wide = model.reach * np.sqrt(12 * np.maximum(square, 0.0))
            e = (wide - model.width) / model.width_std
            found[:, at.width : at.fields] = np.clip(e, -LIKELY_STDS, LIKELY_STDS)
        for k, mode in enumerate(np.flatnonzero(self._large)):
            moved = parts["apart"][:, k * at.loads : (k + 1) * at.loads].reshape(forces.shape)
            e = (forces * moved).sum(axis=(1, 2)) / weight.sum(axis=1)
            found[:, at.modes + mode] += np.clip(e, -LIKELY_STDS, LIKELY_STDS)
        small = np.flatnonzero(~self._large)
        found[:, at.modes + small] += split["turned"][:, small]
        found[:, at.fields : at.modes] += parts["fields"]
        return found

    def images(
        self, posterior: Posterior, top: Top, push: float, within: Mask | None = None
    ) -> Array:
        """Starts in which a stretch of a top's phase is mirrored, the likeliest first.

        The changes that follow mirrored stretches best are found in the state of the search, in
        which shifted and widened contacts are linear; from there places and widths are fitted to
        the mirrored phase as they are.

        Parameters
        ----------
        posterior : Posterior
            Of the frame.
        top : Top
            The explanation.
        push : float
            Size of the loads [N].
        within : ndarray of bool, shape (m,), optional
            Nodes of the phase that may be mirrored; all if not given.

        Returns
        -------
        ndarray, shape (k, size)
            Unknowns to climb from.
        """
        at = self.model.at
        modes = top.unknowns[at.modes : at.modes + len(self._begin)]
        changes, _, turned = self.mirrored(posterior.phase(top), push, GROWTH, modes)
        if within is not None:
            near = np.abs(turned[:, ~within]).max(axis=1, initial=0.0) < TOUCH
            changes, turned = changes[near], turned[near]
        scale = self._scale(push, 0.0)
        starts = self._unknowns(changes[:IMAGES_FITTED], scale, top.unknowns, 0.0)
        found, growths = posterior.changed(top, turned[:IMAGES_FITTED], starts, BINS, IMAGE_STEPS)
        return found[np.argsort(growths, kind="stable")]

    def mirrored(
        self, phase: Array, push: float, growth: float, modes: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """Changes of the state that mirror a stretch of a phase, the likeliest first.

        Parameters
        ----------
        phase : ndarray, shape (m,)
            At the nodes [rad].
        push : float
            Size of the loads [N].
        growth : float
            Expected growth of the loss up to which images are of interest.
        modes : ndarray, shape (d,), optional
            Of the influence matrix; as drawn if not given.

        Returns
        -------
        changes : ndarray, shape (k, states)
            In standard deviations.
        columns : ndarray, shape (m, states)
            What these do to the phase.
        turned : ndarray, shape (k, m)
            Change of the phase that each is for [rad].
        """
        nodes = self._at_nodes if modes is None else self._nodes_under(modes)
        scale = self._scale(push, 0.0)
        columns = np.ascontiguousarray(
            np.concatenate([nodes[name] * size for name, size in scale.items()], axis=1)
        )
        seen, known = phase_information(self.model, phase), np.ones(columns.shape[1])
        changes, _, turned = mirror_images(phase, columns, seen, known, growth=growth)
        return changes, columns, turned

    def attempts(self, lines: Lines, best: list[Top]) -> Iterator[tuple[Array, Array, float]]:
        """Starts of one effort after the other; `best` holds the explanations so far."""
        if self._single is not None:
            yield self.scanned(lines, self._single)
        for number, effort in enumerate(EFFORTS):
            if number == FIRST_EFFORTS:
                for modes in self._begins:
                    yield self.starts(lines, lines.light, EFFORTS[0], modes)
            light = lines.light if effort.light == "extremes" else self.light.drawn
            if effort.light == "fitted":
                if not best:
                    continue
                light = self.light.fitted(best[0])
            yield self.starts(lines, light, effort)


def phase_information(model: FrameModel, phase: Array) -> Array:
    """Information of a frame about its phase at the nodes [1/rad^2]; some at the extremes too."""
    strength = np.mean(model.amplitude / np.sqrt(model.variance)) * model.visibility / 2
    seen = np.square(strength * np.sin(phase)) + strength / 16
    return seen * len(model.amplitude) / len(phase)
