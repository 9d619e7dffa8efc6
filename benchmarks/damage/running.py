"""Ways of running: pickles and copies, forked and spawned processes, threads on one reader."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import fringeforce as ff
from damage.arrays import PATH
from damage.counting import Case

MOST = 4
"""Pickled readings over their own arrays: none carries the model or the reader it came from."""
PATIENCE = 60
"""Seconds for a process to read two frames."""


@dataclass
class Kind:
    """A model of some kind, frames of one load, and what is told with each of them."""

    model: Any
    frames: NDArray
    told: list[dict[str, float]] = field(default_factory=lambda: [{}] * 4)

    def reader(self) -> ff.Reader:
        """A new reader of the model."""
        return ff.Reader(self.model)


def _kinds() -> dict[str, Callable[[], Kind]]:
    def strip(**more: Any) -> ff.Sensor:
        return ff.load_sensor("saad").replace(**{"camera.pixels": 512, **more})

    forces = ff.polar(1.0, 10, n=11)

    def held(sensor: ff.Sensor) -> Kind:
        model = ff.characterize(sensor)
        return Kind(model, model.expose([forces] * 4, rng=0))

    def calibrated() -> Kind:
        model = ff.characterize(strip())
        loads = np.random.default_rng(0).uniform(0.1, 1.5, (8, 11, 2)) * [1.0, 0.2]
        known = ff.calibrate(strip(), model.expose(loads, rng=1), loads, [PATH], aside=0)
        return Kind(known, model.expose([forces] * 4, rng=0))

    def creeping() -> Kind:
        model = ff.characterize(strip(**{"transducer.relaxation": [(0.06, 0.4), (0.04, 15.0)]}))
        times = np.arange(4) / 10
        frames = model.expose([forces] * 4, rng=0, times=times)
        return Kind(model, frames, [{"time": float(time)} for time in times])

    def pressed(name: str, force: float, **changes: Any) -> Kind:
        model = ff.characterize(ff.load_sensor(name).replace(**changes))
        press = ff.Press(x=0.7e-3, normal=force, tangential=0.0, radius=8e-3)
        return Kind(model, np.stack([model.expose([press], rng=seed) for seed in range(4)]))

    def pad() -> Kind:
        drawn = ff.load_sensor("pad").replace(
            tactels={"count": [3, 3]}, camera={"pixels": [64, 64]}
        )
        model, loads = ff.characterize(drawn), np.zeros((9, 3))
        loads[4, 0] = 2.0
        return Kind(model, model.expose([loads] * 4, rng=0))

    def pad_skin() -> Kind:
        model = ff.characterize(ff.load_sensor("pad-skin"))
        ball = ff.Press(x=1.3e-3, y=-2.2e-3, normal=5.0, tangential=(1.0, 0.5), radius=6e-3)
        return Kind(model, np.stack([model.expose([ball], rng=seed) for seed in range(4)]))

    finite = {"transducer.strain": "finite", "tactels.contact_width": 0.5e-3}
    uncertain = {"tactels.placement": "0 +/- 0.1 mm", "camera.drift": "1 %"}
    channels = {"polariscope.channels": [{"bias": 0}, {"bias": 90}]}
    return {
        "strip": lambda: held(strip()),
        "strip with tolerances": lambda: held(strip(**uncertain)),
        "channels": lambda: held(strip(**channels)),
        "calibrated strip": calibrated,
        "strip that relaxes": creeping,
        "finite strain": lambda: held(strip(**finite)),
        "skin": lambda: pressed("skin", 0.7, **{"camera.pixels": 512}),
        "soft skin": lambda: pressed("soft-skin", 0.3),
        "pad": pad,
        "pad skin": pad_skin,
    }


def _numbers(reading: ff.Reading) -> dict[str, Any]:
    """All that a reading says."""
    names = "forces", "std", "covariance", "phase", "chi2", "status", "detail", "alternatives"
    found = {name: getattr(reading, name) for name in (*names, "probability", "findings")}
    resultants = [one for one in (reading.total, *reading.contacts) if one is not None]
    for number, one in enumerate(resultants):
        found |= {f"force {number}": one.force, f"place {number}": one.place}
    if reading.traction is not None:
        found |= {"traction": reading.traction.values, "its std": reading.traction.std}
    return found


def _same(ours: ff.Reading, theirs: ff.Reading) -> None:
    """Raise unless two readings say the same, to the last digit."""
    good = _numbers(theirs)
    found = _numbers(ours)
    assert found.keys() == good.keys(), f"{sorted(found)} in the place of {sorted(good)}"
    for name, value in good.items():
        np.testing.assert_array_equal(found[name], value, err_msg=f"another {name}")


def _read(model: Any, frame: NDArray, told: dict[str, float]) -> ff.Reading:
    """What a process of its own does with a model."""
    return ff.Reader(model).read(frame, **told)


def _answer(pipe: Any, model: Any, frame: NDArray, told: dict[str, float]) -> None:
    pipe.send(_read(model, frame, told))


def _elsewhere(method: str, kind: Kind) -> ff.Reading:
    """A reading of a model that another process reads."""
    context: Any = multiprocessing.get_context(method)
    ours, theirs = context.Pipe()
    run = context.Process(target=_answer, args=(theirs, kind.model, kind.frames[0], kind.told[0]))
    run.start()
    try:
        assert ours.poll(PATIENCE), f"no answer within {PATIENCE} s"
        return ours.recv()
    finally:
        run.kill()
        run.join()


def running(kinds: str = "") -> Iterator[Case]:
    """Each kind of sensor in each way."""
    for name, make in _kinds().items():
        if kinds not in name:
            continue
        kind = make()
        reader = kind.reader()
        first = reader.read(kind.frames[0], **kind.told[0])
        yield f"{name}: read", lambda first=first: _trusted(first)
        _numbers(first)
        for how, again in (("pickle", _pickled), ("deep copy", copy.deepcopy)):
            for case, attempt in _copies(kind, reader, first, again).items():
                yield f"{name}: {how} of {case}", attempt
        yield f"{name}: readings asked later", lambda kind=kind: _asked_later(kind)
        for method in ("fork", "spawn"):
            yield (
                f"{name}: {method}",
                lambda method=method, kind=kind, first=first: _same(
                    _elsewhere(method, kind), first
                ),
            )
        yield f"{name}: two threads", lambda kind=kind: _threads(kind)
        yield f"{name}: a fork while a thread reads", lambda kind=kind: _fork_beside(kind)


def _trusted(reading: ff.Reading) -> None:
    assert reading.trusted, f"{reading.status}: {reading.advice}"


def _pickled(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


def _copies(
    kind: Kind, reader: ff.Reader, first: ff.Reading, again: Callable[[Any], Any]
) -> dict[str, Callable[[], None]]:
    """Copies of all that belongs to a kind of sensor say and do the same."""
    sensor = kind.model.sensor
    nothing = np.zeros_like(kind.frames[0])

    def design() -> None:
        assert again(sensor) == sensor, "another design"

    def model() -> None:
        own = again(kind.model)
        assert own.sensor == sensor, "another design"
        _same(_read(own, kind.frames[0], kind.told[0]), first)

    def whole() -> None:
        one, other = again(reader), again(reader)
        told = kind.told[1]
        _same(one.read(kind.frames[1], **told), other.read(kind.frames[1], **told))

    def reading(good: ff.Reading) -> None:
        own = again(good)
        _same(own, good)
        assert (str(own), own.advice) == (str(good), good.advice), "other words"
        size = sum(value.nbytes for value in _numbers(good).values() if hasattr(value, "nbytes"))
        grown = len(pickle.dumps(own)) / (size + 10_000)
        assert grown < MOST, f"{grown:.1f} times as large as its numbers"

    def unasked() -> None:
        good = kind.reader().read(kind.frames[0] // 2, **kind.told[0])
        assert good.status is ff.Status.MODEL_MISMATCH, "half the light is taken for all of it"
        own = again(good)
        assert "findings" not in vars(good), "what differs is looked for at once"
        if again is _pickled:
            (said,) = own.findings
            assert "had not been asked for" in said, "no word that nothing was looked for"
        np.testing.assert_array_equal(own.forces, good.forces)
        np.testing.assert_array_equal(own.std, good.std)

    def batch() -> None:
        times = [one["time"] for one in kind.told if one] or None
        good = kind.reader().read_batch(kind.frames, times=times)
        own = again(good)
        for name in ("forces", "std", "covariance", "chi2", "status"):
            np.testing.assert_array_equal(getattr(own, name), getattr(good, name), err_msg=name)

    return {
        "design": design,
        "model": model,
        "reader": whole,
        "reading": lambda: reading(first),
        "bad frame": lambda: reading(kind.reader().read(nothing, **kind.told[0])),
        "refused reading": unasked,
        "batch": batch,
    }


def _asked_later(kind: Kind) -> None:
    """What is computed after later frames is what would have been computed at once."""
    at_once, later = kind.reader(), kind.reader()
    good = []
    for frame, told in zip(kind.frames, kind.told, strict=True):
        reading = at_once.read(frame, **told)
        _numbers(reading)
        good.append(reading)
    found = [later.read(frame, **told) for frame, told in zip(kind.frames, kind.told, strict=True)]
    for ours, theirs in zip(found, good, strict=True):
        _same(ours, theirs)


def _threads(kind: Kind) -> None:
    """Two threads on one reader find what one does, followed frames in whatever order they came."""
    reader, single = kind.reader(), kind.reader()
    alone = [single.search(frame) for frame in kind.frames]
    with ThreadPoolExecutor(2) as pool:
        for ours, theirs in zip(pool.map(reader.search, kind.frames), alone, strict=True):
            _same(ours, theirs)
        if kind.told[0]:
            return  # times of frames have to ascend
        again = [kind.frames[0]] * 4
        in_order = [single.read(frame) for frame in again]
        for ours, theirs in zip(
            *(sorted(found, key=_order) for found in (pool.map(reader.read, again), in_order)),
            strict=True,
        ):
            _same(ours, theirs)


def _order(reading: ff.Reading) -> tuple[bool, list[float]]:
    return reading.tracked, reading.forces.ravel().tolist()


def _fork_beside(kind: Kind) -> None:
    """A process that is forked while a thread reads can use the reader."""
    reader, stop = kind.reader(), threading.Event()
    reader.read(kind.frames[0], **kind.told[0])  # no process survives a fork while it compiles

    def busy() -> None:
        while not stop.is_set():
            reader.reset()
            reader.read(kind.frames[0], **kind.told[0])

    thread = threading.Thread(target=busy)
    context: Any = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()

    def answer() -> None:
        reader.reset()
        theirs.send(reader.read(kind.frames[0], **kind.told[0]))

    thread.start()
    run = context.Process(target=answer)
    try:
        run.start()
        assert ours.poll(10), "it waits forever"
        _same(ours.recv(), kind.reader().read(kind.frames[0], **kind.told[0]))
    finally:
        stop.set()
        thread.join()
        run.kill()
        run.join()
