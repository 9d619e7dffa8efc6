"""The colour in which a screen shows monochromatic light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def light_colour(wavelength: float) -> NDArray[np.float64]:
    """Linear RGB of monochromatic light, brightest channel one, shape (3,).

    Gaussian fits to the CIE 1931 colour matching functions by Wyman, Sloan and Shirley, J. Comput.
    Graph. Tech. 2 (2), 2013; the wavelength is in metres.
    """
    nm = wavelength * 1e9

    def lobe(height: float, centre: float, left: float, right: float) -> float:
        slope = left if nm < centre else right
        return height * np.exp(-0.5 * ((nm - centre) * slope) ** 2)

    xyz = np.array(
        [
            lobe(1.056, 599.8, 1 / 37.9, 1 / 31.0)
            + lobe(0.362, 442.0, 1 / 16.0, 1 / 26.7)
            + lobe(-0.065, 501.1, 1 / 20.4, 1 / 26.2),
            lobe(0.821, 568.8, 1 / 46.9, 1 / 40.5) + lobe(0.286, 530.9, 1 / 16.3, 1 / 31.1),
            lobe(1.217, 437.0, 1 / 11.8, 1 / 36.0) + lobe(0.681, 459.0, 1 / 26.0, 1 / 13.8),
        ]
    )
    to_rgb = np.array(
        [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
    )
    rgb = np.clip(to_rgb @ xyz, 0, None)
    return rgb / rgb.max() if rgb.max() > 0 else np.ones(3)
