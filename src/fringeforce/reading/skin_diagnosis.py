"""What may be wrong with a skin whose frame no contacts explain: the likeliest departure.

The frame is read again by readers that allow for one departure each, generously; the evidence of
each weighs how well it explains the frame against how much it could explain.  A camera that is
shifted does not show: contacts are then read beside where they are.  Or something presses beside
the skin, which a reader of a longer one finds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Mask
from fringeforce.design.light import CROSSTALK, light_of_channels, pairs_of_channels
from fringeforce.design.tolerances import Tolerances
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.departures import (
    BLUR,
    CAMERA_SCALE,
    GAMMA,
    LAMP,
    LAYERS,
    LEAK,
    RETARDANCE,
    VISIBILITY,
    drawn_value,
)
from fringeforce.models.skin import PLACE
from fringeforce.models.strip import characterize
from fringeforce.reading.findings import RIVAL, UNEXPLAINED, sentence
from fringeforce.reading.posterior_search import Effort
from fringeforce.reading.skin_fit import Explanation
from fringeforce.reading.skin_reader import SkinReader
from fringeforce.reading.skin_search import EFFORTS, FIRST

BRIGHTNESS = 2 * LAMP
"""Standard deviation of the amplitude, relative: twice that of strips, for the search takes light
from the extremes of a frame, and not where these are far from what is expected."""
BESIDE = (
    "A contact at {place:.2g} mm explains this frame, beside the skin, which ends at {end:.3g} mm; "
    "press nearer to the middle, or give the skin a larger extent."
)


@dataclass(frozen=True)
class SkinDeparture:
    """What departs; a number, unless it is a residual or cross-talk."""

    path: str
    relative: bool

    @property
    def one(self) -> bool:
        """Whether it is one number."""
        return self.path not in (RESIDUAL, CROSSTALK)


@dataclass(frozen=True, eq=False)
class SkinFit:
    """A departure as a frame shows it.

    Attributes
    ----------
    departure : SkinDeparture
        What departs.
    size : float
        By how much, relative to the design's value where it is stated so.
    significance : float
        Standard deviations between this and the design.
    evidence : float
        Logarithm of the probability of the frame.
    """

    departure: SkinDeparture
    size: float
    significance: float
    evidence: float


class SkinDiagnosis:
    """Names the departures of one skin in frames that its reader refuses.

    Parameters
    ----------
    reader : SkinReader
        Of the design.
    """

    def __init__(self, reader: SkinReader) -> None:
        self.reader = reader

    @cached_property
    def _allowing(self) -> list[tuple[SkinDeparture, float, SkinReader]]:
        """Departures, their standard deviations before a frame, and readers that allow for each."""
        model = self.reader.model
        sensor, camera = model.sensor, model.sensor.camera
        pixel = sensor.transducer.length / camera.pixels
        # what contacts cannot imitate first: an explanation helps to find the others
        stds = {"polariscope.visibility": (VISIBILITY, False), "camera.gamma": (GAMMA, False)}
        stds |= {"camera.blur": (BLUR * pixel, False), "camera.amplitude": (BRIGHTNESS, True)}
        channels = len(sensor.polariscope.channels)
        stds |= dict.fromkeys(light_of_channels(channels), (BRIGHTNESS, True))
        stds |= {CROSSTALK: (LEAK, False)} if channels > 1 else {}
        stds |= {RESIDUAL: (RETARDANCE, False), "camera.scale": (CAMERA_SCALE, False)}
        stds |= {path: (share, True) for path, share in LAYERS.items()}
        found = list[tuple[SkinDeparture, float, SkinReader]]()
        for path, (std, relative) in stds.items():
            wide = std * drawn_value(sensor, path) if relative else std
            paths = pairs_of_channels(channels) if path == CROSSTALK else [path]
            stated = {**sensor.tolerances, **dict.fromkeys(paths, wide)}
            made = sensor.model_copy(update={"tolerances": Tolerances(stated)})
            reader = replace(self.reader, model=replace(model, sensor=made))
            found.append((SkinDeparture(path, relative), std, reader))
        return found

    def findings(self, levels: NDArray[Any], used: Mask) -> tuple[str, ...]:
        """Sentences about a frame: the likeliest departure, or that there is none.

        Parameters
        ----------
        levels : ndarray, shape (P,)
            Grey levels.
        used : ndarray of bool, shape (P,)
            Pixels that count.
        """
        for efforts in (FIRST, EFFORTS):
            beside = self._beside(levels, used, efforts)
            fits = self.fits(levels, used, efforts, explained=beside is not None)
            found = [one.evidence for one in (beside, *fits) if one is not None]
            if found:
                break
        else:
            return (UNEXPLAINED,)
        said, least = list[str](), max(found) - RIVAL
        if beside is not None and beside.evidence > least:
            places = beside.contacts.geometry[:, PLACE]
            place, end = places[np.abs(places).argmax()], self.reader.skin.half
            said.append(BESIDE.format(place=1e3 * place, end=1e3 * np.copysign(end, place)))
        if named := [fit for fit in fits if fit.evidence > least]:
            said.append(sentence(named, self.reader.model))
        return tuple(said)

    def _beside(
        self, levels: NDArray[Any], used: Mask, efforts: tuple[Effort, ...]
    ) -> Explanation | None:
        """What explains a frame with a contact beside the skin, if it can and nothing departs."""
        if self._longer is None:
            return None
        one = self._longer.likeliest(levels, used, efforts=efforts)
        if one is None or np.abs(one.contacts.geometry[:, PLACE]).max() <= self.reader.skin.half:
            return None
        return one

    @cached_property
    def _longer(self) -> SkinReader | None:
        """What reads a skin that goes on to the ends of the strip, but for a cover's thickness.

        None if the skin does, or if the strip was calibrated, which tells nothing beside the skin.
        """
        model = self.reader.model
        skin, transducer = model.sensor.skin, model.sensor.transducer
        assert skin is not None
        longest = transducer.length - 2 * transducer.compliant.thickness
        if longest <= skin.extent or model.imaging is not None:
            return None
        longer = skin.model_copy(update={"extent": longest})
        return replace(self.reader, model=characterize(model.sensor.replace(skin=longer)))

    def fits(
        self,
        levels: NDArray[Any],
        used: Mask,
        efforts: tuple[Effort, ...] = EFFORTS,
        explained: bool = False,
    ) -> list[SkinFit]:
        """Departures that explain a frame, the likeliest first; some if something else does."""
        # layers take seconds to solve, and seldom explain what others do
        quick = [own for own in self._allowing if own[0].path not in LAYERS]
        for first in quick if explained or efforts is not EFFORTS else self._allowing:
            one = first[2].likeliest(levels, used, None, efforts)
            if one is not None:
                break
        else:
            return []
        fits = [_fit(*first, one)]
        for other in quick:
            if other is not first:  # its contacts are near these
                again = other[2].likeliest(levels, used, one.contacts)
                fits += [] if again is None else [_fit(*other, again)]
        return sorted(fits, key=lambda fit: -fit.evidence)


def _fit(departure: SkinDeparture, std: float, reader: SkinReader, one: Explanation) -> SkinFit:
    """Size and significance of a departure in an explanation that allows for it."""
    at, path = one.posterior.model.at, departure.path
    if path == RESIDUAL:
        where = np.arange(at.modes - len(reader.uncertain.frame.fields), at.modes)
    elif path in (groups := {
        "polariscope.visibility": at.visibility, "camera.blur": at.blur, "camera.gamma": at.gamma
    }):  # fmt: skip
        where = np.array([groups[path]])
    elif path == CROSSTALK:
        where = np.arange(at.crosstalk, at.size)
    else:
        names = [mode.name for mode in reader.uncertain.modes]
        where = np.array([at.modes + names.index(path)])
    e = one.top.unknowns[where]
    spread = one.posterior.spread(one.top)[np.ix_(where, where)]
    significance = float(np.sqrt(e @ np.linalg.solve(spread, e)))
    if path == RESIDUAL:
        profile = e @ one.posterior.model.fields[where - at.fields]
        return SkinFit(departure, float(np.sqrt(np.mean(profile**2))), significance, one.evidence)
    if path == CROSSTALK:
        size = float(np.sqrt(np.mean(np.square(e)))) * std
        return SkinFit(departure, size, significance, one.evidence)
    return SkinFit(departure, float(e[0]) * std, significance, one.evidence)
