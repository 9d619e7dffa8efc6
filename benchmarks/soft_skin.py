"""What a soft skin makes of cylinders that press on it anywhere, by linear theory and beyond it.

    python benchmarks/soft_skin.py [frames] [seed] [dead|follower]

One or two rigid cylinders at a time, 6 to 15 mm in radius, under 0.12 to 1.2 N each, use up to 0.9
of their friction and lie at least 4 mm apart on the shipped soft skin.  Their tractions come from
contact mechanics on its layers, as uniform patches on finer elements of a higher order than the
reader's, about the contacts; the hyperelastic strip is solved under each, and the pixels have a
uniform noise of 5 grey levels.  They are dead loads, or follow the surface: then each patch presses
across and along its own deformed chord, and the reader of dead loads reads the frames as well.

Then contacts of stated widths, narrower than the cover is thick and wider, with pressures of Hertz
and even ones in turn, before a camera of 1.5 grey levels of noise, which shows more of what the
reader's elements miss.  Their forces squash the cover: mean pressure over its modulus.

OK, AMBIGUOUS, refused: frames.  wrong OK: read as OK, but a total lies more than six stated
deviations off; of stated widths, force and centre together are so far off by chance in less than
one frame in 10,000 (chi-square).  inside: share of what is stated that lies within its 95 %
interval.  folds: frames under whose loads the finer elements have no stable state.
"""

from __future__ import annotations

import sys
import time
from collections import Counter

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.mechanics.finite_strain import finite_strip
from fringeforce.models.presses import tractions
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

FRAMES, SEED = 40, 77
RADII, FORCES = (6e-3, 15e-3), (0.12, 1.2)
FRICTION, USED = 0.6, 0.9
OUTERMOST, APART = 6e-3, 4e-3
ORDER, PATCHES = 6, 12
"""Order of the elements, and uniform patches in the place of a contact; elements beside the ends of
a patch are no larger than it."""
FINER = 2.0
"""Patches and elements of a check, over these."""
FAR, INTERVAL = 6.0, 1.96
"""Stated standard deviations."""
CHANCE = 1e-4
"""Of an error of force and centre beyond which a reading is wrong."""
WIDTHS, SQUASHES = (0.3e-3, 0.5e-3, 0.8e-3, 1.2e-3), (0.05, 0.1, 0.15, 0.2, 0.25)
QUIET, SHEARED, EACH = 1.5, 0.4, 4
"""Noise in grey levels, largest shear over normal force, and frames of each width and squash."""


def drawn(generator: np.random.Generator) -> list[ff.Press]:
    """One or two cylinders."""
    count = int(generator.integers(1, 3))
    while True:
        places = np.sort(generator.uniform(-OUTERMOST, OUTERMOST, count))
        if (np.diff(places) > APART).all():
            break
    return [
        ff.Press(
            x=float(x),
            normal=(force := float(np.exp(generator.uniform(*np.log(FORCES))))),
            tangential=float(generator.uniform(-USED, USED)) * FRICTION * force,
            radius=float(np.exp(generator.uniform(*np.log(RADII)))),
            friction=FRICTION,
        )
        for x in places
    ]


def solved(
    model: ff.SensorModel, presses: list[ff.Press], finer: float = 1.0
) -> tuple[NDArray, NDArray]:
    """Phase at the pixels [rad], and the total force [N] with its centre [m]."""
    count = round(PATCHES * finer)
    centres, widths, forces = list[NDArray](), list[NDArray](), list[NDArray]()
    parts = [tractions(model.sensor, press) for press in presses]
    for part in parts:
        (first, last), order = part.ends, np.argsort(part.places)
        edges = np.linspace(first, last, count + 1)
        sums = np.cumsum(part.forces[order], axis=0) - part.forces[order] / 2
        at = np.concatenate([[first], part.places[order], [last]])
        ends = np.concatenate([np.zeros((1, 2)), sums, part.forces.sum(axis=0)[None]])
        reached = np.column_stack([np.interp(edges, at, column) for column in ends.T])
        centres.append((edges[1:] + edges[:-1]) / 2)
        widths.append(np.diff(edges))
        forces.append(np.diff(reached, axis=0))
    transducer, light = model.sensor.transducer, model.sensor.polariscope
    patched = np.concatenate(centres), np.concatenate(widths)
    strip = finite_strip(transducer, *patched, order=ORDER, share=1.0)
    state = strip.solved(np.concatenate(forces))
    constant = stress_optic_constant(transducer.photoelastic, light.wavelength)
    phase = phase_lead(strip.light.integrated_stress(state, model.pixel_positions), constant)
    places = np.concatenate([part.places for part in parts])
    force = np.concatenate([part.forces for part in parts])
    total = force.sum(axis=0)
    return phase, np.array([*total, force[:, 0] @ places / total[0]])


def main(frames: int = FRAMES, seed: int = SEED, loads: str = "dead") -> None:
    """Read frames of cylinders, and print how well."""
    drawing = ff.load_sensor("soft-skin").replace(**{"transducer.loads": loads})
    model = ff.characterize(drawing)
    shots, truths, folds = list[NDArray](), list[NDArray](), 0
    for number in range(frames):
        generator = np.random.default_rng([seed, number])
        try:
            phase, true = solved(model, drawn(generator))
        except InputError:
            folds += 1
            continue
        shots.append(model.delivered(phase, generator))
        truths.append(true)
    print(f"{loads} loads, frames {frames}, the surface folds in {folds}")
    dead = {"transducer.strain": "finite", "transducer.loads": "dead"}
    linear = {"transducer.strain": "linear", "transducer.loads": "dead"}
    readers = {"linear": linear, "finite": {}}
    if loads == "follower":
        readers["finite, of dead loads"] = dead
    for name, changes in readers.items():
        reader = ff.Reader(ff.characterize(drawing.replace(**changes)))
        reader.prepare()
        verdicts, errors, deviations = Counter[str](), list[NDArray](), list[NDArray]()
        seconds = list[float]()
        for shot, true in zip(shots, truths, strict=True):
            begun = time.process_time()
            reading = reader.search(shot)
            seconds.append(time.process_time() - begun)
            verdicts[reading.status.name] += 1
            if not reading.ok or reading.total is None:
                continue
            total = reading.total
            errors.append(np.array([*total.force, total.centre[0]]) - true)
            deviations.append(errors[-1] / total.std[[0, 1, 5]])
        off = np.abs(deviations)
        print(f"\n{name}: " + ", ".join(f"{k} {n}" for k, n in sorted(verdicts.items())))
        if not len(off):
            continue
        print(f"wrong OK {int((off > FAR).any(axis=1).sum())}")
        print(f"{'':14s}{'rms error':>12s}{'inside':>9s}{'rms of deviations':>20s}")
        rms = np.sqrt(np.square(errors).mean(axis=0)) * [1, 1, 1e3]
        for k, part in enumerate(("total N [N]", "total T [N]", "centre [mm]")):
            print(
                f"{part:14s}{rms[k]:12.4f}{np.mean(off[:, k] < INTERVAL):9.1%}"
                f"{np.sqrt(np.square(off[:, k]).mean()):20.2f}"
            )
        print(
            f"cold read {np.median(seconds):.2f} s of processor in the median, "
            f"{np.quantile(seconds, 0.9):.2f} s in nine of ten",
            flush=True,
        )
    narrow(seed, loads)


def _changed(model: ff.SensorModel, press: ff.Press, phase: NDArray) -> float:
    """Change of the phase by elements half as large, over its peak; none where these fold."""
    try:
        return float(np.abs(solved(model, [press], FINER)[0] - phase).max() / np.abs(phase).max())
    except InputError:
        return np.nan


def narrow(seed: int, loads: str) -> None:
    """Read frames of contacts of stated widths, and print how well."""
    quiet = {"camera.noise": QUIET, "transducer.loads": loads}
    model = ff.characterize(ff.load_sensor("soft-skin").replace(**quiet))
    reader, cover = ff.Reader(model), model.sensor.transducer.compliant
    reader.prepare()
    print(f"\nstated widths, noise of {QUIET:g} grey levels, {EACH} frames each")
    print(
        "width  squash  force  folds  OK  wrong  inside  rms of deviations: N, T, centre"
        "   seconds   finer elements"
    )
    for width in WIDTHS:
        for squash in SQUASHES:
            force = squash * cover.youngs_modulus * width * model.sensor.transducer.width
            off, chances, seconds, folds, finer = [], [], [], 0, np.nan
            for number in range(EACH):
                generator = np.random.default_rng([seed, round(1e6 * width), number])
                press = ff.Press(
                    x=float(generator.uniform(-OUTERMOST, OUTERMOST)),
                    normal=force,
                    tangential=float(generator.uniform(-SHEARED, SHEARED)) * force,
                    width=width,
                    profile=("hertz", "flat")[number % 2],
                )
                try:
                    phase, true = solved(model, [press])
                except InputError:
                    folds += 1
                    continue
                if number < 2:
                    finer = np.fmax(finer, _changed(model, press, phase))
                begun = time.process_time()
                reading = reader.search(model.delivered(phase, generator))
                seconds.append(time.process_time() - begun)
                if reading.ok and reading.total is not None:
                    total, own = reading.total, np.ix_([0, 1, 5], [0, 1, 5])
                    error = np.array([*total.force, total.centre[0]]) - true
                    off.append(error / total.std[[0, 1, 5]])
                    square = error @ np.linalg.solve(total.covariance[own], error)
                    chances.append(chi2.sf(square, len(error)))
            told = f"{1e3 * width:5.1f}{squash:8.2f}{force:7.3f}{folds:7d}{len(off):4d}"
            if off:
                rms = np.sqrt(np.square(off).mean(axis=0))
                inside = np.mean(np.abs(off) < INTERVAL)
                told += f"{int((np.array(chances) < CHANCE).sum()):7d}{inside:8.0%}      "
                told += " ".join(f"{one:8.2f}" for one in rms)
                told += f"{np.median(seconds):15.1f}{finer:17.2%}"
            print(told, flush=True)


if __name__ == "__main__":
    given = [FRAMES, SEED, "dead"]
    given[: len(sys.argv) - 1] = sys.argv[1:]
    main(int(given[0]), int(given[1]), str(given[2]))
