"""Forces from pictures of a strip, against those from perfect lines.

    python benchmarks/picture_forces.py [scenes] [loads of each] [seed]

An area camera of 640 x 480 pixels sees the paper's strip with roller edges, anywhere in the
picture, turned by up to 5 degrees; a pinhole camera five lengths away is turned by up to 10 degrees
about either axis.  One long edge is up to a tenth brighter than the other; every pixel has a noise
of 1 % of the full scale.  The light is that of the exact Fourier series at 4,000 places; pictures
are rendered by supersampling.  Every tactel carries up to 1.5 N, at up to 20 degrees from the
normal.  In the last rows a lens distorts the picture, by -5 to 2 % at its corners.  The strip is
found in a picture without analyser, the camera is described from the pictures, and lines are taken
and read, as `fringeforce extract` and `read` do; in the last row they take the lens for perfect.

OK: frames read as OK.  far: of these, a force lies more than six stated standard deviations off.
inside: share of forces within their 95 % intervals.  off: root mean square of errors over stated
deviations.  std: what is stated, median.  rms: of the errors.  perfect: rms of the errors of
perfect lines that have the noise that is stated, read by the same reader.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from departures import FAR, INTERVAL, Bench, exact_influence, intensity
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import fringeforce as ff
from fringeforce.pictures.camera import line_camera
from fringeforce.pictures.extraction import extract_frames, first_pictures
from fringeforce.pictures.sampling import channels_of

sys.path.append(str(Path(__file__).parents[1] / "tests" / "pictures"))
import storing  # pyrefly: ignore[missing-import] of the tests
from rendering import Scene  # pyrefly: ignore[missing-import]

Array = NDArray[np.float64]
SCENES, LOADS, SEED = 25, 4, 0
SIZE, LENGTH, ASPECT = (640, 480), (400.0, 560.0), 12.5
"""Columns and rows, the strip's length in the picture [pixels], and its length over its width."""
TILT, SLANT, DISTANCE = 5.0, 10.0, 5.0
"""Of the strip in the picture and of the camera against it [degrees], and how far away the camera
is, in lengths of the strip."""
DISTORTION = (-0.05, 0.02)
"""Of the lens, at the corners of the picture, by Brown's first term: barrels, and few cushions."""
UNEVEN, NOISE = 0.1, 0.01
"""Change of the light from edge to edge, and share of the full scale."""
LARGEST, STEEPEST = 1.5, 20.0
"""Force on a tactel [N] and its angle from the normal [degrees]."""
PLACES = 4000
AMPLITUDE, OFFSET = 0.78, 0.05
"""Of the light, as shares of the full scale."""


def scene(rng: np.random.Generator) -> Scene:
    """A strip anywhere in the picture of a pinhole camera that does not look straight at it."""
    angles = np.radians([*rng.uniform(-SLANT, SLANT, 2), rng.uniform(-TILT, TILT)])
    half = np.array([[-1, -1 / ASPECT], [1, -1 / ASPECT], [1, 1 / ASPECT], [-1, 1 / ASPECT]]) / 2
    flat = np.column_stack([half, np.zeros(4)]) @ Rotation.from_euler("xyz", angles).as_matrix().T
    seen = rng.uniform(*LENGTH) * flat[:, :2] / (1 + flat[:, 2:] / DISTANCE)
    room = np.maximum(np.array(SIZE) / 2 - 15 - np.abs(seen).max(axis=0), 0)
    corners = seen + np.array(SIZE) / 2 + rng.uniform(-room, room)
    ends = tuple((float(column), float(row)) for column, row in corners)
    return Scene(ends, SIZE, uneven=rng.uniform(-UNEVEN, UNEVEN))


KINDS: dict[str, tuple[Callable[..., None], dict[str, Any], str, bool]] = {
    "PNG": (storing.png, {}, "linear", False),
    "TIFF of 12 bits": (storing.tiff_of_12_bits, {"bits": 12}, "linear", False),
    "JPEG in sRGB": (storing.jpeg_in_srgb, {}, "sRGB", False),
    "H.264": (storing.video, {}, "linear", False),
    "Bayer, red light": (storing.bayer_under_red_light, {"mosaic": "RGGB"}, "linear", False),
    "PNG, bent by lens": (storing.png, {}, "linear", True),
    "the same, untold": (storing.png, {"distortion": 0.0}, "linear", True),
}
"""How pictures are stored, what is told of them, the response, and whether the lens distorts."""


def shares(sensor: ff.Sensor, forces: Array, x: Array) -> Array:
    """Light along the strip as shares of the full scale, shape (loads, len(x))."""
    influence = exact_influence(Bench(), sensor, sensor.tactels.positions, x)
    wavelength = sensor.polariscope.wavelength
    light = [
        intensity(Bench(), np.einsum("mct,ct->m", influence, one), wavelength) for one in forces
    ]
    return AMPLITUDE * np.array(light) + OFFSET


def read(
    reader: ff.Reader, frames: NDArray[Any], forces: Array
) -> list[tuple[Array, Array] | None]:
    """Errors and deviations of every frame, none of those that are not OK."""
    found = list[tuple[Array, Array] | None]()
    for frame, truth in zip(frames, forces, strict=True):
        reading = reader.search(frame)
        found.append((reading.forces - truth, reading.std) if reading.ok else None)
    return found


def perfect(
    own: ff.Sensor, sensor: ff.Sensor, forces: Array, rng: np.random.Generator
) -> NDArray[Any]:
    """Lines of a camera that looks where it is drawn."""
    camera = own.camera
    shone = shares(sensor, forces, own.pixel_positions)
    shone = storing.in_srgb(shone) if camera.response == "sRGB" else shone
    levels = camera.full_scale * shone + camera.noise * rng.standard_normal(shone.shape)
    return np.clip(np.rint(levels), 0, camera.full_scale).astype(np.uint16)


def main() -> None:
    """Print the table."""
    given = [int(word) for word in sys.argv[1:4]]
    scenes, count, seed = (given + [SCENES, LOADS, SEED][len(given) :])[:3]
    sensor = ff.load_sensor("saad").replace(**{"transducer.edges": "roller"})
    half, tactels = sensor.transducer.length / 2, sensor.tactels.count
    x = (np.arange(PLACES) + 0.5) / PLACES * 2 * half - half
    rows: dict[str, list[Any]] = {name: [] for name in KINDS}
    ideal: dict[str, list[Any]] = {name: [] for name in KINDS}
    for number in range(scenes):
        rng = np.random.default_rng([seed, number])
        seen, size = scene(rng), rng.uniform(0, LARGEST, (count, tactels))
        forces = ff.polar(size, rng.uniform(-STEEPEST, STEEPEST, size.shape))
        lenses = {False: seen, True: replace(seen, brown=rng.uniform(*DISTORTION))}
        light = shares(sensor, forces, x)
        pictures = {k: np.array([own.picture(one) for one in light]) for k, own in lenses.items()}
        even = {
            k: storing.quantised(own.picture(np.full(1000, 0.7)), NOISE, rng=rng)
            for k, own in lenses.items()
        }
        for name, (store, told, response, bent) in KINDS.items():
            with tempfile.TemporaryDirectory() as place:
                folder = Path(place)
                store(pictures[bent], folder, rng)
                region = ff.find_region([even[bent]], aspect=ASPECT, **told)
                first = first_pictures([folder])
                channels = channels_of(sensor.polariscope, region, first[0].ndim == 3)
                length = sensor.transducer.length
                own = line_camera(first, region, length, channels, response=response).put_into(
                    sensor
                )
                frames, _ = extract_frames([folder], own, region)
            reader = ff.Reader(ff.characterize(own))
            rows[name] += read(reader, frames, forces)
            ideal[name] += read(reader, perfect(own, sensor, forces, rng), forces)
        if sys.stderr.isatty():
            print(f"\r{number + 1} of {scenes}", end="", file=sys.stderr)
    print(f"{scenes} scenes, {count} loads each\n")
    print(f"{'pictures':17s}     OK    far  inside   off  std [mN]  rms [mN]  perfect [mN]")
    for name, found in rows.items():
        good = [one for one in found if one is not None]
        error, std = (np.array(part) for part in zip(*good, strict=True))
        exact = np.array([one[0] for one in ideal[name] if one is not None])
        far = (np.abs(error) > FAR * std).any(axis=(1, 2)).mean()
        print(
            f"{name:17s} {len(good) / len(found):6.1%} {far:6.1%} "
            f"{(np.abs(error) < INTERVAL * std).mean():7.1%} "
            f"{np.sqrt(np.mean(np.square(error / std))):5.2f} {1e3 * np.median(std):9.1f} "
            f"{1e3 * np.sqrt(np.mean(error**2)):9.1f} {1e3 * np.sqrt(np.mean(exact**2)):13.1f}"
        )


if __name__ == "__main__":
    main()
