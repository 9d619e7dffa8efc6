"""What polarisers and plates make of a double pass: intensities as quadratic forms.

Whatever stands before and behind, natural light that meets c + i (a s1 + b s2) between the two
passes with an intensity that is quadratic in w = (a, b, c), w' Q w with a symmetric Q.  The forms
are scaled like equation (11): a perfect dark field lets through at most one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.design.light import Plates
from fringeforce.optics.jones import Jones, polariser, product
from fringeforce.optics.polariscope import quarter_wave_plates

Arrangement = Literal["dark field", "bright field", "plane", "analyser"]

_PAULI = np.array([[[1j, 0], [0, -1j]], [[0, 1j], [1j, 0]], [[1, 0], [0, 1]]])


def quadratic_form(before: Sequence[Jones], behind: Sequence[Jones]) -> Array:
    """The form Q of an arrangement, shape (3, 3).

    Parameters
    ----------
    before, behind : sequence of ndarray, shape (2, 2)
        Elements in the order in which light meets them.
    """
    entry, leave = product(before), product(behind)
    parts = leave @ _PAULI @ entry
    # natural light is an equal mixture of two states; a perfect polariser's half counts as one
    return np.einsum("kij,lij->kl", parts, parts.conj()).real.round(14)


def arranged(
    arrangement: Arrangement,
    angle: float = 0.0,
    plates: Plates | None = None,
    dispersion: float = 1.0,
) -> Array:
    """The form Q of a usual arrangement, shape (3, 3).

    Parameters
    ----------
    arrangement : str
        "dark field" and "bright field": circular light, analysed circularly, so that directions do
        not count, sin^2 and cos^2 of half the retardance.  "plane": polariser at the angle,
        analyser across it.  "analyser": circular light and an analyser at the angle, which adds a
        quarter wave to a retarder at 45 degrees from it.
    angle : float
        Direction of polariser or analyser, from x [rad].
    plates : Plates, optional
        What is wrong with the elements; they are perfect if not given.
    dispersion : float
        Retardance of plates that are not achromatic, over that at their own wavelength.
    """
    errors = plates or Plates()
    leak = errors.extinction_ratio
    if arrangement == "plane":
        return quadratic_form([polariser(angle, leak)], [polariser(angle + np.pi / 2, leak)])
    first, second = quarter_wave_plates(errors, dispersion)
    before = [polariser(0.0, leak), first]
    if arrangement == "analyser":
        return quadratic_form(before, [polariser(angle, leak)])
    across = 0.0 if arrangement == "bright field" else np.pi / 2
    return quadratic_form(before, [second, polariser(across, leak)])


def signed(forms: Array) -> bool:
    """Whether pictures tell a small stress from its negative, in every direction.

    Parameters
    ----------
    forms : ndarray, shape (n, 3, 3)
        Quadratic forms of all pictures of a frame.
    """
    # near no stress, w = (A, B, 1), the intensity's slope is twice the last column
    return bool(np.linalg.matrix_rank(forms[:, :2, 2], tol=1e-6) == 2)
