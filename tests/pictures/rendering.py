"""Pictures of a strip as an area camera sees it, rendered by supersampling."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Scene:
    """Corners of the strip [column, row], size of the picture, and the light on both.

    A lens with `brown` shows what is r half diagonals from the middle at r (1 + brown r^2) (Brown,
    Photogramm. Eng. 32, 444, 1966); the corners are where a lens without it would show them.
    """

    corners: tuple[tuple[float, float], ...]
    size: tuple[int, int]
    border: float = 0.03  # share of the full scale
    uneven: float = 0.1  # change of the light from one edge to the other
    subpixels: int = 4
    brown: float = 0.0

    def seen(self, points) -> NDArray[np.float64]:
        """Where the lens shows points [column, row], shape (..., 2)."""
        middle, half = (np.array(self.size) - 1) / 2, np.hypot(*self.size) / 2
        apart = (np.asarray(points) - middle) / half
        return middle + half * apart * (1 + self.brown * (apart**2).sum(axis=-1, keepdims=True))

    def shares(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Along and across the strip at every subpixel.

        The plane of the strip to that of the picture by cross ratios: the vanishing points of both
        pairs of edges, without a matrix.
        """
        columns, rows = self.size
        fine = (np.arange(max(columns, rows) * self.subpixels) + 0.5) / self.subpixels - 0.5
        x, y = np.meshgrid(fine[: columns * self.subpixels], fine[: rows * self.subpixels])
        if self.brown:
            x, y = self._straight(x, y)
        a, b, c, d = (np.array(corner) for corner in self.corners)
        return _share(x, y, a, d, b, c), _share(x, y, a, b, d, c)

    def _straight(self, x, y):
        """Where a lens without distortion shows what is seen, by fixed-point steps."""
        (across, down), half = (np.array(self.size) - 1) / 2, np.hypot(*self.size) / 2
        u = seen_u = (x - across) / half
        v = seen_v = (y - down) / half
        for _ in range(12):
            stretch = 1 + self.brown * (u**2 + v**2)
            u, v = seen_u / stretch, seen_v / stretch
        return across + half * u, down + half * v

    def picture(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Shares of the full scale; `light` is the strip's at many even places, 0 to 1."""
        along, across = self.shares()
        inside = (along > 0) & (along < 1) & (across > 0) & (across < 1)
        places = (np.arange(light.size) + 0.5) / light.size
        seen = np.interp(along, places, light) * (1 + self.uneven * (across - 0.5))
        fine = np.where(inside, seen, self.border)
        columns, rows = self.size
        s = self.subpixels
        return fine.reshape(rows, s, columns, s).mean(axis=(1, 3))


def _share(x, y, p, q, r, s):
    """From 0 on the line p q to 1 on the line r s: f = w a / (w a - b), with the lines' forms.

    a and b vanish on the lines; the weight w makes opposite edges run evenly in the plane.
    """

    def form(first, second):
        return np.cross([*first, 1.0], [*second, 1.0])

    zero, one = form(p, q), form(r, s)
    vanishing = np.cross(form(p, r), form(q, s))  # where the other two edges meet
    # the line at infinity of the plane is a combination of both lines; it holds the point where
    # these two meet anyway, and the other vanishing point says which one
    weight = -(zero @ vanishing) / (one @ vanishing)
    a = zero[0] * x + zero[1] * y + zero[2]
    b = one[0] * x + one[1] * y + one[2]
    return a / (a + weight * b)
