"""Linear maps with their adjoints."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator

Values = NDArray[np.floating[Any]]


class LinearMap(ABC):
    """A linear map of arrays, and its adjoint: <forward(x), y> = <x, adjoint(y)> for all x, y."""

    @property
    @abstractmethod
    def shapes(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Shapes of what the map takes and of what it gives."""

    @abstractmethod
    def forward(self, values: Any) -> Values:
        """What the map makes of an array of the first shape."""

    @abstractmethod
    def adjoint(self, values: Any) -> Values:
        """What its transpose makes of an array of the second shape."""

    @property
    def operator(self) -> LinearOperator:
        """The same for SciPy's solvers, on flat arrays."""
        source, target = self.shapes
        made: Any = LinearOperator  # whose stubs know no functions
        return made(
            shape=(int(np.prod(target)), int(np.prod(source))),
            matvec=lambda x: self.forward(np.reshape(x, source)).ravel(),
            rmatvec=lambda y: self.adjoint(np.reshape(y, target)).ravel(),
            dtype=np.dtype(np.float32),
        )
