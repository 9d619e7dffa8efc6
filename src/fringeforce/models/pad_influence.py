"""From forces to the retardance of every slice, compressed so that it takes milliseconds.

Three things are common to all pads: stresses vary over the depth in few ways, which a singular
value decomposition finds; between samples they are smooth, so that splines carry them to pixels;
and mirror symmetry leaves a quarter of every matrix.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.errors import InputError
from fringeforce.base.linear_map import LinearMap
from fringeforce.mechanics.solid.block import SolidInfluence
from fringeforce.models import splines
from fringeforce.models.int16_matrix import Packed
from fringeforce.models.pad_symmetry import (
    FIELDS,
    PARITIES,
    fold,
    folded_weights,
    load_basis,
    unfold,
)

Array = NDArray[np.float64]
Single = NDArray[np.float32]

STRESSES = 1.0, 2.0
"""How often sigma_x - sigma_y and tau_xy count in the retardance A and B."""
EVEN_PROFILE = 1e-6
"""Share of an even depth profile that known ones may leave out."""


@dataclass(frozen=True, eq=False)
class PadInfluence(LinearMap):
    """Retardance per force.

    Attributes
    ----------
    count : (int, int)
        Tactels along x and y.
    x, y : ndarray, shape (nx,), (ny,)
        Places of the samples, even numbers of them [m].
    profile : ndarray, shape (slices, modes)
        What each mode adds to each slice, the one at the mirror first.
    quarters : tuple of ndarray, shape (2 * modes * ny / 2 * nx / 2, m)
        For each of the four parities of `PARITIES`, from loads in the basis of that parity to
        coefficients of splines, single-pass retardance (A, then B) of every mode on a quarter of
        the samples, those of negative x and y [rad/N].
    """

    count: tuple[int, int]
    x: Array
    y: Array
    profile: Array
    quarters: tuple[Single, ...]

    @property
    def modes(self) -> int:
        """Number of depth profiles."""
        return self.profile.shape[1]

    @cached_property
    def _bases(self) -> tuple[Single, ...]:
        return tuple(load_basis(self.count, p).astype(np.float32) for p in PARITIES)

    @cached_property
    def _packed(self) -> tuple[Packed, ...]:
        return tuple(Packed.of(part) for part in self.quarters)

    @property
    def shapes(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Those of forces and of spline coefficients."""
        grid = len(self.y), len(self.x)
        return (3 * self.count[0] * self.count[1],), (2, self.modes, *grid)

    def forward(self, values: NDArray[np.floating]) -> Single:
        """Spline coefficients of the modes under forces.

        Parameters
        ----------
        values : ndarray, shape (3 n,)
            N, T_x, T_y of tactel after tactel [N].

        Returns
        -------
        ndarray, shape (2, modes, ny, nx)
            Coefficients of (A, B) [rad].
        """
        ny, nx = len(self.y), len(self.x)
        whole = np.zeros((2, self.modes, ny, nx), dtype=np.float32)
        loads = values.astype(np.float32)
        for parity, part, patterns in zip(PARITIES, self._packed, self._bases, strict=True):
            quarter = part.forward(patterns @ loads).reshape(2, self.modes, ny // 2, nx // 2)
            for field, own in enumerate(FIELDS):
                unfold(quarter[field], _signs(parity, own), whole[field])
        return whole

    def adjoint(self, values: Single) -> Array:
        """From coefficients, shape (2, modes, ny, nx), to forces, shape (3 n,)."""
        total = np.zeros(self._bases[0].shape[1])
        for parity, part, patterns in zip(PARITIES, self._packed, self._bases, strict=True):
            quarter = np.stack(
                [fold(values[f], _signs(parity, own)) for f, own in enumerate(FIELDS)]
            )
            total += patterns.T @ part.adjoint(quarter.ravel())
        return total

    def matrix(self, x: Array, y: Array) -> Single:
        """The whole influence at all pairs of places along x and along y.

        Parameters
        ----------
        x, y : ndarray, shape (c,), (r,)
            Places [m].

        Returns
        -------
        ndarray, shape (2, modes, r * c, 3 n)
            Row by row [rad/N].
        """
        along, across = splines.basis(self.x, x), splines.basis(self.y, y)
        n = self._bases[0].shape[1]
        half = len(self.y) // 2, len(self.x) // 2
        result = np.zeros((2, self.modes, len(y) * len(x), n), dtype=np.float32)
        for parity, part, patterns in zip(PARITIES, self.quarters, self._bases, strict=True):
            shaped = part.reshape(2, self.modes, *half, part.shape[1])
            for field, own in enumerate(FIELDS):
                signs = _signs(parity, own)
                columns = folded_weights(along, signs[0]).astype(np.float32)
                rows = folded_weights(across, signs[1]).astype(np.float32)
                for mode in range(self.modes):
                    lines = np.tensordot(columns, shaped[field, mode], (1, 1))
                    values = np.tensordot(rows, lines, (1, 1))
                    result[field, mode] += values.reshape(len(y) * len(x), part.shape[1]) @ patterns
        return result


@dataclass(frozen=True, eq=False)
class Retardance(LinearMap):
    """From forces, shape (n, 3), to retardance at pixels, shape (2, modes, rows, columns) [rad].

    Attributes
    ----------
    influence : PadInfluence
        From forces to coefficients.
    rows : Band
        From coefficients to pixels, across the pad.
    columns : ndarray, shape (columns, nx)
        And along it.
    """

    influence: PadInfluence
    rows: splines.Band
    columns: Single

    @classmethod
    def at(cls, influence: PadInfluence, x: Array, y: Array) -> Retardance:
        """At the columns and rows of an image [m]."""
        columns = splines.basis(influence.x, x).astype(np.float32)
        return cls(influence, splines.Band.of(influence.y, y), columns)

    @property
    def shapes(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Those of forces and of retardance."""
        image = len(self.rows.first), len(self.columns)
        return (self.influence.shapes[0][0] // 3, 3), (2, self.influence.modes, *image)

    def forward(self, values: Array) -> Single:
        """Single-pass retardance (A, B) of every depth profile at every pixel."""
        return self.spread(self.influence.forward(values.ravel()))

    def spread(self, grid: Single) -> Single:
        """From spline coefficients, shape (2, modes, ny, nx), to the pixels."""
        # one large product is faster than many small ones
        across = grid.reshape(-1, grid.shape[-1]) @ self.columns.T
        shaped = across.reshape(-1, grid.shape[-2], len(self.columns))
        return self.rows.forward(shaped).reshape(self.shapes[1])

    def adjoint(self, values: Single) -> Array:
        """From retardance to forces."""
        return self.influence.adjoint(self.gather(values)).reshape(-1, 3)

    def gather(self, values: Single) -> Single:
        """From retardance at the pixels to spline coefficients: the transpose of `spread`."""
        across = self.rows.adjoint(values.reshape(-1, *values.shape[2:]))
        grid = across.reshape(-1, across.shape[-1]) @ self.columns
        return grid.reshape(self.influence.shapes[1])


def _signs(parity: tuple[int, int], own: tuple[int, int]) -> tuple[int, int]:
    return parity[0] * own[0], parity[1] * own[1]


def compressed(
    solid: SolidInfluence,
    count: tuple[int, int],
    stress_optic_constant: float,
    tolerance: float = 2e-3,
) -> tuple[PadInfluence, float, float]:
    """Compress what mechanics found.

    Parameters
    ----------
    solid : SolidInfluence
        Stresses on even numbers of samples, evenly spaced and symmetric about the centre.
    count : (int, int)
        Tactels along x and y.
    stress_optic_constant : float
        K_t [rad/(Pa m)].
    tolerance : float
        Share of the stresses, root mean square, that the depth profiles may leave out.

    Returns
    -------
    influence : PadInfluence
    left_out : float
        What they leave out.
    asymmetry : float
        What was averaged away to make the stresses symmetric, over their size, root mean square.

    Raises
    ------
    InputError
        If the samples are not as they should be.
    """
    nx, ny = len(solid.x), len(solid.y)
    for name, places in (("x", solid.x), ("y", solid.y)):
        if len(places) % 2 or not np.allclose(places, -places[::-1], atol=1e-9):
            raise InputError(
                f"{len(places)} samples along {name} from {places[0]:g} to {places[-1]:g} m cannot "
                "be folded; take an even number, symmetric about the centre."
            )
    # images of every force, N of all tactels first, as mechanics keeps them: (3 n, slices, ny, nx)
    stresses = solid.difference, solid.shear
    images = [np.transpose(part).reshape(-1, *part.shape[2::-1]) for part in stresses]
    profile, left_out = _depth_profiles(images, solid.weights, tolerance)
    shape = 2, profile.shape[1], ny // 2, nx // 2
    bases = [_components_first(load_basis(count, parity)) for parity in PARITIES]
    parts = [np.empty((*shape, len(basis)), dtype=np.float32) for basis in bases]
    kept, total, spline = 0.0, 0.0, _QuarterSpline(solid)
    for field, (image, twice) in enumerate(zip(images, STRESSES, strict=True)):
        flat = image.reshape(*image.shape[:2], -1)
        for mode, weights in enumerate(twice * stress_optic_constant * profile.T):
            samples = (weights @ flat).reshape(len(image), ny, nx)
            total += float(np.vdot(samples, samples))  # the loads of all kinds are orthonormal
            for parity, basis, part in zip(PARITIES, bases, parts, strict=True):
                signs = _signs(parity, FIELDS[field])
                folded = fold(samples, signs) / 4  # before loads are mixed: a quarter of the work
                quarter = (basis @ folded.reshape(len(image), -1)).reshape(-1, *folded.shape[1:])
                kept += 4 * float(np.vdot(quarter, quarter))
                part[field, mode] = np.moveaxis(spline.through(quarter, signs), 0, -1)
    # a pad of one tactel has no load of one of the parities
    quarters = tuple(part.reshape(int(np.prod(shape)), part.shape[-1]) for part in parts)
    influence = PadInfluence(count, solid.x, solid.y, profile, quarters)
    return influence, left_out, float(np.sqrt(max(1 - kept / total, 0.0)))


def with_even_profile(base: PadInfluence, weights: Array) -> PadInfluence:
    """The same influence with one more depth profile, so that they hold one that is even in depth.

    Parameters
    ----------
    base : PadInfluence
        Whose forces leave the new profile as it is.
    weights : ndarray, shape (slices,)
        Of the depth integral [m].
    """
    root = np.sqrt(weights)
    known, even = base.profile / root[:, None], root / np.linalg.norm(root)
    left = even - known @ (known.T @ even)
    if np.linalg.norm(left) < EVEN_PROFILE:
        return base
    profile = np.column_stack([base.profile, root * left / np.linalg.norm(left)])
    quarters = []
    for quarter in base.quarters:
        shaped = quarter.reshape(2, base.modes, -1)
        wider = np.concatenate([shaped, np.zeros_like(shaped[:, :1])], axis=1)
        quarters.append(np.ascontiguousarray(wider.reshape(-1, quarter.shape[1])))
    return PadInfluence(base.count, base.x, base.y, profile, tuple(quarters))


class _QuarterSpline:
    """Splines through the samples of a quarter and its mirror images."""

    def __init__(self, samples: SolidInfluence) -> None:
        self._across, self._along = (
            {sign: folded_weights(weights[: len(weights) // 2], sign) for sign in (1, -1)}
            for weights in map(splines.coefficients, (samples.y, samples.x))
        )

    def through(self, quarter: Array, signs: tuple[int, int]) -> Array:
        """Coefficients of a quarter, from its values, shape (m, ny / 2, nx / 2)."""
        x, y = signs
        return self._across[y] @ quarter @ self._along[x].T


def _components_first(basis: Array) -> Array:
    """Loads of `load_basis`, whose columns are those of forces, with the forces' axes swapped."""
    loads, columns = basis.shape
    return basis.reshape(loads, columns // 3, 3).swapaxes(1, 2).reshape(loads, columns)


def _depth_profiles(
    images: list[NDArray[np.floating]], weights: Array, tolerance: float
) -> tuple[Array, float]:
    """Profiles, shape (slices, modes), which also reduce stresses to modes, and what is left."""
    root, gram = np.sqrt(weights), np.zeros((len(weights), len(weights)))
    for image, twice in zip(images, STRESSES, strict=True):
        flat = image.reshape(*image.shape[:2], -1)
        gram += twice**2 * (flat @ flat.swapaxes(1, 2)).sum(axis=0)
    values, vectors = np.linalg.eigh(root[:, None] * gram * root)
    values, vectors = np.clip(values[::-1], 0, None), vectors[:, ::-1]
    lost = np.sqrt(np.append(values[::-1].cumsum()[::-1], 0) / values.sum())
    modes = int(np.argmax(lost <= tolerance))
    return root[:, None] * vectors[:, :modes], float(lost[modes])
