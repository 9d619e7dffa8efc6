"""Shares of cross-talk that frames told, as a design allows them."""

from __future__ import annotations

from collections.abc import Mapping

from fringeforce.design.light import MOST_CROSSTALK, Polariscope, pairs_of_channels


def allowed_shares(light: Polariscope, found: Mapping[str, float]) -> dict[str, float]:
    """Shares as found, none below zero; of a channel that would be one of others, as drawn.

    Frames that no model explains may tell of shares that no design allows.

    Parameters
    ----------
    light : Polariscope
        As drawn, with cross-talk.
    found : mapping
        Shares by path.
    """
    allowed = {path: max(float(share), 0.0) for path, share in found.items()}
    pairs = pairs_of_channels(len(light.pictures))
    for number, drawn in enumerate(light.crosstalk):
        own = {path: drawn[pairs[path][1]] for path in found if pairs[path][0] == number}
        if sum(drawn) + sum(allowed[path] - own[path] for path in own) >= MOST_CROSSTALK:
            allowed |= own
    return allowed
