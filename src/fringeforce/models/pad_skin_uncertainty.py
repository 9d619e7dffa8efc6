"""What is uncertain about a pad with a skin: tolerances as unknowns beside its contacts.

Light, camera and residual are those of `PadUncertainty`.  Sizes and materials change the waves that
harmonics of tractions cause, by the exact series at +- one standard deviation; the optical effect
and the wavelength scale all of that.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array, Single
from fringeforce.design.tolerances import Tolerances, with_values
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.pad_skin import PadSkinModel
from fringeforce.models.pad_synthesis import Synthesis
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.models.pad_unknowns import Group, value_of


@dataclass(frozen=True, eq=False, kw_only=True)
class PadSkinUncertainty(PadUncertainty):
    """A skin with all that is uncertain about its pad, whose model has the skin's depth profiles.

    Attributes
    ----------
    skin : PadSkinModel
        What contacts do.
    """

    skin: PadSkinModel

    @cached_property
    def _by_values(self) -> tuple[tuple[Group, tuple[Single, ...]], ...]:
        """Unknowns of the layers, and the change of the waves with their powers."""
        return tuple((group, self._changed(group)) for group in self.turning)

    def _changed(self, group: Group) -> tuple[Single, ...]:
        pad = self.model.sensor
        value = value_of(pad, group.path)
        plain = pad.model_copy(update={"tolerances": Tolerances()})
        behind, here, ahead = (
            self.skin.waves_of(with_values(plain, {group.path: value + way * group.std}))
            for way in (-1.0, 0.0, 1.0)
        )
        changes = (ahead - behind) / 2, (ahead + behind) / 2 - here
        return tuple(change.astype(np.float32) for change in changes)

    def waves(self, extra: Array) -> Single:
        """Retardance of the modes per harmonic, shape (2, modes, 3, m, n), under unknowns."""
        found = self.skin.waves
        for group, powers in self._by_values:
            for power, change in enumerate(powers, 1):
                found = np.add(found, np.float32(extra[group.begin] ** power) * change)
        share = self.share(extra)
        return found if share == 1 else np.float32(share) * found

    def waves_by_values(self, extra: Array) -> list[tuple[int, Single]]:
        """Numbers of the unknowns of sizes and materials, and derivatives of the waves by them."""
        found, share = list[tuple[int, Single]](), np.float32(self.share(extra))
        for group, powers in self._by_values:
            unknown = float(extra[group.begin])
            slopes = (
                np.float32(power * unknown ** (power - 1)) * change
                for power, change in enumerate(powers, 1)
            )
            found.append((group.begin, share * np.asarray(sum(slopes), dtype=np.float32)))
        if scaled := self.scaled(extra):
            waves = self.waves(extra)
            found += [(number, np.float32(slope) * waves) for number, slope in scaled]
        return found

    def synthesis(self, extra: Array) -> Synthesis:
        """From harmonics of tractions to retardance at the pixels, under unknowns."""
        if not self.turning and not self.scaling and not self.camera.moves(extra):
            return self.skin.pixels
        return self.skin.synthesis(*self.camera.looking(extra).pixel_positions, self.waves(extra))

    def modes(self, synthesis: Synthesis, loads: Single, extra: Array) -> Single:
        """Retardance of the modes under tractions, shape (2, modes, rows, columns) [rad]."""
        found = synthesis.modes(loads)
        if group := self.group(RESIDUAL):
            still = self.residual.coefficients(extra[group.place])
            found += self.retarding(extra).spread(still)
        return found

    def by_mechanics(
        self, synthesis: Synthesis, loads: Single, extra: Array, by_modes: Single, sums: Single
    ) -> Array:
        """Derivative by the unknowns of sizes, materials and residual, shape (size,).

        Parameters
        ----------
        synthesis, loads, extra
            As of `modes`.
        by_modes : ndarray, shape (2, modes, rows, columns)
            Derivative by the retardance of the modes.
        sums : ndarray, shape (2, modes, m, n)
            The same by the sums that the synthesis spreads.
        """
        found = np.zeros(self.size)
        for number, waves in self.waves_by_values(extra):
            found[number] = np.vdot(sums, synthesis.mixed(waves, loads))
        if group := self.group(RESIDUAL):
            grid = self.retarding(extra).gather(by_modes)
            found[group.place] = self.residual.adjoint(grid)
        return found
