"""A lattice of pixels of a frame, and what light makes of retardance there.

Each pixel stands for its neighbours of all kinds, and counts with the mean of their forms.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Mask, Single
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.models.pad_unknowns import BLUR, GAMMA, UNEVEN
from fringeforce.optics.area_camera import Lens, Picture
from fringeforce.optics.integrated import turn_modes_back
from fringeforce.reading.pads.light import Shone


@dataclass(frozen=True, eq=False)
class Lattice:
    """A lattice of pixels.

    Attributes
    ----------
    model : PadModel
        Of the pad.
    rows, columns : ndarray of int, shape (r,), (c,)
        Those of the image that the lattice is made of.
    """

    model: PadModel
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]

    @property
    def pixels(self) -> NDArray[np.intp]:
        """Numbers of the pixels in the flattened image, shape (r * c,)."""
        width = self.model.frame_shape[-1]
        return (self.rows[:, None] * width + self.columns).ravel()

    def slopes(self, modes: Single, picture: Picture, light: Single) -> list[Single]:
        """Derivatives by the modes whose squares add up to the mean of all kinds of pixels."""
        profile = np.float32(picture.dispersion) * self.model.profile
        flat, pixels = modes.reshape(*modes.shape[:2], -1), self.pixels
        if self.model.lens is None:
            few, shone = np.ascontiguousarray(flat[:, :, pixels]), light[:, pixels]
            return [_back(few, profile, shone, pull) for pull in _roots(shone, picture.forms)]
        share = np.float32(1 / np.sqrt(len(picture.forms)))
        return [share * slope for slope in self.each(modes, picture, light, self.model.lens)]

    def weight(self, here: Shone, k: int) -> Single | None:
        """Change of the grey level with the intensity, over the amplitude, shape (forms, r * c).

        Nothing where it is one, as of a linear camera under even light.
        """
        if here.uneven is None and here.curve is None:
            return None
        shone = here.lights[k][:, self.pixels]
        seen = np.stack([_seen(form, shone) for form in here.pictures[k].forms])
        shade, bend = self._factors(here, seen)
        return np.asarray(np.broadcast_to(shade * bend, seen.shape), dtype=np.float32)

    def _factors(self, here: Shone, seen: Single) -> tuple[Array, Array]:
        """Light over its mean, shape (r * c,), and what a curve makes of levels (forms, r * c)."""
        shade = np.ones(1) if here.uneven is None else here.uneven[self.pixels]
        if here.curve is None:
            return shade, np.ones(1)
        return shade, here.curve.slope(here.amplitude * shade * seen + here.dark)

    def by_light(
        self, uncertain: PadUncertainty, here: Shone, k: int
    ) -> Iterator[tuple[int, Single]]:
        """Derivatives of the intensity of a picture by what acts on light and camera.

        Parameters
        ----------
        uncertain : PadUncertainty
            What does.
        here : Shone
            Where to take them.
        k : int
            Number of the picture.

        Yields
        ------
        number : int
            Of the unknown.
        change : ndarray, shape (forms, r * c)
            For every kind of pixels.
        """
        light, forms = here.lights[k], here.pictures[k].forms
        shone = light[:, self.pixels]
        seen = np.stack([_seen(form, shone) for form in forms])
        shade, bend = (part.astype(np.float32) for part in self._factors(here, seen))
        bright, weight = bend * seen, shade * bend
        camera = uncertain.camera
        for number in np.flatnonzero(camera.brightness).tolist():
            yield number, np.float32(camera.brightness[number]) * bright
        for number in np.flatnonzero(camera.darkness).tolist():
            share = camera.darkness[number] / here.amplitude
            yield number, np.float32(share) * np.broadcast_to(bend, seen.shape)
        if (gamma := uncertain.group(GAMMA)) and here.curve is not None:
            linear = np.asarray(here.amplitude * shade * seen + here.dark, dtype=float)
            steep = here.curve.by_power(linear)
            yield gamma.begin, np.asarray(gamma.std / here.amplitude * steep, dtype=np.float32)
        if uneven := uncertain.group(UNEVEN):
            modes = uncertain.shades.modes(self.rows, self.columns)
            for number, mode in enumerate(modes, uneven.begin):
                yield number, mode * bright
        for number, changes in camera.forms:
            yield number, weight * np.stack([_seen(change, shone) for change in changes[k]])
        if blur := uncertain.group(BLUR):
            low, high, apart = camera.lens_change(here.extra)
            sharp = np.stack([_seen(form, light) for form in forms])
            images = sharp.reshape(len(forms), *self.model.frame_shape[-2:])
            ends = [lens.part(images, self.rows, self.columns) for lens in (high, low)]
            change = (ends[0] - ends[1]) / np.float32(apart)
            yield blur.begin, np.float32(weight) * change.reshape(len(forms), -1)

    @property
    def places(self) -> tuple[Array, Array]:
        """Where the columns and the rows look, shapes (c,) and (r,) [m]."""
        x, y = self.model.sensor.pixel_positions
        return x[self.columns], y[self.rows]

    def each(
        self, modes: Single, picture: Picture, light: Single, lens: Lens | None
    ) -> list[Single]:
        """Derivatives of the intensity by the modes for every kind of pixels."""
        profile = np.float32(picture.dispersion) * self.model.profile
        flat, pixels = modes.reshape(*modes.shape[:2], -1), self.pixels
        found = []
        for form in picture.forms:
            slope = (2 * form).astype(np.float32)
            if lens is None:
                few, shone = np.ascontiguousarray(flat[:, :, pixels]), light[:, pixels]
                found.append(_back(few, profile, shone, slope @ shone))
                continue
            # influences hardly change over the blur, so that it may act on the other factor alone
            image = _back(flat, profile, light, slope @ light).reshape(modes.shape)
            blurred = lens.part(image, self.rows, self.columns)
            found.append(blurred.reshape(*modes.shape[:2], -1))
        return found

    def shares(self, used: Mask) -> Single:
        """Share of the pixels around each of the lattice that are used, shape (r * c,)."""
        whole = used.reshape(self.model.frame_shape[-2:]).astype(np.float32)
        for axis, places in enumerate((self.rows, self.columns)):
            middles = (places[1:] + places[:-1] + 1) // 2
            starts = np.concatenate([[0], middles])
            counts = np.diff(np.append(starts, whole.shape[axis]))
            sums = np.add.reduceat(whole, starts, axis=axis)
            whole = sums / np.expand_dims(counts, 1 - axis)
        return whole.ravel().astype(np.float32)


def _seen(form: Array, light: Single) -> Single:
    """Intensity of one kind of pixels from light, shape (3, m)."""
    return np.asarray(((form.astype(np.float32) @ light) * light).sum(axis=0))


def _back(modes: Single, profile: Single, light: Single, pull: Single) -> Single:
    gradient = np.empty_like(modes)
    # other orders in memory would each be compiled
    light, pull = np.ascontiguousarray(light), np.ascontiguousarray(pull)
    turn_modes_back(modes, profile, light, pull, gradient)
    return gradient


def _roots(light: Single, forms: Array) -> list[Single]:
    """Two directions of light, shape (3, m), for a pixel of several kinds.

    The squared derivatives of the intensity along them add up to the mean over the kinds of that by
    the light.
    """
    slopes = np.einsum("kij,jp->kip", (2 * forms).astype(np.float32), light)
    # light moves on a sphere: two directions across it, the first away from the nearest axis
    away = np.where(np.abs(light[2]) < np.float32(0.9), 1.0, 0.0).astype(np.float32)
    first = np.cross(light, np.stack([1 - away, 0 * away, away]), axis=0)
    first /= np.sqrt((first**2).sum(axis=0))
    second = np.cross(light, first, axis=0)
    along, across = (np.einsum("kip,ip->kp", slopes, e) for e in (first, second))
    aa, ab, bb = (along**2).mean(0), (along * across).mean(0), (across**2).mean(0)
    # Cholesky's factor of the matrix of two rows
    root = np.sqrt(aa)
    lean = np.divide(ab, root, out=np.zeros_like(ab), where=root > 0)
    rest = np.sqrt(np.clip(bb - lean**2, 0, None))
    return [root * first + lean * second, rest * second]
