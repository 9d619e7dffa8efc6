"""What a frame of a pad says: forces, how sure they are, and a verdict to act on."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import get_lapack_funcs

from fringeforce.reading.reading import Status

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PadReading:
    """Forces from one frame.

    Attributes
    ----------
    forces : ndarray, shape (n, 3)
        N, T_x, T_y of every tactel [N]; not a number for a bad frame.
    information : ndarray, shape (3n, 3n)
        Inverse of their covariance [1/N^2].
    chi2 : float
        Reduced chi-square; near one if the model explains the frame.
    status : Status
        The verdict.
    detail : str
        What exactly is the matter, where there is more to say than the advice.
    tracked : bool
        Whether the frame was followed from the last one rather than searched.
    alternatives : ndarray, shape (k, n, 3)
        Other forces that explain an ambiguous frame as well [N].
    """

    forces: Array
    information: Array
    chi2: float
    status: Status
    detail: str = ""
    tracked: bool = False
    alternatives: Array = field(default_factory=lambda: np.empty((0, 0, 3)))

    @property
    def covariance(self) -> Array:
        """Covariance of `forces.ravel()`, shape (3n, 3n) [N^2]."""
        return self._covariance

    @cached_property
    def _covariance(self) -> Array:
        units = np.outer(self._scale, self._scale)
        return np.asarray((self._lower + np.tril(self._lower, -1).T) / units)

    @property
    def std(self) -> Array:
        """Standard deviations of the forces, shape (n, 3) [N]."""
        deviations: Array = np.sqrt(np.diag(self._lower)) / self._scale
        return deviations.reshape(-1, 3)

    @property
    def _scale(self) -> Array:
        return np.sqrt(np.diag(self.information))

    @cached_property
    def _lower(self) -> Array:
        """Lower triangle of the covariance in units of single deviations."""
        if not np.isfinite(self.information).all():
            return np.full_like(self.information, np.nan)
        scaled = self.information / np.outer(self._scale, self._scale)
        potrf, potri = get_lapack_funcs(("potrf", "potri"), (scaled,))
        # half the time of an inverse that does not know of the symmetry, for every followed frame
        factor, trouble = potrf(scaled, lower=1)
        inverse = np.linalg.inv(scaled) if trouble else potri(factor, lower=1)[0]
        return np.tril(np.asarray(inverse, dtype=np.float64))

    @property
    def ok(self) -> bool:
        """Whether one load explains the frame."""
        return self.status is Status.OK

    @property
    def trusted(self) -> bool:
        """Whether the forces may be used: they explain the frame, or nothing touches."""
        return self.status in (Status.OK, Status.NO_CONTACT)

    @property
    def advice(self) -> str:
        """What to do, in words."""
        return f"{self.detail} {self.status.advice}".strip()
