"""From a frame to forces with no earlier state: from what is far from a contact towards it.

Circular light and linear analysers measure the sine of the retardance with its direction, which
folds back where the retardance passes a quarter wave.  Far from contacts it does not, and what is
seen there already tells roughly what every contact does.  From this the retardance nearer to it is
predicted, with a deviation; places are believed where that is small and where the prediction agrees
with what is seen, the forces improve, and so on until all are believed.  What contact is like, with
pushes and with shear no larger, steers the growth and no more: the likelihood alone decides.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky, get_lapack_funcs
from scipy.linalg.blas import strmm  # pyrefly: ignore[missing-module-attribute]
from scipy.ndimage import binary_erosion, maximum_filter, uniform_filter

from fringeforce.estimation.likelihood import Response
from fringeforce.models.pad import PadModel
from fringeforce.optics.integrated import turn
from fringeforce.reading.pads.sampling import Sampling, lattice
from fringeforce.reading.pads.vectors import StressVectors, stress_vectors

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]

PRIOR_RETARDANCES = ((7.2, True), (4.2, True), (2.4, True), (7.2, False))
"""Retardance that the prior's deviation of a normal force causes beside its tactel [rad], in steps
of the root of three, and whether forces are those of a contact."""
SEARCH_SIDE = 40
"""Rows and columns of places."""
START = 0.4
"""Sine of the retardance below which, within a distance, a place is believed at first."""
REACHES = 2.4, 1.2, 0.6
"""These distances in turn until there is such a place, in thicknesses of the cover: where contacts
fill a small pad, all is near them."""
SHOWN_SHARE = 0.5
"""Share of the pixels there that must count."""
CALM = 0.06
"""Noise of a sine of the retardance that averages over one more pixel on either side keep small."""
BELIEVED = 0.5
"""Deviation of a predicted retardance below which a place is believed [rad]."""
SLACK = 0.05
"""What predictions may be wrong by while forces grow, as a sine of the retardance."""
WRONG = 0.12
"""Root mean square by which the sines of neighbours may differ from what is believed of them."""
MOST = 0.5
"""Share of the places that forces must explain for a search to begin again from there: fewer agree
by chance, where nothing is right."""
WHOLE = 0.95
"""Share of the places that shows which must come to be believed, but for noise all of them."""
SEARCH_STEPS = 60
"""Most steps of a search; most searches end sooner, where nothing new is believed."""
ROUNDED = 1e-6
"""Share of the mean information that sums in single precision are off by at most."""
SMALL_STEP = 0.02
"""Share of the prior's deviation below which a last step is not worth another."""
QUIET = 0.05
"""Share of the prior's deviation by which a normal force may pull in a contact."""


@dataclass(frozen=True, eq=False)
class Search:
    """What a search needs of a model.

    Attributes
    ----------
    model : PadModel
        Of the pad.
    response : Response
        Of its camera.
    looseness : float
        Standard deviation of what tolerances change, as a sine of the retardance.
    still : ndarray, optional
        Spline coefficients of the retardance that is expected without forces [rad].
    """

    model: PadModel
    response: Response
    looseness: float = 0.0
    still: Single | None = None

    def attempts(self, frame: Array, used: Mask | None = None) -> Iterator[tuple[Array, bool]]:
        """Forces near those that may have caused a frame, shape (3 n,), in turn.

        With each goes whether all that shows came to be believed, from places where the retardance
        is small without a doubt.

        Parameters
        ----------
        frame : ndarray, shape (channels * P,)
            Grey levels.
        used : ndarray of bool, same shape, optional
            Pixels that count; all if not given.
        """
        cover, seen = self.model.sensor.transducer.compliant.thickness, []
        for vectors in stress_vectors(self.model, self.response, frame, used):
            # averaged until noise alone is far from what tells a place to be believed
            size = 2 * int(vectors.noise / CALM) + 1
            calm = uniform_filter(vectors.values, size, axes=(1, 2))
            sines = np.sqrt((calm**2).sum(axis=0))
            sines[~vectors.known] = 0.0
            known = vectors.known.astype(float)
            low = np.zeros(0, dtype=bool)
            for reach in REACHES:
                around = [2 * int(reach * cover / pitch) + 1 for pitch in self._pitch]
                shown = uniform_filter(known, around) > SHOWN_SHARE
                low = self._few((maximum_filter(sines, around) < START) & shown)
                if low.any():
                    break
            seen.append((vectors.at(self.places.rows, self.places.columns), low))
        for plausible, contact in PRIOR_RETARDANCES:
            yield self._grown(seen, plausible / self.strongest, contact)

    def again(self, frame: Array, used: Mask | None, forces: Array, beside: int) -> Array | None:
        """Forces that are grown from where those of a search in vain explain the frame.

        Such a search often took but few tactels for the wrong fold of the sine.

        Parameters
        ----------
        frame, used
            As of `attempts`.
        forces : ndarray, shape (3 n,)
            Of the search.
        beside : int
            Places beside those that they do not explain which are not believed either.

        Returns
        -------
        ndarray, shape (3 n,), or None
            None if less than half of what shows is explained, or all.
        """
        seen, wrong = [], False
        for image in stress_vectors(self.model, self.response, frame, used):
            vectors = image.at(self.places.rows, self.places.columns)
            left = vectors.values - vectors.directions @ self._sines(forces, vectors.dispersion)
            shape = len(self.places.rows), len(self.places.columns)
            right = self._agrees(left, vectors, np.zeros(left.shape[1])).reshape(shape)
            start = binary_erosion(right, iterations=beside, border_value=1).ravel()
            if np.sum(start & vectors.known) < MOST * np.sum(vectors.known):
                return None
            seen.append((vectors, start))
            wrong |= not right.ravel()[vectors.known].all()
        if not wrong:
            return None
        plausible, contact = PRIOR_RETARDANCES[0]
        return self._grown(seen, plausible / self.strongest, contact, forces)[0]

    @cached_property
    def places(self) -> Sampling:
        """Where retardance is looked at."""
        return lattice(self.model, SEARCH_SIDE)

    @cached_property
    def _still(self) -> Single:
        """Retardance of the modes without forces, shape (2, modes, m) [rad]."""
        if self.still is None:
            return np.zeros(self.places.influence.shape[:3], dtype=np.float32)
        image = self.model.retarding.spread(self.still)
        few = image[..., self.places.rows[:, None], self.places.columns]
        return few.reshape(*few.shape[:2], -1)

    @cached_property
    def _whole_still(self) -> Single:
        """The same of both passes, shape (2, m) [rad]."""
        return np.asarray(np.einsum("k,fkm->fm", 2 * self.model.profile.sum(axis=0), self._still))

    @property
    def _pitch(self) -> tuple[float, float]:
        """Pitch of the pixels along rows and columns [m]."""
        x, y = self.model.sensor.pixel_positions
        return float(y[1] - y[0]), float(x[1] - x[0])

    def _few(self, image: Mask) -> Mask:
        return image[self.places.rows[:, None], self.places.columns].ravel()

    @cached_property
    def _whole(self) -> Single:
        """Retardance of both passes per force, shape (2, m, 3 n)."""
        profile = 2 * self.model.profile.sum(axis=0)
        return np.ascontiguousarray(np.einsum("k,fkmn->fmn", profile, self.places.influence))

    @cached_property
    def strongest(self) -> float:
        """Largest retardance per normal force [rad/N]."""
        return float(np.abs(self._whole[:, :, ::3]).max())

    def _grown(
        self,
        seen: list[tuple[StressVectors, Mask]],
        normal: float,
        contact: bool,
        forces: Array | None = None,
    ) -> tuple[Array, bool]:
        """Forces, grown from what is believed at the start, of which some may be given."""
        forces = np.zeros(self._whole.shape[2]) if forces is None else forces
        spread, deviation = np.full(len(forces), np.inf), np.full(self._whole.shape[1], np.inf)
        before = None
        for turn_ in range(SEARCH_STEPS):
            prior = _prior(forces, spread, normal, contact)
            matrix, pull, believed = np.diag(prior), -prior * forces, []
            for vectors, start in seen:
                left = vectors.values - vectors.directions @ self._sines(forces, vectors.dispersion)
                sure = start | (deviation * vectors.dispersion < BELIEVED)
                if turn_ > 1:
                    sure &= self._agrees(left, vectors, deviation * vectors.dispersion)
                believed.append(sure & vectors.known)
                rows = self._rows(forces, vectors, believed[-1])
                wanted = left[:, believed[-1]].ravel().astype(np.float32)
                weight = SLACK**2 + vectors.noise**2 + self.looseness**2
                matrix += (rows.T @ rows) / weight
                pull += (rows.T @ wanted) / weight
            factor = factored(matrix)
            step = cho_solve((factor, True), pull, check_finite=False)
            forces = forces + step
            same = before is not None and all(map(np.array_equal, before, believed))
            if same and np.abs(step).max() < SMALL_STEP * normal:
                break
            before = believed
            (inverse,) = get_lapack_funcs(("trtri",), (factor,))
            root = inverse(factor, lower=1)[0].astype(np.float32)
            spread = (root**2).sum(axis=0).astype(float)
            predicted = [strmm(1.0, root, part.T, lower=1) for part in self._whole]
            deviation = np.sqrt(np.max([np.einsum("ij,ij->j", one, one) for one in predicted], 0))
        shown = [
            start.any() and sure[vectors.known].mean() > WHOLE
            for (vectors, start), sure in zip(seen, before or [], strict=True)
        ]
        return forces, all(shown)

    def _sines(self, forces: Array, dispersion: float) -> Single:
        """Sine of the retardance with its direction, shape (2, m)."""
        modes = np.float32(dispersion) * (self.places.modes(forces) + self._still)
        slices = np.einsum("sk,fkm->sfm", self.model.profile, modes)
        light = np.empty((3, modes.shape[2]), dtype=np.float32)
        turn(np.ascontiguousarray(slices), light)
        return 2 * light[2] * light[:2]

    def _agrees(self, left: Array, vectors: StressVectors, deviation: Array) -> Mask:
        """Where what is seen around a place is what is believed, within a deviation of it."""
        shape = len(self.places.rows), len(self.places.columns)
        square = np.where(vectors.known, (left**2).sum(axis=0), 0.0).reshape(shape)
        size = np.sqrt(np.maximum(uniform_filter(square, 3), 0)).ravel()
        wrong = np.hypot(WRONG, 2 * self.looseness)
        return size < wrong + 2 * vectors.noise + BELIEVED * np.minimum(deviation, BELIEVED)

    def _rows(self, forces: Array, vectors: StressVectors, chosen: Mask) -> Single:
        """Derivatives of what is seen by the forces, shape (r * chosen, 3 n).

        Those of a single retarder, which leave out that stress turns over the depth.
        """
        whole = self._whole[:, chosen]
        pulled = whole @ forces.astype(np.float32) + self._whole_still[:, chosen]
        vector = vectors.dispersion * pulled
        size = np.hypot(*vector)
        along = np.divide(vector, size, out=np.zeros_like(vector), where=size > 0)
        across = np.sinc(size / np.pi)
        rows = []
        for direction in vectors.directions.astype(np.float32):
            turned = (np.cos(size) - across) * (direction @ along)
            shares = vectors.dispersion * (turned * along + across * direction[:, None])
            a, b = shares.astype(np.float32)[:, :, None]
            rows.append(a * whole[0] + b * whole[1])
        return np.concatenate(rows)


def factored(matrix: Array) -> Array:
    """Lower triangle L of a matrix L L^T.

    Where squares cover a whole pad, a uniform pressure leaves no trace, and sums in single
    precision may be less than none.
    """
    try:
        return np.asarray(cholesky(matrix, lower=True, check_finite=False))
    except LinAlgError:
        ridge = ROUNDED * np.trace(matrix) / len(matrix) * np.eye(len(matrix))
        return np.asarray(cholesky(matrix + ridge, lower=True, check_finite=False))


def _prior(forces: Array, spread: Array, normal: float, contact: bool) -> Array:
    """Information of the prior, shape (3 n,), given forces and their variances so far."""
    push, push_variance = forces[::3], spread[::3]
    shear = np.full(len(push), (normal / 2) ** 2)
    variance = np.full(len(push), normal**2)
    if contact:
        # what pulls is no contact, and shear is about as large as the push at most
        variance[push < 0] = (QUIET * normal) ** 2
        shear = np.minimum(shear, np.maximum(push, 0) ** 2 + push_variance)
    return 1 / np.stack([variance, shear, shear], axis=1).ravel()
