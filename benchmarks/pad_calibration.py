"""Benches of a planar pad that depart from its drawing, calibrated, and frames held out.

    python benchmarks/pad_calibration.py [held-out frames a row] [seed] [part of a name] [tactels]

A bench is 64 presses on the 5 x 5 pad of `benchmarks/pad_departures.py`, anywhere on its tactels,
with discs of 1.2 to 2.4 mm under Hertz's pressure, a uniform one or that of a punch.  Frames are
made by the exact double Fourier series at 16 depths, on four points a pixel whose light is blurred
and averaged; the reader takes 8 depths and one point.  Held-out frames have one to three squares of
1.9 mm (0.1 mm rms) next to tactels (0.1 mm rms), which is what the drawing states.

OK: held-out frames read OK by the calibrated model / by the same reader that knows the true sensor.
inside: forces of the former within 95 % intervals.  rms: their error over that of the latter, where
both are OK.  far: OK readings with a force off by more than 6 of its deviations.  values: largest
error of a value of the sensor in its deviations.  wrong, dead: presses and pixels found of those
that are.  verdict: use, or do not use.  seconds: of the calibration, and of the processor.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from time import perf_counter, process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pad_departures import drawing

import fringeforce as ff
from fringeforce.calibration.bench_loads import BenchLoads, bench_loads
from fringeforce.contacts.press import Press, Profile
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import Tolerances
from fringeforce.mechanics.solid.block import Patches
from fringeforce.models.as_built import LIGHT_LENGTH, RESIDUAL
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_as_built import smooth_image
from fringeforce.models.pad_knowledge import PadKnowledge
from fringeforce.models.pad_presses import pad_tractions
from fringeforce.models.pad_slices import slice_retardance
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.models.pad_unknowns import UNEVEN
from fringeforce.optics import camera as camera_optics
from fringeforce.optics.area_camera import Lens, mosaic, pictures
from fringeforce.optics.integrated import double_pass

Array = NDArray[np.float64]

FRAMES, SEED, TACTELS = 40, 1, 5
PRESSES, DARK = 64, 2
"""Frames with a press, and without any."""
SLICES, FINER = 16, 2
AVERAGED = 0.27
"""Blur in pixels that spreads light as the mean of four points of a pixel does."""
FAR, INTERVAL = 6.0, 1.959964
LARGEST = 3.0
"""Retardance over both passes up to which forces are drawn [rad], with the drawing."""
BESIDE = 0.1e-3
"""Standard deviation of held-out contacts beside their tactels [m]."""
PROFILES: tuple[Profile, ...] = "hertz", "flat", "punch"
STATED = {
    "tactels.placement": "0 +/- 0.1 mm",
    "tactels.size": "2 +/- 0.2 mm",
    "camera.drift": "1 %",
}
"""What the drawing states of contacts and light."""


@dataclass(frozen=True)
class Bench:
    """What departs from the drawing."""

    design: dict[str, Any] = field(default_factory=dict)
    residual: float = 0.0
    uneven: float = 0.0
    lamp: float = 0.0
    beside: float = 0.0
    forces: float = 0.0
    wrong: int = 0
    dead: int = 0
    mirrored: bool = False


LAYERS = {
    "transducer.compliant.thickness": 0.55e-3,
    "transducer.compliant.youngs_modulus": 8.8e6,
    "transducer.photoelastic.strain_optic_coefficient": 0.054,
}
CAMERA = {"camera.shift_x": 0.3e-3, "camera.shift_y": -0.2e-3, "camera.scale": 1.01}
LIGHT = {"camera.amplitude": 232.8, "camera.offset": 7.0}
ALL = Bench(
    {
        **LAYERS,
        **CAMERA,
        **LIGHT,
        "polariscope.visibility": 0.95,
        "camera.blur": 0.06e-3,
        "camera.gamma": 1.1,
    },
    residual=0.3,
    uneven=0.05,
    lamp=0.01,
    beside=0.1e-3,
    forces=0.01,
    wrong=2,
    dead=10,
)
BENCHES = {
    "none": Bench(),
    "cover +10 %, E1 -20 %, K_s +8 %": Bench(LAYERS),
    "camera shifted and scaled by 1 %": Bench(CAMERA),
    "light 3 % dim": Bench(LIGHT),
    "visibility 0.95": Bench({"polariscope.visibility": 0.95}),
    "residual 0.1 rad": Bench(residual=0.1),
    "residual 0.3 rad": Bench(residual=0.3),
    "uneven light": Bench(uneven=0.05),
    "gamma 1.1": Bench({"camera.gamma": 1.1}),
    "blur 0.06 mm": Bench({"camera.blur": 0.06e-3}),
    "presses 0.1 mm beside": Bench(beside=0.1e-3),
    "forces 1 %": Bench(forces=0.01),
    "2 wrong presses, 10 dead pixels": Bench(wrong=2, dead=10),
    "all at once": ALL,
    "mirrored places": replace(ALL, mirrored=True),
}


@dataclass(frozen=True, eq=False)
class Truth:
    """One pad that was made."""

    pad: Pad
    residual: Array
    """Retardance over both passes without load, shape (2, rows, columns) of the fine grid."""
    shade: Array
    """Light of every pixel over the mean, shape (rows, columns)."""

    def places(self) -> tuple[Array, Array]:
        """Points of the fine grid [m]."""
        fine = self.pad.replace(**{"camera.pixels": [FINER * n for n in self.pad.camera.pixels]})
        ends = self.pad.transducer.length / 2, self.pad.transducer.width / 2
        x, y = (np.clip(p, -e, e) for p, e in zip(fine.pixel_positions, ends, strict=True))
        return x, y

    def light(self, presses: list[Press]) -> Array:
        """Share of the light that every pixel gets, shape (rows, columns)."""
        x, y = self.places()
        loads = [pad_tractions(self.pad, press) for press in presses]
        patches = [(Patches(load.places), load.forces) for load in loads]
        slices = slice_retardance(self.pad, patches, x, y, SLICES)
        slices = slices + self.residual / (2 * SLICES)
        light = double_pass(slices)
        fine = self.pad.replace(**{"camera.pixels": [FINER * n for n in self.pad.camera.pixels]})
        lens, found = Lens.of(fine), []
        for form in pictures(self.pad)[0].forms:
            seen = np.einsum("ij,iyx,jyx->yx", form, light, light)
            seen = seen if lens is None else lens.forward(seen.astype(np.float32))
            rows, columns = seen.shape
            found.append(seen.reshape(rows // FINER, FINER, columns // FINER, FINER).mean((1, 3)))
        across, along = found[0].shape
        kinds = mosaic(across, along, len(found))
        return np.take_along_axis(np.array(found).reshape(len(found), -1), kinds[None], 0)[
            0
        ].reshape(found[0].shape)

    def expose(self, presses: list[Press], lamp: float, rng: np.random.Generator) -> Array:
        """A frame."""
        camera = self.pad.camera
        dim = camera.model_copy(update={"amplitude": camera.amplitude * lamp})
        lit = self.light(presses) * self.shade
        levels = camera_optics.expose(dim, lit, rng, frame_axes=2)
        return np.asarray(levels, dtype=float)


def made(pad: Pad, bench: Bench, rng: np.random.Generator) -> Truth:
    """The pad of a bench."""
    truth = Truth(pad.replace(**bench.design), np.zeros((2, 1, 1)), np.ones((1, 1)))
    if bench.residual:
        (x, y), length = truth.places(), pad.polariscope.residual_length
        fields = bench.residual * np.stack([smooth_image(x, y, length, rng) for _ in range(2)])
        truth = replace(truth, residual=fields)
    if bench.uneven:
        (x, y), length = pad.pixel_positions, LIGHT_LENGTH * pad.transducer.length
        shade = 1 + bench.uneven * smooth_image(x, y, length, rng)
        truth = replace(truth, shade=shade)
    return truth


def press(pad: Pad, rng: np.random.Generator) -> Press:
    """A press on the tactels of a pad."""
    half = pad.tactels.pitch * (np.array(pad.tactels.count) - 1) / 2
    x, y = rng.uniform(-half, half)
    normal, angle, ratio = rng.uniform(0.6, 3.0), rng.uniform(0, 2 * np.pi), rng.uniform(0, 0.4)
    return Press(
        x=x,
        y=y,
        normal=normal,
        tangential=(ratio * normal * np.cos(angle), ratio * normal * np.sin(angle)),
        width=rng.uniform(1.2e-3, 2.4e-3),
        profile=PROFILES[rng.integers(3)],
    )


def measured(
    truth: Truth, bench: Bench, rng: np.random.Generator, count: int = PRESSES
) -> tuple[Array, BenchLoads, list[int], list[int]]:
    """Frames of a bench, what is written down, and which presses and pixels are wrong."""
    pad, presses, frames = truth.pad, [], []
    for number in range(count + DARK):
        presses.append([] if number < DARK else [press(pad, rng)])
        frames.append(truth.expose(presses[-1], 1 + bench.lamp * rng.standard_normal(), rng))
    pressed = [one[0] for one in presses if one]
    places = np.array([[one.x, one.y] for one in pressed])
    forces = np.array([[one.normal, *one.shear] for one in pressed])
    places += bench.beside * rng.standard_normal(places.shape)
    size = np.linalg.norm(forces, axis=1, keepdims=True)
    forces += bench.forces * size * rng.standard_normal(forces.shape)
    bad = rng.choice(count, bench.wrong, replace=False)
    for number, one in enumerate(bad):
        if number % 2:
            places[one] = -places[one] + 1e-3
        else:
            forces[one] *= 1.3
    if bench.mirrored:
        places[:, 0] *= -1
    levels = np.array(frames, dtype=float)
    flat = levels.reshape(len(levels), -1)
    dead = rng.choice(flat.shape[1], bench.dead, replace=False)
    flat[:, dead] = rng.choice([0.0, 255.0], bench.dead)
    numbers = np.arange(DARK, count + DARK)
    loads = bench_loads(places, forces, numbers, count + DARK)
    return levels, loads, sorted((bad + DARK).tolist()), sorted(dead.tolist())


def held_out(truth: Truth, bench: Bench, rng: np.random.Generator, count: int) -> tuple[Any, Any]:
    """Frames of contacts next to tactels, and their forces, shape (count, n, 3)."""
    tactels, frames = truth.pad.tactels, []
    forces = np.zeros((count, tactels.total, 3))
    for one in forces:
        touched = []
        for number in rng.choice(tactels.total, rng.integers(1, 4), replace=False):
            x, y = tactels.places[number] + BESIDE * rng.standard_normal(2)
            normal, angle = rng.uniform(0.4, 2.0), rng.uniform(0, 2 * np.pi)
            shear = rng.uniform(0, 0.4) * normal * np.array([np.cos(angle), np.sin(angle)])
            width = float(np.clip(1.9e-3 + 0.1e-3 * rng.standard_normal(), 1.6e-3, 2.2e-3))
            touched.append(
                Press(
                    x=x,
                    y=y,
                    normal=normal,
                    tangential=(shear[0], shear[1]),
                    width=width,
                    profile="flat",
                    outline="rectangle",
                )
            )
            one[number] = [normal, *shear]
        frames.append(truth.expose(touched, 1 + bench.lamp * rng.standard_normal(), rng))
    return np.array(frames), forces


def known_sensor(truth: Truth, pad: Pad) -> PadModel:
    """Model of the pad that was made, whose residual is known; contacts and drift are as drawn."""
    rough = float(np.sqrt(np.square(truth.residual).mean()))
    uneven = float(np.sqrt(np.square(truth.shade - 1).mean()))
    stated = {key: std for key, std in pad.tolerances.items() if key.startswith("tactels.")}
    stated |= {RESIDUAL: rough} if rough else {}
    camera = truth.pad.camera.model_copy(update={"unevenness": uneven})
    sensor = truth.pad.model_copy(update={"tolerances": Tolerances(stated), "camera": camera})
    model = ff.characterize(sensor)
    known, found = PadUncertainty.of(model), dict[str, tuple[float, Array]]()
    if rough:
        x, y = truth.places()
        modes, _ = known.residual.at(x[::8], y[::8])
        parts = truth.residual[:, ::8, ::8].reshape(2, -1)
        found[RESIDUAL] = rough, np.concatenate([shares(modes, part) for part in parts])
    if uneven:
        rows, columns = (np.arange(0, n, 4) for n in truth.shade.shape)
        part = (truth.shade - 1)[rows[:, None], columns].ravel()
        found[UNEVEN] = uneven, shares(known.shades.modes(rows, columns), part)
    if not found:
        return model
    mean = np.concatenate([own for _, own in found.values()])
    counts = {path: len(own) for path, (_, own) in found.items()}
    stds = {path: std for path, (std, _) in found.items()}
    return replace(model, known=PadKnowledge(stds, counts, mean, 1e-6 * np.eye(len(mean))))


def shares(modes: NDArray[np.floating], field: Array) -> Array:
    """Of modes (k, m), those that come nearest to a field (m,)."""
    square = modes @ modes.T
    size = len(modes)
    ridge = 1e-6 * np.trace(square) / size * np.eye(size)
    return np.asarray(np.linalg.solve(square + ridge, modes @ field))


def off(model: PadModel, truth: Truth) -> tuple[float, str]:
    """Largest error of a value of the sensor in its deviations, and which."""
    found = model.calibration
    assert found is not None
    seen, camera, errors = truth.pad.polariscope.visibility, truth.pad.camera, {}
    # light of less visibility is light of another amplitude and offset
    light = {
        "camera.amplitude": camera.amplitude * seen,
        "camera.offset": camera.offset + camera.amplitude * (1 - seen) / 2,
        "camera.blur": camera.blur
        or AVERAGED * float(np.diff(truth.pad.pixel_positions[0][:2])[0]),
    }
    for name, value, std in zip(found.names, found.values, found.std, strict=True):
        part: Any = truth.pad
        for key in name.split("."):
            part = getattr(part, key)
        errors[name] = abs(value - light.get(name, part or 0.0)) / std
    worst = max(errors, key=lambda name: errors[name])
    return errors[worst], worst


def main() -> None:
    """Print the table."""
    given = [int(one) for one in sys.argv[1:3]]
    frames, seed = given + [FRAMES, SEED][len(given) :]
    wanted = sys.argv[3] if len(sys.argv) > 3 else ""
    side = int(sys.argv[4]) if len(sys.argv) > 4 else TACTELS
    pad = drawing(side).replace(**STATED)
    print(f"{side} x {side} tactels, {PRESSES} presses, {frames} frames held out")
    print(f"{'bench':<34} {'OK':>9} {'inside':>7} {'rms':>5} {'far':>4} {'values':>6} "
          f"{'wrong':>6} {'dead':>6} {'verdict':>11} {'seconds':>12}", flush=True)  # fmt: skip
    for number, (name, bench) in enumerate(BENCHES.items()):
        if wanted not in name:
            continue
        rng = np.random.default_rng([seed, number])
        truth = made(pad, bench, rng)
        levels, loads, bad, dead = measured(truth, bench, rng)
        begun, busy = perf_counter(), process_time()
        model = ff.calibrate(pad, levels, loads)
        spent = f"{perf_counter() - begun:.0f}, {process_time() - busy:.0f}"
        found = model.calibration
        assert found is not None
        verdict = "use" if found.usable else "do not use"
        if not found.usable:
            print(f"{name:<34} {verdict}: {found.findings[0]} {spent}", flush=True)
            continue
        images, forces = held_out(truth, bench, rng, frames)
        best = known_sensor(truth, pad)
        readings = [[ff.Reader(m).search(one) for one in images] for m in (model, best)]
        fine = [[r.status is ff.Status.OK for r in each] for each in readings]
        both = np.all(fine, axis=0)
        errors = [
            np.array([r.forces - f for r, f in zip(each, forces, strict=True)])[both]
            for each in readings
        ]
        own = np.array([r.forces - f for r, f in zip(readings[0], forces, strict=True)])[fine[0]]
        std = np.array([r.std for r in readings[0]])[fine[0]]
        inside = float((np.abs(own) < INTERVAL * std).mean())
        far = int((np.abs(own) > FAR * std).any(axis=(1, 2)).sum())
        rms = float(np.sqrt(np.square(errors[0]).mean() / np.square(errors[1]).mean()))
        size, worst = off(model, truth)
        print(
            f"{name:<34} {np.mean(fine[0]):>4.0%}/{np.mean(fine[1]):<4.0%} {inside:>7.1%} "
            f"{rms:>5.2f} {far:>4} {size:>6.1f} "
            f"{len(set(bad) & set(found.outliers)):>2}/{len(bad)}/{len(found.outliers)} "
            f"{len(set(dead) & set(found.dead)):>3}/{len(dead)}/{len(found.dead)} "
            f"{verdict:>11} {spent:>12}  {worst}",
            flush=True,
        )


if __name__ == "__main__":
    main()
