"""What becomes of a frame that was followed: whether it, and the way to it, leave a doubt.

One frame decides where its own top of the likelihood lies well short of half the way to any mirror
image.  Where it does not, the mean of the last frames decides, or the last search; and the word of
a search grows old.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import inner
from fringeforce.estimation.gauss_newton import CLOSE
from fringeforce.estimation.residual_test import FALSE_ALARM, FALSE_CONTACT, PLAIN, square_limit
from fringeforce.estimation.running_mean import uncertainty
from fringeforce.estimation.strip import Strip

FOLLOWED, SILENT, DOUBTFUL, HELD, UNSETTLED = range(5)
"""What becomes of a frame: explained; explained by no load at all; left to a search; explained, by
what the last search settled on; and explained by one of several loads that it left open."""
KNOWN = np.dtype(
    [(name, "?") for name in ("open", "freshly", "again")]
    + [(name, "f8") for name in ("interval", "left", "raised", "looked", "hushed", "seen")],
    align=True,
)
"""What is known since the last search: whether it left open which of several loads; whether
nothing has been surer since, and whether the doubt lasts; for how many frames it need not be done
again, and how many of them are left; frames in a row that were louder than silence; frames for
which errors of the model need no new look; frames in a row that were no louder than silence; and
the bend of one deviation, in margins, in the first frame after it."""
SEARCH_INTERVAL, SILENT_INTERVAL = 128.0, 32.0
"""Frames until a search is due again at first: about loads, and about silence."""
WORD = 32.0
"""Frames for which the word of a search, or of the last frame that was sure, holds."""
HOLDS, STAYS = 512.0, 4096.0
"""And at most, if doubt lasts and the spell doubles: where a search was sure, and where not."""
JUMP = 0.25
"""Bend of the way from one frame to the next, beyond which it may have led to a mirror image."""
MARGIN = 6.0
"""Deviations that must stay short of half the way to the nearest mirror image."""
WATCHED = 3e-4
"""Chance of noise in the sums over neighbours below which a search looks for errors of a model."""
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
SILENT_FRAMES = 16
"""Frames that do not, after which nothing is followed any more."""
CLEARER = 0.5
"""Factor to which that bend has to fall for a search to be worth more than the last one."""


class Limits(NamedTuple):
    """Limits of noise; see `residual_test`.

    Attributes
    ----------
    loads, pixels, groups : float
        Number of loads; degrees of freedom of residuals and of their sums over neighbours.
    squares, sums, watched : float
        Of squared residuals; of squared sums, for good and for the time being.
    contact : float
        Of the gain over silence.
    quiet, quiet_sums, loud, loud_sums : float
        Of both where nothing is fitted: below the first silence is plain, beyond the last none.
    """

    loads: float
    pixels: float
    groups: float
    squares: float
    sums: float
    watched: float
    contact: float
    quiet: float
    quiet_sums: float
    loud: float
    loud_sums: float

    @classmethod
    def of(cls, strip: Strip, taken: float) -> Limits:
        """Of a strip, where a fit takes so much from the sums; see `residual_test.absorbed`."""
        loads, all_pixels, all_groups = float(strip.loads), strip.pixels, strip.groups
        pixels, groups = max(all_pixels - loads, 1.0), float(max(all_groups - taken, 1))
        return cls(
            loads=loads,
            pixels=pixels,
            groups=groups,
            squares=square_limit(pixels),
            sums=square_limit(groups),
            watched=square_limit(groups, WATCHED),
            contact=square_limit(loads, FALSE_CONTACT),
            quiet=square_limit(pixels + loads, PLAIN),
            quiet_sums=square_limit(all_groups, PLAIN),
            loud=square_limit(pixels + loads, FALSE_ALARM),
            loud_sums=square_limit(all_groups, WATCHED),
        )


def begin(known: NDArray[np.void], unsettled: bool, silent: bool) -> None:
    """Begin what is known, shape (1,), after a search."""
    again, length = known["again"][0], 2 * known["interval"][0]
    interval = min(length, STAYS if unsettled else HOLDS) if again else SEARCH_INTERVAL
    interval = SILENT_INTERVAL if silent else interval
    known[0] = unsettled, not silent, not silent, interval, interval, 0, SEARCH_INTERVAL, 0, 0


@inner
def verdict(report, limits, sums) -> int:
    """What becomes of a frame, from what `follow` reported; with the limit of the sums."""
    if not report.promised <= CLOSE or not looks_like_noise(report, limits.squares, sums):
        return DOUBTFUL
    if report.gain <= limits.contact:
        return SILENT
    if not report.bent <= JUMP or not 2 * MARGIN * report.weak <= ROUGH:
        return DOUBTFUL
    return FOLLOWED


@inner
def rests(report) -> bool:
    """Whether a frame is so sure that those after it need no mean."""
    return 2 * MARGIN * report.weak < CALM


@inner
def steady_verdict(report, limits, mean, known, sums) -> int:
    """What becomes of a frame, from what `step_steadily` reported; with the limit of the sums."""
    if not looks_like_noise(report, limits.squares, sums):
        return DOUBTFUL
    # a step that is long, or so bent that it does not end at the top
    size = limits.loads
    if not report.promised <= LEAP * size or not report.bent**2 * report.promised <= size:
        return DOUBTFUL
    relative_curvature = 2 * MARGIN * report.weak
    if known.seen == 0:
        known.seen = relative_curvature
    if report.gain <= limits.contact:
        # what comes out of the silence may be any mirror image of what went in
        known.open, known.left = True, known.left - 1
        return SILENT
    near = relative_curvature * uncertainty(mean)
    if not known.open and known.left == known.interval and near <= LOST:
        if known.freshly and mean.frames < FEW:
            return HELD
        trust(known)
        return FOLLOWED
    known.left -= 1
    # back from where the way may have led to a mirror image, or too long there
    paused = known.left < (1 - PAUSE) * known.interval or relative_curvature <= CLEARER * known.seen
    if known.left < 0 or (near <= NEAR and paused):
        return DOUBTFUL
    # its word holds for a while, and then nothing does until the next
    return UNSETTLED if known.open or known.interval - known.left > WORD else HELD


@inner
def trust(known) -> None:
    """Take a frame as surer than the last search."""
    known.freshly, known.again, known.interval, known.left = (
        False,
        False,
        SEARCH_INTERVAL,
        SEARCH_INTERVAL,
    )


@inner
def looks_like_noise(report, squares, sums) -> bool:
    """Whether residuals are as small and as unordered as noise; see `residual_test.is_noise`."""
    return report.squares < squares and report.sums < sums and report.outliers == 0
