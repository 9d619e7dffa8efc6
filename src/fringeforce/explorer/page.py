"""What a page of a strip and one of a pad may ask, and who answers."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache, partial

from pydantic import TypeAdapter

from fringeforce.design.files import load_sensor
from fringeforce.design.pad import Pad
from fringeforce.design.shipped import shipped_designs, shipped_pads
from fringeforce.design.strip import Sensor
from fringeforce.explorer import creep, strain, tasks
from fringeforce.explorer.pads import protocol as pads
from fringeforce.explorer.pads import tasks as pad_tasks
from fringeforce.explorer.protocol import (
    STRIP,
    AboutDesign,
    CreepRequest,
    DownloadRequest,
    InsideRequest,
    ReadRequest,
    Request,
    StrainRequest,
)
from fringeforce.explorer.skins import protocol as skins
from fringeforce.explorer.skins import tasks as skin_tasks


class Process(Enum):
    """The processes that compute."""

    DESIGNS = "characterises designs"
    ANSWERS = "answers what a person waits for"
    SLOW = "works out what takes long, and leaves the processor to the others"


@dataclass(frozen=True)
class DesignQuestion:
    """How a question about a design is answered.

    Attributes
    ----------
    answer : str
        Type of the message that answers it.
    task : callable
        From the file of the design's model and the request to the answer.
    process : Process
        Where that is worked out.
    """

    answer: str
    task: Callable[..., tasks.Answer]
    process: Process = Process.ANSWERS


@dataclass(frozen=True)
class Page:
    """One kind of page.

    Attributes
    ----------
    file : str
        HTML file of the page.
    shipped : callable
        Names of the designs that there are to start from.
    understood : TypeAdapter
        What it may ask.
    questions : mapping
        Questions about designs, by the type of the request.
    solution : str
        Module of what the page needs to know of a design.
    remembered : int
        Number of designs whose solutions are kept: undo and comparisons come at once.
    display : str
        Module and class, joined by a colon, of what pages see of a running camera; empty where
        none is shown.
    warm : callable
        What is asked of the first design so that libraries are loaded before anybody waits.
    first : sequence of request
        What is asked before the page may be opened.
    prepare : callable, optional
        What the process of answers does while the first design is solved.
    """

    file: str
    shipped: Callable[[], Collection[str]]
    understood: TypeAdapter[Request]
    questions: Mapping[type[AboutDesign], DesignQuestion]
    solution: str
    remembered: int
    display: str
    warm: Callable[[tasks.Solved], Sequence[AboutDesign]]
    first: Sequence[AboutDesign] = ()
    prepare: Callable[[], object] | None = None


def _strip_warm(solved: tasks.Solved) -> Sequence[AboutDesign]:
    nothing = [[0.0, 0.0]] * len(solved.blocks["tactels"])
    return (
        InsideRequest(type="inside", id=0, design=0),
        ReadRequest(type="read", id=0, design=0, forces=nothing),
    )


@lru_cache(maxsize=3)
def _shipped(listed: Callable[[], Iterable[str]], skin: bool) -> tuple[str, ...]:
    """Names of the shipped strips or pads with a skin, or with tactels."""
    return tuple(name for name in listed() if (load_sensor(name).skin is not None) == skin)


STRIP_PAGE = Page(
    file="index.html",
    shipped=partial(_shipped, shipped_designs, skin=False),
    understood=STRIP,
    questions={
        InsideRequest: DesignQuestion("inside", tasks.inside, Process.DESIGNS),
        ReadRequest: DesignQuestion("reading", tasks.read),
        StrainRequest: DesignQuestion("strain", strain.under_forces, Process.SLOW),
        CreepRequest: DesignQuestion("creep", creep.over_time, Process.SLOW),
        DownloadRequest: DesignQuestion("file", tasks.file),
    },
    solution="fringeforce.explorer.solution",
    remembered=6,
    display="fringeforce.explorer.strip_live:StripDisplay",
    warm=_strip_warm,
)
PAD_PAGE = Page(
    file="pad.html",
    shipped=shipped_pads,
    understood=pads.PAD,
    questions={
        pads.PressRequest: DesignQuestion("picture", pad_tasks.press),
        pads.SlicesRequest: DesignQuestion("slices", pad_tasks.slices),
        pads.PadReadRequest: DesignQuestion("reading", pad_tasks.read, Process.SLOW),
        pads.PadDownloadRequest: DesignQuestion("file", pad_tasks.file, Process.SLOW),
    },
    solution="fringeforce.explorer.pads.solution",
    remembered=4,
    display="fringeforce.explorer.pads.live:PadDisplay",
    warm=lambda _: (pads.PadReadRequest(type="read", id=0, design=0, contacts=[]),),
    first=(pads.PressRequest(type="press", id=0, design=0, contacts=[], fine=False),),
    prepare=pad_tasks.prepare,
)
SKIN_PAGE = Page(
    file="skin.html",
    shipped=partial(_shipped, shipped_designs, skin=True),
    understood=skins.SKIN,
    questions={
        skins.SkinReadRequest: DesignQuestion("reading", skin_tasks.read),
        skins.SkinStrainRequest: DesignQuestion("strain", strain.under_fingers, Process.SLOW),
        skins.SkinDownloadRequest: DesignQuestion("file", skin_tasks.file),
    },
    solution="fringeforce.explorer.skins.solution",
    remembered=6,
    display="",
    warm=lambda _: (skins.SkinReadRequest(type="read", id=0, design=0, contacts=[]),),
)


PAGES = {
    ("strip", False): STRIP_PAGE,
    ("strip", True): SKIN_PAGE,
    ("pad", False): PAD_PAGE,
    ("pad", True): PAD_PAGE,
}
"""Pages by the kind of sensor and whether it has a skin."""


def page_of(sensor: Sensor | Pad) -> Page:
    """The page that shows a sensor."""
    return PAGES[sensor.kind, sensor.skin is not None]
