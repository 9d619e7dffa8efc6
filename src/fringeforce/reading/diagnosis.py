"""What may be wrong with a sensor whose frame nothing explains: the likeliest departure.

Departures are added to what the design states one after the other, and the evidence of each weighs
how well it explains the frame against how much it could explain (MacKay, Neural Computation 4,
415-447, 1992).  Loads start from the phase that a reading finds which allows for everything at
once: a sensor that departs is read at the wrong orders otherwise, where nothing explains anything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fringeforce.design.light import light_of_channels, pairs_of_channels
from fringeforce.design.tolerances import Tolerances, with_values
from fringeforce.estimation.frame_exposure import (
    expose,
)
from fringeforce.estimation.hypotheses import SAME_PHASE
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.estimation.residual_test import FALSE_VERDICT, NEARLY_EXPLAINED
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, WIDTH
from fringeforce.models.departures import (
    BLUR,
    LEAK,
    SCATTER,
    Departure,
    Departures,
    drawn_value,
)
from fringeforce.models.strip import characterize
from fringeforce.reading.departure_fit import DepartureFit, Fit, begin, distinct
from fringeforce.reading.findings import (
    FOLLOWED,
    HOPELESS,
    MOST_NAMED,
    PARTLY,
    RIVAL,
    UNEXPLAINED,
    covered,
    sentence,
    together,
)
from fringeforce.reading.hidden_stretches import PARTS, WHOLE, HiddenStretches, hidden_stretches
from fringeforce.reading.posterior_search import FIRST_EFFORTS
from fringeforce.reading.strip_reader import StripFrameReader

Array = NDArray[np.float64]

WIDER = {"camera.amplitude": 0.05, "polariscope.visibility": 0.05, RESIDUAL: 0.1}
"""Deviations of a reading that allows for everything; the first is relative."""
ALLOWED_WIDTH = 0.3
"""The same of widths of contacts over their spacing; point spread and places are as departures."""
BRIGHTEST, LAMP_STEP = 0.98, 0.1
"""Share of the pixels below which fringes are as bright as they can be, and the step in which the
lamp is then taken for another one: within half of it the search finds the light."""
PHASES = 3
"""Explanations of it that are tried."""
ACCURACY = 2e-4
"""Relative accuracy of the phase; departures of one number that differ less look the same."""
SWEEPS = 2
"""Rounds in which the sizes of departures that are named together are corrected."""
SURELY = 3.0
"""Standard deviations of a departure below which it is not what a frame is refused for."""
UNMENDABLE = 2.0
"""Reduced chi-square beyond which mirror images do not mend a phase."""


@dataclass(frozen=True)
class Allowance:
    """What a reading allows for.

    Attributes
    ----------
    offset : float
        Place of all contacts beside their tactels, over their spacing.
    blur : float
        Point spread beyond what is drawn [pixels].
    contacts : bool
        Whether each has a place and a width of its own.
    light : bool
        Whether amplitude, visibility, residual and cross-talk may be other than drawn.
    brightness : float
        Amplitude over the drawn one.
    """

    offset: float = 0.0
    blur: float = 0.0
    contacts: bool = True
    light: bool = True
    brightness: float = 1.0


ALLOWANCES = (
    Allowance(),
    Allowance(blur=10.0, contacts=False),
    Allowance(blur=10.0, contacts=False, light=False),
    *(Allowance(offset) for offset in (0.5, -0.5, 0.25, -0.25)),
)
"""Readings whose phases are tried, the likeliest first; blur and places beyond three deviations of
the first need readings of their own."""


class _Once:
    """A departure as it began, which climbs to its top once."""

    def __init__(self, fit: DepartureFit) -> None:
        self._fit, self.top = fit, fit.top
        self._found: Fit | None = None

    def finish(self) -> Fit:
        if self._found is None:
            self._found = self._fit.finish()
        return self._found


class Begun:
    """Departures that were begun at one phase of a frame, beside what the design states alone."""

    def __init__(self) -> None:
        self._known: dict[int, DepartureFit] = {}

    def begin(self, posterior: Posterior, departure: Departure, phase: Array) -> DepartureFit:
        """As the function of that name, but what was begun already goes on from there."""
        key = id(departure)  # of a list that lasts as long as the reader
        if key not in self._known:
            self._known[key] = _Once(begin(posterior, departure, phase))
        return self._known[key]


class Diagnosis:
    """Names the departures of one sensor in frames that its reader refuses.

    Parameters
    ----------
    reader : StripFrameReader
        Of the design or the calibrated sensor.
    """

    def __init__(self, reader: StripFrameReader) -> None:
        self.reader = reader
        self.departures = Departures(reader.model, reader.uncertain)
        self._everything: dict[Allowance, StripFrameReader] = {}

    def findings(self, frame: Array) -> tuple[str, ...]:
        """Sentences about a frame: the likeliest departure, or that there is none.

        Parameters
        ----------
        frame : ndarray, shape (P,)
            Grey levels; not finite where a pixel is not used.
        """
        close, begun = list[Array](), Begun()
        first = hidden_stretches(self.reader, frame, WHOLE)

        @cache
        def hidden() -> HiddenStretches | None:
            found = first, hidden_stretches(self.reader, frame, PARTS)
            return max(filter(None, found), key=lambda one: one.evidence, default=None)

        fits = self.fits(frame, close, begun, hidden)
        explained = bool(fits) and fits[0].explains(FALSE_VERDICT)
        covering = first if explained and fits[0].significance > SURELY else hidden()
        likelier = covering is not None and (not fits or covering.evidence > fits[0].evidence)
        if explained and not likelier:
            named = [fits[0], *(fit for fit in fits[1:] if _alike(fits[0], fit))]
            return (sentence(named, self.reader.model),)
        several = self._together(frame, close[0], begun) if close and not likelier else []
        if len(several) == 1:
            return (sentence(several, self.reader.model),)
        said = [together(several, self.reader.model)] if several else []
        if covering is not None:
            said.append(covered(covering.pixels, self.reader.model.sensor))
        if said:
            return tuple(said)
        if fits and fits[0].near(PARTLY):
            return (sentence(fits[:1], self.reader.model, explained=False),)
        return (UNEXPLAINED,)

    def fits(
        self,
        frame: Array,
        close: list[Array] | None = None,
        begun: Begun | None = None,
        hidden: Callable[[], HiddenStretches | None] = lambda: None,
    ) -> list[Fit]:
        """Every departure at its best, the likeliest first.

        Parameters
        ----------
        frame : ndarray, shape (P,)
            As of `findings`.
        close : list, optional
            Filled with phases that explain the frame if everything is allowed for [rad].
        begun : Begun, optional
            Filled with the departures as they begin at the first of these phases.
        hidden : callable, optional
            Looks for what explains the frame but for some stretches, and knows it from then on.
        """
        close = [] if close is None else close
        begun = Begun() if begun is None else begun
        posterior = self.reader.own_posterior(frame)
        best: dict[int, Fit] = {}
        for phase in distinct(self._phases(frame, best, close, hidden), SAME_PHASE):
            first = bool(close) and phase is close[0]
            started = [
                (number, (begun.begin if first else begin)(posterior, departure, phase))
                for number, departure in enumerate(self.departures.all)
            ]
            least = min(fit.top.loss for _, fit in started)
            for number, fit in sorted(started, key=lambda one: one[1].top.loss):
                if best and fit.top.loss > HOPELESS * least:
                    continue
                found = fit.finish()
                least = min(least, found.top.loss)
                if number not in best or found.evidence > best[number].evidence:
                    best[number] = found
            if _likeliest(best).explains(FALSE_VERDICT):
                break
        return sorted(best.values(), key=lambda fit: -fit.evidence)

    def _together(self, frame: Array, phase: Array, begun: Begun) -> list[Fit]:
        """Few departures that explain a frame together, or none.

        Contacts with a place or width each can imitate much, so that others are tried first.
        """
        plain = [
            one for one in self.departures.all if one.one or one.path not in (PLACEMENT, WIDTH)
        ]
        return self._selected(frame, phase, plain, begun) or self._selected(
            frame, phase, list(self.departures.all), begun
        )

    def _selected(
        self, frame: Array, phase: Array, among: list[Departure], begun: Begun
    ) -> list[Fit]:
        """Departures of which the likeliest is added each time, with the sizes corrected after."""
        posterior, chosen = self.reader.own_posterior(frame), list[Fit]()
        for _ in range(MOST_NAMED):
            known = [fit.departure for fit in chosen]
            left = [departure for departure in among if departure not in known]
            started = sorted(
                (
                    (begin if chosen else begun.begin)(posterior, departure, phase)
                    for departure in left
                ),
                key=lambda fit: fit.top.loss,
            )
            found = [fit.finish() for fit in started[:FOLLOWED]]
            best = max(found, key=lambda fit: fit.evidence)
            chosen.append(best)
            for _ in range(SWEEPS if len(chosen) > 1 else 0):
                for place, fit in enumerate(chosen):
                    if fit.departure.one is None:
                        continue
                    more = begin(best.posterior, _beyond(fit), phase).finish()
                    if more.top.loss < best.top.loss:
                        best = more
                        size = fit.size + more.size
                        chosen[place] = replace(
                            fit, size=size, std=more.std, significance=abs(size) / more.std
                        )
            if best.explains(FALSE_VERDICT):
                return sorted(chosen, key=lambda fit: -fit.significance)
            posterior = best.posterior
        return []

    def _phases(
        self,
        frame: Array,
        best: dict[int, Fit],
        close: list[Array],
        hidden: Callable[[], HiddenStretches | None],
    ) -> Iterator[Array]:
        """Phases at the nodes that explain a frame if everything is allowed for.

        No more are tried if hidden stretches explain it better than anything in `best`.  Mirror
        images take seconds; they are tried where that holds nothing close by then.
        """
        missed = list[tuple[Top, Allowance]]()
        for allowance in [*self._another_lamp(frame), *ALLOWANCES]:
            if allowance.offset and self._fixed:
                continue
            reader = self._allowing(allowance)
            posterior, tops = reader.explanations(frame, FIRST_EFFORTS, mend=False)
            for top in tops[:PHASES]:
                if top.square < NEARLY_EXPLAINED * top.count:
                    close.append(posterior.phase(top))
                    yield close[-1]
            if best and (other := hidden()) and other.evidence > _likeliest(best).evidence:
                return
            if tops:
                missed.append((tops[0], allowance))
        if not missed or (best and _likeliest(best).near(NEARLY_EXPLAINED)):
            return
        nearest, least = min(missed, key=lambda one: one[0].loss)
        if nearest.square > UNMENDABLE * nearest.count:
            return
        posterior, tops = self._allowing(least).explanations(frame, FIRST_EFFORTS, mend=True)
        for top in tops[:PHASES]:
            if top.square < NEARLY_EXPLAINED * top.count:
                close.append(posterior.phase(top))
            yield posterior.phase(top)

    def _another_lamp(self, frame: Array) -> list[Allowance]:
        """Readings that take the lamp to be as bright as the brightest pixels, if it is another."""
        model = self.reader.uncertain.frame
        if self.reader.model.imaging is not None:
            return []
        bright = np.nanquantile(frame - model.offset, BRIGHTEST)
        share = float(bright / (model.amplitude.mean() * (1 + model.visibility) / 2))
        steps = round((share - 1) / LAMP_STEP)
        if not steps or not share > 0:
            return []
        return [Allowance(brightness=1 + LAMP_STEP * steps, contacts=own) for own in (False, True)]

    @property
    def _fixed(self) -> bool:
        """Whether contacts cannot be solved for anywhere else."""
        model = self.reader.model
        return not model.sensor.transducer.solved_in_a_plane or model.imaging is not None

    def _allowing(self, allowance: Allowance) -> StripFrameReader:
        """A reader that allows for so much."""
        if allowance not in self._everything:
            model, pitch, pixel = self.reader.model, self.departures.pitch, self.departures.pixel
            sensor = model.sensor
            channels = len(sensor.polariscope.channels)
            lit = ("camera.amplitude", *light_of_channels(channels))
            light = {path: allowance.brightness * drawn_value(sensor, path) for path in lit}
            wide, other = {"camera.blur": BLUR * pixel}, dict[str, float]()
            if allowance.light:
                wide |= WIDER | {path: WIDER[lit[0]] * value for path, value in light.items()}
                wide |= dict.fromkeys(pairs_of_channels(channels), LEAK)
            if sensor.transducer.solved_in_a_plane and allowance.contacts:
                wide |= {PLACEMENT: SCATTER * pitch, WIDTH: ALLOWED_WIDTH * pitch}
            for path, std in sensor.tolerances.items():
                wide[path] = max(std, wide.get(path, 0.0))
            if allowance.offset:
                plain = sensor.model_copy(update={"tolerances": Tolerances()})
                place = sensor.tactels.placement + allowance.offset * pitch
                model = characterize(with_values(plain, {PLACEMENT: place}))
            if allowance.blur:
                other["camera.blur"] = (sensor.camera.blur or 0.0) + allowance.blur * pixel
            if allowance.brightness != 1.0:
                other |= light
            made = with_values(model.sensor, other)
            made = made.model_copy(update={"tolerances": Tolerances(wide)})
            self._everything[allowance] = StripFrameReader(replace(model, sensor=made))
        return self._everything[allowance]


def _beyond(fit: Fit) -> Departure:
    """What departs beyond what was found already."""
    low, high = fit.departure.limits
    limits = min(low - fit.size, 0.0), max(high - fit.size, 0.0)
    return replace(fit.departure, limits=limits, begins=(0.0,))


def _likeliest(fits: dict[int, Fit]) -> Fit:
    return max(fits.values(), key=lambda fit: fit.evidence)


def _alike(best: Fit, other: Fit) -> bool:
    """Whether a frame cannot tell a departure from the likeliest one."""
    if other.evidence > best.evidence - RIVAL:
        return True
    if best.departure.one is None or other.departure.one is None:
        return False
    (level, phase), (beside, _) = (
        expose(fit.posterior.model, fit.top.unknowns) for fit in (best, other)
    )
    model = best.posterior.model
    swing = float(model.amplitude.mean()) * model.visibility / 2
    apart = float(np.sqrt(np.mean(np.square(level - beside))))
    return apart < ACCURACY * swing * float(np.abs(phase).max())
