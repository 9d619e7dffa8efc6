"""Cross-talk between the channels of a camera, as shares of light and fringes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.design.light import Polariscope, pairs_of_channels
from fringeforce.optics.polariscope import pictures


class Crosstalk(NamedTuple):
    """Cross-talk between channels, as of `FrameModel`.

    Attributes
    ----------
    shares : ndarray, shape (C, C + 1)
        Of the light of every channel in the fringes of each, and what is added to them; shape
        (0, 1) without cross-talk.
    leaks : ndarray, shape (k, C, C + 1)
        What a standard deviation of each uncertain share changes.
    """

    shares: Array
    leaks: Array

    @classmethod
    def of(cls, light: Polariscope, std: Mapping[str, float]) -> Crosstalk:
        """Of a polariscope and the tolerances of its design.

        Plates that are no quarter wave for all channels make the fringes of some weaker and leave
        light without fringes, so that a share of the light is not one of the fringes.

        Parameters
        ----------
        light : Polariscope
            With its channels.
        std : mapping
            Standard deviations by dotted path.
        """
        seen = pictures(light.model_copy(update={"visibility": 1.0}))
        count, pairs = len(seen), pairs_of_channels(len(seen))
        uncertain = {path: pair for path, pair in pairs.items() if std.get(path)}
        shares = light.channel_shares
        if not (len(shares) or uncertain):
            return cls(np.empty((0, 1)), np.empty((0, 0, 1)))
        shares = shares if len(shares) else np.eye(count)
        changes = np.zeros((len(uncertain), count, count))
        for change, (path, (c, d)) in zip(changes, uncertain.items(), strict=True):
            change[c, d], change[c, c] = std[path], -std[path]
        strength = np.array([one.fringe.amplitude for one in seen])
        mean = strength + 2 * np.array([one.fringe.offset for one in seen])
        whole = (shares @ strength)[:, None]
        added = -(changes @ mean)[..., None] / (whole * light.visibility)
        return cls(
            np.pad(shares * strength / whole, ((0, 0), (0, 1))),
            np.concatenate([changes * strength / whole, added], axis=2),
        )
