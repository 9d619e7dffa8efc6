"""Models of the frames of a bench for some values of the unknowns that they share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fringeforce.base.arrays import Array, Index
from fringeforce.calibration.bench import LAMP, SCALE, SHIFT, Bench
from fringeforce.estimation.frame_exposure import NARROWEST_BLUR, node_phase, positive
from fringeforce.estimation.frame_model import FrameModel, Layout
from fringeforce.models.node_splines import coefficients


@dataclass(frozen=True, eq=False)
class FrameModels:
    """Models of all frames of a bench for some values of the shared unknowns."""

    bench: Bench
    shared: Array
    heat: float
    profiles: Array
    corrections: Array
    strained: Array

    @classmethod
    def of(cls, bench: Bench, shared: Array, heat: float) -> FrameModels:
        """Solve for the profiles of all contacts."""
        nodes = len(bench.template.fixed)
        design = shared[bench.at.own("design")]
        x = bench.positions(shared, bench.places)
        profiles = bench.contacts.profiles(design, x, nodes)
        corrections = np.zeros((0, 2, nodes))
        if bench.columns is not None:
            errors = shared[bench.at.height : bench.at.residual]
            columns = coefficients(bench.columns.correction(errors, x).T, nodes)
            corrections = columns.reshape(-1, 2, nodes)
        strained = np.zeros((len(bench.frames), 1))
        if bench.strain is not None:
            added = bench.strain.added_at(design)
            strained = bench.contacts.carried(added[None], x, nodes)[0]
        return cls(bench, shared, heat, np.ascontiguousarray(profiles), corrections, strained)

    def contacts(self, f: int) -> Index:
        """Places of the contacts of a frame, as numbers of those of the bench."""
        return self.bench.which[f, self.bench.contacts_of[f]]

    def of_frame(self, f: int) -> FrameModel:
        """Model of one frame, whose loss, terms and own unknowns are asked for in turn."""
        if f not in self._made:
            self._made[f] = self._with_profiles(f, self._profiles(f))
        return self._made[f]

    @cached_property
    def _made(self) -> dict[int, FrameModel]:
        """Models of frames so far."""
        return {}

    def _profiles(self, f: int) -> Array:
        """Those of the contacts of a frame, which frames with the same contacts share."""
        own, columns = self.contacts(f), self.bench.columns
        which = own.tobytes(), b"" if columns is None else self.tactels(f).tobytes()
        if which not in self._chosen:
            chosen = self.profiles[own]
            if columns is not None:
                more = self.corrections[self.tactels(f)]
                chosen = chosen + self.middling[:, None] * more[:, :, None]
            self._chosen[which] = chosen
        return self._chosen[which]

    @cached_property
    def _chosen(self) -> dict[tuple[bytes, bytes], Array]:
        """Profiles of the contacts of frames so far, by their places and tactels."""
        return {}

    def _with_profiles(self, f: int, chosen: Array) -> FrameModel:
        bench = self.bench
        template, averaged = bench.template, bench.averaged[f]
        brightness, darkness = bench.light
        return template._replace(
            fixed=template.fixed + self.strained[f],
            moments=np.zeros((len(chosen), 2, 1, 1)),
            profiles=chosen,
            brightness=brightness,
            darkness=darkness,
            influence=np.zeros((0, 1, len(chosen), 2, template.fixed.size)),
            moving=np.zeros((0, len(chosen))),
            origin=np.zeros(0),
            drawn=np.zeros(0),
            scaling=np.zeros(0),
            bias=template.bias + bench.turned[f],
            variance=template.variance * self.heat / averaged,
            at=bench.layouts[len(chosen)],
        )

    def held(self) -> dict[str, Any]:
        """Parts of a frame's model in which all that is shared has its value, as one mode."""
        bench, template, at = self.bench, self.bench.template, self.bench.at
        light = self.shared[at.bright : at.blur]
        deviation = template.blur + template.blur_std * self.shared[at.blur]
        leaks = np.tensordot(self.shared[at.own("crosstalk")], template.leaks, 1)
        return {
            "fixed": template.fixed + self.shared[at.own("residual")] @ template.fields,
            "fields": template.fields[:0],
            "brightness": np.concatenate([bench.lamp[0], [light @ template.brightness]]),
            "darkness": np.concatenate([bench.lamp[1], [light @ template.darkness]]),
            "blur": float(positive(deviation, NARROWEST_BLUR)[0]),
            "blur_std": 0.0,
            "gamma": float(template.gamma + template.gamma_std * self.shared[at.gamma]),
            "gamma_std": 0.0,
            "crosstalk": template.crosstalk + leaks if len(template.leaks) else template.crosstalk,
            "leaks": template.leaks[:0],
        }

    def alone(self, f: int, held: dict[str, Any]) -> FrameModel:
        """Model of one frame whose unknowns are its own, and last that of what is shared, one."""
        model, k = self.of_frame(f), len(self.contacts(f))
        at = Layout(2 * k, 2 * k, 3 * k, 4 * k, 4 * k, *[4 * k + LAMP + 1] * 5)
        own: dict[str, Any] = {**held, "fixed": held["fixed"] + self.strained[f], "at": at}
        return model._replace(**own)

    def tactels(self, f: int) -> Index:
        """Numbers of the tactels on which the contacts of a frame are."""
        numbers = self.bench.loads.tactels
        assert numbers is not None, "columns are those of tactels"
        return numbers[f, self.bench.contacts_of[f]]

    @cached_property
    def middling(self) -> Array:
        """What the mixtures of moments are for a narrow contact at its place, shape (k,)."""
        mixing = self.bench.template.mixing
        narrow = np.eye(1, mixing.shape[1])[0]
        return np.asarray(np.linalg.lstsq(mixing.T, narrow, rcond=None)[0], dtype=float)

    def columns(self, f: int) -> Index:
        """Columns of the forces of a frame, shape (2k,); none if columns have no errors."""
        if self.bench.columns is None:
            return np.zeros(0, dtype=np.intp)
        return np.add.outer(2 * self.tactels(f), [0, 1]).ravel()

    def involved(self, f: int) -> Index:
        """Numbers of the shared unknowns that act on a frame: not errors of other columns."""
        at, columns = self.bench.at, self.bench.columns
        if columns is None:
            return np.arange(at.size)
        errors = np.arange(at.height, at.residual).reshape(2, 2 * columns.tactels, -1)
        own = errors[:, self.columns(f)].ravel()
        return np.concatenate([np.arange(at.height), own, np.arange(at.residual, at.size)])

    def column_rows(self) -> Array:
        """What the errors of columns turn per force, shape (2, 2n, r, m) [rad/N]."""
        bench, nodes = self.bench, len(self.bench.template.fixed)
        if bench.columns is None:
            return np.zeros((2, 0, 0, nodes))
        x = bench.positions(self.shared, bench.places)
        rows = coefficients(bench.columns.rows(x), nodes)
        return rows.reshape(2, 2 * bench.columns.tactels, -1, nodes)

    def split(self, f: int) -> tuple[Index, Index]:
        """Which unknowns of a frame's model are its own, and which are shared."""
        return self.bench.splits[len(self.bench.contacts_of[f])]

    def unknowns(self, f: int, own: Array, shared: Array) -> Array:
        """Unknowns of a frame's model."""
        mine, others = self.split(f)
        found = np.empty(len(mine) + len(others))
        at = self.bench.at
        found[mine], found[others] = own, shared[at.residual : at.written]
        return found

    def slopes(self) -> Array:
        """Changes of the profiles with design and camera, shape (C, 2, k, d + 2, m)."""
        bench, nodes = self.bench, len(self.bench.template.fixed)
        design = self.shared[bench.at.own("design")]
        drawn, x = bench.places, bench.positions(self.shared, bench.places)
        found = bench.contacts.slopes(design, x, drawn, nodes)
        found[-2] *= SHIFT
        found[-1] *= SCALE
        return np.ascontiguousarray(np.moveaxis(found, 0, -2))

    def strain_slopes(self) -> Array:
        """Changes of what strain adds with design and camera, shape (F, d + 2, m) or (F, 1, 1)."""
        bench, nodes = self.bench, len(self.bench.template.fixed)
        if bench.strain is None:
            return np.zeros((len(bench.frames), 1, 1))
        drawn, x = bench.places, bench.positions(self.shared, bench.places)
        here = bench.strain.added_at(self.shared[bench.at.own("design")])
        shift, scale = bench.contacts.carried_slopes(here, x, drawn, nodes)
        design = bench.contacts.carried(bench.strain.added[1:], x, nodes)
        return np.moveaxis(np.concatenate([design, [SHIFT * shift, SCALE * scale]]), 0, 1)

    def waves(self, f: int, unknowns: Array, slopes: Array) -> Array:
        """Changes of the phase at the nodes with design and camera, shape (d + 2, m)."""
        changes, nodes = slopes.shape[-2:]
        line = changes * nodes  # one after another, without the residual
        model = self._with_profiles(f, slopes.reshape(*slopes.shape[:-2], line)[self.contacts(f)])
        model = model._replace(fixed=np.zeros(line), fields=np.zeros((0, line)))
        return np.asarray(node_phase(model, unknowns)).reshape(changes, nodes)
