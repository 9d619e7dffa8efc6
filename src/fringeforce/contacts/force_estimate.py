"""What contacts are told of a frame."""

from __future__ import annotations

from typing import Protocol

from fringeforce.base.arrays import Array


class ForceEstimate(Protocol):
    """Forces on n tactels as a frame says them; `fringeforce.Reading` is one."""

    @property
    def forces(self) -> Array:
        """Force on every tactel [N]."""
        ...

    @property
    def std(self) -> Array:
        """Standard deviations of the forces, same shape [N]."""
        ...

    @property
    def covariance(self) -> Array:
        """Covariance of `forces.ravel()` [N^2]."""
        ...

    @property
    def ok(self) -> bool:
        """Whether one load explains the frame."""
        ...

    @property
    def trusted(self) -> bool:
        """Whether the forces may be used: they explain the frame, or nothing touches."""
        ...
