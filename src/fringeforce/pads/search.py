"""From a frame to forces with no earlier state: from what is far from a contact towards it.

Circular light and linear analysers measure the sine of the retardance with its direction, which
folds back where the retardance passes a quarter wave.  Far from contacts it does not, and what is
seen there already tells roughly what every contact does.  From this the retardance nearer to it is
predicted, with a deviation; pixels are believed where that is small, the forces improve, and so
on until all are believed.  A prior as wide as the sensor's range keeps the first steps finite.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, cholesky
from scipy.ndimage import maximum_filter, uniform_filter

from fringeforce.force.likelihood import Response
from fringeforce.pads.model import PadModel
from fringeforce.pads.sampling import Sampling

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SIZES = (0.4, 0.25, 0.55, 0.15)
"""Sines of the retardance below which pixels are believed at first, attempt by attempt."""
BELIEVED = 0.5
"""Deviation of a predicted retardance below which a pixel is believed [rad]."""
SLACK = 0.03
"""What predictions may be wrong by while forces grow, as a share of the light."""
ROUNDS = 25
PLAUSIBLE = 2.4
"""Retardance that the prior's deviation of a normal force causes beside its tactel [rad]."""
WILD = 8.0
"""Deviations of the prior beyond which forces do not grow."""
EXPLAINED = 1.3
"""Mean square residual of the sample that ends the search; full judgement follows."""


@dataclass(frozen=True, eq=False)
class Search:
    """What a search needs of a model.

    Attributes
    ----------
    model : PadModel
        Of the pad.
    response : Response
        Of its camera.
    samplings : sequence of Sampling
        Some pixels of every channel.
    """

    model: PadModel
    response: Response
    samplings: Sequence[Sampling]

    def attempts(self, frame: Array) -> list[tuple[float, Array]]:
        """Forces, and what they leave of the sample, mean square in units of the noise.

        Parameters
        ----------
        frame : ndarray, shape (channels * P,)
            Grey levels.

        Returns
        -------
        list of (float, ndarray of shape (3 n,))
            The best first; a search ends with the first that explains the sample.
        """
        light = (frame - self.response.offset) / self.response.amplitude
        channels = light.reshape(len(self.samplings), -1)
        data = np.concatenate([c[s.pixels] for c, s in zip(channels, self.samplings, strict=True)])
        sines = self._sines(channels)
        found = []
        for size in SIZES:
            start = np.concatenate([sines[s.pixels] < size for s in self.samplings])
            forces = self._climbed(self._grown(data, start), data)
            found.append((self._left(forces, data), forces))
            if found[-1][0] < EXPLAINED:
                break
        return sorted(found, key=lambda attempt: attempt[0])

    def _sines(self, channels: Array) -> Array:
        """The largest sine of the retardance within two covers of every pixel, shape (P,)."""
        columns, rows = self.model.sensor.camera.pixels
        equations, values = [], []
        for picture, light in zip(self.model.pictures, channels, strict=True):
            image = light.reshape(rows, columns)
            for kind, form in enumerate(picture.forms):
                mine = (self.model.kinds == kind).reshape(rows, columns)
                filled = np.where(mine, image - form[2, 2], 0.0)
                # both averages over the same neighbours, so that each kind is seen everywhere
                values.append(uniform_filter(filled, 5) / uniform_filter(mine.astype(float), 5))
                equations.append(2 * form[:2, 2] * picture.dispersion)
        solved = np.tensordot(np.linalg.pinv(np.array(equations)), np.array(values), axes=1)
        x, _ = self.model.sensor.pixel_positions
        reach = 2.4 * self.model.sensor.transducer.compliant.thickness
        neighbours = 2 * int(reach / (x[1] - x[0])) + 1
        return maximum_filter(2 * np.hypot(*solved), neighbours).ravel()

    @cached_property
    def _whole(self) -> NDArray[np.float32]:
        """Retardance of both passes per force at the samples, shape (2, m, 3 n)."""
        parts = [
            2 * np.tensordot(s.profile.sum(axis=0), s.influence, axes=(0, 1))
            for s in self.samplings
        ]
        return np.concatenate(parts, axis=1).astype(np.float32)

    @cached_property
    def _prior(self) -> Array:
        """Information of the prior, shape (3 n,)."""
        largest = np.abs(self._whole).max(axis=(0, 1)).reshape(-1, 3)[:, 0].max()
        normal = PLAUSIBLE / largest
        return np.tile(
            [normal**-2, (normal / 2) ** -2, (normal / 2) ** -2], self._whole.shape[2] // 3
        )

    @cached_property
    def _limit(self) -> Array:
        """Largest forces that growth may pass through, shape (3 n,) [N]."""
        return WILD / np.sqrt(self._prior)

    def _evaluate(self, forces: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        parts = [sampling.evaluate(forces) for sampling in self.samplings]
        return tuple(np.concatenate(part) for part in zip(*parts, strict=True))  # pyright: ignore

    def _left(self, forces: Array, data: Array) -> float:
        seen = np.concatenate([s.evaluate(forces, jacobian=False)[0] for s in self.samplings])
        square = float(((data - seen) ** 2).mean())
        return square * float(self.response.amplitude) ** 2 / self.response.variance

    def _grown(self, data: Array, start: Mask) -> Array:
        """Forces, grown from what is believed at the start."""
        forces, believed = np.zeros(self._whole.shape[2]), start
        for turn in range(ROUNDS):
            factor = None
            for _ in range(1 if turn else 3):
                seen, rows = self._evaluate(forces)
                rows, left = rows[believed] / np.float32(SLACK), (data - seen)[believed] / SLACK
                matrix = (rows.T @ rows).astype(float)
                matrix[np.diag_indices(len(matrix))] += self._prior
                factor = cho_factor(matrix, lower=True, check_finite=False)
                pull = rows.T @ left.astype(np.float32) - self._prior * forces
                step = cho_solve(factor, pull, check_finite=False)
                forces = np.clip(forces + step, -self._limit, self._limit)
            assert factor is not None
            grown = (self._deviation(factor[0]) < BELIEVED) | start
            if (grown == believed).all():
                break
            believed = grown
        return forces

    def _deviation(self, lower: Array) -> Array:
        """Deviation of the predicted retardance of every sample, shape (m,) [rad]."""
        root = np.linalg.inv(np.tril(lower)).T.astype(np.float32)
        return np.sqrt(sum(((part @ root) ** 2).sum(axis=1) for part in self._whole))

    def _climbed(self, forces: Array, data: Array, steps: int = 20) -> Array:
        """Forces at the top of the sample's likelihood, with the prior."""
        scale = float(self.response.amplitude) / np.sqrt(self.response.variance)

        def loss(at: Array, seen: NDArray[np.float32]) -> float:
            left = (data - seen) * scale
            return float(left @ left + self._prior @ at**2)

        damping = 1e-3
        seen, rows = self._evaluate(forces)
        here = loss(forces, seen)
        for _ in range(steps):
            rows = rows * np.float32(scale)
            matrix = (rows.T @ rows).astype(float)
            pull = rows.T @ ((data - seen) * scale).astype(np.float32) - self._prior * forces
            gain = 0.0
            while damping < 1e6:
                damped = matrix + np.diag(self._prior + damping * np.diag(matrix))
                factor = cholesky(damped, lower=True, check_finite=False)
                there = forces + cho_solve((factor, True), pull, check_finite=False)
                seen, rows = self._evaluate(there)
                gain = here - loss(there, seen)
                if gain > 0:
                    forces, here, damping = there, here - gain, damping / 10
                    break
                damping *= 10
            if gain < 1:
                break
        return forces
