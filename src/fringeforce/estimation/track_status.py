"""What becomes of a frame that was followed: whether it, and the way to it, leave a doubt.

One frame decides where its own top of the likelihood lies well short of half the way to any mirror
image.  Where it does not, the mean of the last frames decides, or the last search; and the word of
a search grows old.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import inner
from fringeforce.estimation.evaluation import BENT, GAIN, GROUPED, OUTLIERS, PROMISED, SQUARES, WEAK
from fringeforce.estimation.gauss_newton import CLOSE
from fringeforce.estimation.running_mean import FRAMES, uncertainty
from fringeforce.estimation.strip import Strip

Array = NDArray[np.float64]

FOLLOWED, SILENT, DOUBTFUL, HELD, UNSETTLED = range(5)
"""What becomes of a frame: explained; explained by no load at all; left to a search; explained, by
what the last search settled on; and explained by one of several loads that it left open."""
OPEN, FRESHLY, AGAIN, LENGTH, LEFT, RAISED, LOOKED, HUSHED, SEEN = range(9)
"""What is known since the last search: whether it left open which of several loads; whether
nothing has been surer since, and whether the doubt lasts; for how many frames it need not be done
again, and how many of them are left; frames in a row that were louder than silence; frames for
which errors of the model need no new look; frames in a row that were no louder than silence; and
the bend of one deviation, in margins, in the first frame after it."""
KNOWN = 9
SPELL, HUSH = 128.0, 32.0
"""Frames until a search is due again at first: about loads, and about silence."""
WORD = 32.0
"""Frames for which the word of a search, or of the last frame that was sure, holds."""
HOLDS, STAYS = 512.0, 4096.0
"""And at most, if doubt lasts and the spell doubles: where a search was sure, and where not."""
JUMP = 0.25
"""Bend of the way from one frame to the next, beyond which it may have led to a mirror image."""
MARGIN = 6.0
"""Deviations that must stay short of half the way to the nearest mirror image."""
NOISE, ORDER, QUIET = 6.0, 4.0, 2.5
"""Deviations of pure noise that are allowed: for the residuals' sum of squares; for that of sums
over neighbours, beyond which a search looks for errors of the model; and for either at silence."""
LEAP = 9.0
"""Squared deviations for each load that one frame may lie from the mean of those before."""
CALM, ROUGH = 0.15, 0.3
"""Shares of that margin below which a frame's own top is climbed, and above which a step is taken
from the mean instead."""
LOST, NEAR = 1.5, 0.5
"""Shares of it, by the mean's own deviation, beyond which the branch is no longer known, and below
which it is worth a search to know it again."""
PAUSE, FEW = 0.25, 8
"""Share of a spell without a search at least; frames after which the mean is surer than one."""
CONTACT = 6.0
"""Deviations of pure noise by which loads must beat silence."""
HUSHES = 16
"""Frames that do not, after which nothing is followed any more."""
CLEARER = 0.5
"""Factor to which that bend has to fall for a search to be worth more than the last one."""


@dataclass(frozen=True)
class Limits:
    """Degrees of freedom, from which the limits of noise follow.

    Attributes
    ----------
    pixels, groups : float
        Of residuals and of their sums over neighbours, under loads.
    loads : int
        Number of loads.
    still : float
        Of the sums where nothing is fitted.
    """

    pixels: float
    groups: float
    loads: int
    still: float

    @classmethod
    def of(cls, strip: Strip, taken: float) -> Limits:
        """Of a strip, where a fit takes so much from the sums; see `goodness.absorbed`."""
        return cls(
            float(max(strip.pixels - strip.loads, 1)),
            float(max(strip.groups - taken, 1)),
            strip.loads,
            float(strip.groups),
        )

    @property
    def numbers(self) -> tuple[float, float, int, float]:
        """What the compiled functions take."""
        return self.pixels, self.groups, self.loads, self.still


def begin(known: Array, unsettled: bool, silent: bool) -> None:
    """Begin what is known after a search."""
    again, length = known[AGAIN], 2 * known[LENGTH]
    spell = min(length, STAYS if unsettled else HOLDS) if again else SPELL
    spell = HUSH if silent else spell
    known[:] = unsettled, not silent, not silent, spell, spell, 0, SPELL, 0, 0


@inner
def verdict(report, limits, order) -> int:
    """What becomes of a frame, from what `follow` reported."""
    pixels, groups, size, _ = limits
    if not report[PROMISED] <= CLOSE or not looks_like_noise(report, pixels, groups, NOISE, order):
        return DOUBTFUL
    if report[GAIN] <= size + CONTACT * sqrt(2 * size):
        return SILENT
    if not report[BENT] <= JUMP or not 2 * MARGIN * report[WEAK] <= ROUGH:
        return DOUBTFUL
    return FOLLOWED


@inner
def rests(report) -> bool:
    """Whether a frame is so sure that those after it need no mean."""
    return 2 * MARGIN * report[WEAK] < CALM


@inner
def steady_verdict(report, limits, mean, known, order) -> int:
    """What becomes of a frame, from what `step_steadily` reported."""
    pixels, groups, size, _ = limits
    if not looks_like_noise(report, pixels, groups, NOISE, order):
        return DOUBTFUL
    # a step that is long, or so bent that it does not end at the top
    if not report[PROMISED] <= LEAP * size or not report[BENT] ** 2 * report[PROMISED] <= size:
        return DOUBTFUL
    bend = 2 * MARGIN * report[WEAK]
    if known[SEEN] == 0:
        known[SEEN] = bend
    if report[GAIN] <= size + CONTACT * sqrt(2 * size):
        # what comes out of the silence may be any mirror image of what went in
        known[OPEN], known[LEFT] = 1, known[LEFT] - 1
        return SILENT
    near = bend * uncertainty(mean)
    if not known[OPEN] and known[LEFT] == known[LENGTH] and near <= LOST:
        if known[FRESHLY] and mean[FRAMES] < FEW:
            return HELD
        trust(known)
        return FOLLOWED
    known[LEFT] -= 1
    # back from where the way may have led to a mirror image, or too long there
    paused = known[LEFT] < (1 - PAUSE) * known[LENGTH] or bend <= CLEARER * known[SEEN]
    if known[LEFT] < 0 or (near <= NEAR and paused):
        return DOUBTFUL
    # its word holds for a while, and then nothing does until the next
    return UNSETTLED if known[OPEN] or known[LENGTH] - known[LEFT] > WORD else HELD


@inner
def trust(known) -> None:
    """Take a frame as surer than the last search."""
    known[FRESHLY], known[AGAIN], known[LENGTH], known[LEFT] = 0, 0, SPELL, SPELL


@inner
def looks_like_noise(report, pixels, groups, wide, narrow) -> bool:
    """Whether residuals are as small and as unordered as noise; see `goodness.is_noise`."""
    return (
        report[SQUARES] < pixels + wide * sqrt(2 * pixels)
        and report[GROUPED] < groups + narrow * sqrt(2 * groups)
        and report[OUTLIERS] == 0
    )
