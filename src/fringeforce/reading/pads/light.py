"""From the retardance of a pad to the grey levels of one frame, and back by the adjoint.

What is uncertain about light and camera acts here, whatever causes the retardance: forces on
squares, or contacts anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np

from fringeforce.base.arrays import Array, Mask, Single
from fringeforce.design.parts import Converter
from fringeforce.estimation.covariance import marginal_information
from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.estimation.likelihood import Misfit, Response, misfit
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_uncertainty import PadUncertainty, Reference
from fringeforce.models.pad_unknowns import BLUR, GAMMA, UNEVEN
from fringeforce.optics.area_camera import Lens, Picture
from fringeforce.optics.camera import decoded, encoded, encoded_slope

DARKEST = 0.5
"""Grey level that stands for all below it where a camera is not linear: none is told from it."""
REMEMBERED = 0.9
"""Share of what frames tell about lasting unknowns that the next ones believe, so that about ten
count."""


def nothing() -> Array:
    """Unknowns of a pad without tolerances, shape (0,)."""
    return np.empty(0)


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of the unknowns of tolerances before a frame.

    Attributes
    ----------
    mean : ndarray, shape (q,)
    precision : ndarray, shape (k, k)
        Inverse of the covariance of the first ones; the others are apart, with a variance of one.
    """

    mean: Array
    precision: Array

    @classmethod
    def stated(cls, uncertain: PadUncertainty) -> Prior:
        """By the tolerances, and by what is known of them together."""
        return cls(*uncertain.expected)

    def slope(self, extra: Array) -> Array:
        """Half the derivative of the loss, shape (q,)."""
        off, count = extra - self.mean, len(self.precision)
        return np.concatenate([self.precision @ off[:count], off[count:]])

    def among(self, shown: Mask) -> Array:
        """Precision of some of the unknowns, shape (m, m)."""
        first = np.flatnonzero(shown[: len(self.precision)])
        found = np.eye(int(shown.sum()))
        found[: len(first), : len(first)] = self.precision[np.ix_(first, first)]
        return found

    def loss(self, extra: Array) -> float:
        """Twice the negative logarithm, less a constant."""
        return float((extra - self.mean) @ self.slope(extra))

    def likeliest(self, extra: Array, numbers: list[int]) -> Array:
        """Unknowns of which some have the values that are the likeliest beside the others.

        Parameters
        ----------
        extra : ndarray, shape (q,)
            All unknowns.
        numbers : list of int, length s
            Those that are found.
        """
        found = extra.copy()
        found[numbers] = self.mean[numbers]
        own = self.among(np.isin(np.arange(len(extra)), numbers))
        found[numbers] -= np.linalg.solve(own, self.slope(found)[numbers])
        return found

    def after(self, uncertain: PadUncertainty, extra: Array, curvature: Curvature | None) -> Prior:
        """What is known before the next frame.

        Of what frames told, with the precision P about x, a share r is believed beside what is
        stated, S about m, so that many frames together stay within what is stated:

            P' = S + r (P - S),    P' x' = S m + r (P x - S m).

        Parameters
        ----------
        uncertain : PadUncertainty
            What is uncertain about the pad.
        extra : ndarray, shape (q,)
            The unknowns as a frame tells them.
        curvature : Curvature, optional
            Of all unknowns of that frame under this prior, these last; without one, frames tell as
            much as is forgotten.
        """
        lasting, first = uncertain.lasting, Prior.stated(uncertain)
        here = np.ix_(lasting, lasting)
        stated = first.precision[here]
        told = stated + (self.precision[here] - stated) / REMEMBERED
        if curvature is not None:
            count = curvature.size - len(extra)
            own = curvature.at(np.flatnonzero(lasting) + count)
            others = np.setdiff1d(np.arange(len(curvature.information)), own)
            order = np.concatenate([own, others])
            whole = curvature.information[np.ix_(order, order)]
            told = marginal_information(whole, int(lasting.sum()))
        mean, precision = np.zeros(uncertain.size), np.eye(len(first.precision))
        precision[here] = stated + REMEMBERED * (told - stated)
        expected = stated @ first.mean[lasting]
        pulled = expected + REMEMBERED * (told @ extra[lasting] - expected)
        mean[lasting] = np.linalg.solve(precision[here], pulled)
        return Prior(mean, precision)


def at_likeliest_scale(
    uncertain: PadUncertainty, prior: Prior, extra: Array
) -> tuple[float, Array]:
    """Factor of forces whose light is the same where what scales it is the likeliest, and unknowns.

    Light tells nothing of the scale, so that steps leave it where rounding does.
    """
    numbers = [group.begin for group in uncertain.scaling]
    if not numbers:
        return 1.0, extra
    found = prior.likeliest(extra, numbers)
    return uncertain.share(extra) / uncertain.share(found), found


@dataclass(frozen=True)
class Curve:
    """What a camera that is not linear makes of the grey levels of a linear one.

    Attributes
    ----------
    response : str
        Of the camera, as `encoded` takes it.
    power : float
        Gamma, of the share of the full scale behind the response.
    full : float
        Largest grey level.
    """

    response: str
    power: float
    full: float

    @classmethod
    def of(cls, camera: Converter) -> Curve:
        """That of a camera as drawn."""
        return cls(camera.response, float(camera.gamma), float(camera.full_scale))

    @property
    def straight(self) -> bool:
        """Whether it changes nothing."""
        return self.response == "linear" and self.power == 1

    def _share(self, linear: Array) -> Array:
        return np.maximum(linear, DARKEST) / self.full

    def level(self, linear: Array) -> Array:
        """Grey levels from those of a linear camera."""
        return np.asarray(self.full * encoded(linear / self.full, self.response) ** self.power)

    def slope(self, linear: Array) -> Array:
        """Derivative of these by those."""
        share = self._share(linear)
        steep = encoded_slope(share, self.response)
        if self.power == 1:
            return steep
        shown = encoded(share, self.response)
        return np.asarray(self.power * shown ** (self.power - 1) * steep)

    def by_power(self, linear: Array) -> Array:
        """Derivative of these by gamma."""
        shown = encoded(self._share(linear), self.response)
        return np.asarray(self.full * shown**self.power * np.log(shown))

    def linear(self, level: Array) -> Array:
        """Grey levels of a linear camera."""
        shown = (np.maximum(level, 0.0) / self.full) ** (1 / self.power)
        return self.full * decoded(shown, self.response)

    def straightened(self, frame: Array, response: Response) -> tuple[Array, Response]:
        """Grey levels that a linear camera would give, and its response, with their noise."""
        if self.straight:
            return frame, response
        linear = self.linear(frame)
        # noise behind the curve counts more in the light where the curve is flat
        worse = float(np.mean(self.slope(linear) ** -2.0))
        return linear, replace(response, variance=worse * response.variance)


@dataclass(frozen=True, eq=False, kw_only=True)
class Shone:
    """Retardance, and the light that it causes.

    Attributes
    ----------
    modes : ndarray, shape (2, modes, rows, columns)
        Retardance [rad].
    extra : ndarray, shape (q,)
        Unknowns of tolerances.
    lights : list of ndarray, shape (3, P)
        Light of every channel.
    level : ndarray, shape (channels * P,)
        Expected grey levels.
    pictures : tuple of Picture
        What the channels measure.
    lens : Lens, optional
        What blurs the light.
    amplitude : float
        Of the camera, grey levels; the mean over the picture.
    intensity : ndarray, shape (channels * P,)
        Of the light that pixels get.
    dark : float
        Grey level without light.
    uneven : ndarray, shape (P,), optional
        Light of every pixel over the mean; even if not given.
    curve : Curve, optional
        What the camera makes of grey levels, if it is not linear.
    linear, bend : ndarray, shape (channels * P,), optional
        Grey levels of a linear camera, and the derivative of the expected ones by these.
    """

    modes: Single
    extra: Array
    lights: Sequence[Single]
    level: Array
    pictures: tuple[Picture, ...]
    lens: Lens | None
    amplitude: float
    intensity: Array
    dark: float = 0.0
    uneven: Array | None = None
    curve: Curve | None = None
    linear: Array | None = None
    bend: Array | None = None


@dataclass(frozen=True, eq=False)
class Start:
    """Forces, and the retardance that they cause.

    Attributes
    ----------
    forces : ndarray, shape (3 n,)
        N, T_x, T_y of tactel after tactel [N].
    modes : ndarray, shape (2, modes, rows, columns)
        Retardance [rad].
    extra : ndarray, shape (q,)
        Unknowns of tolerances.
    """

    forces: Array
    modes: Single
    extra: Array = field(default_factory=nothing, kw_only=True)

    def onward(self, share: float, before: Start) -> Start:
        """A share of the way from another to here further on, for retardance follows forces.

        Unknowns of tolerances stay as they are.
        """
        modes = np.float32(1 + share) * self.modes
        modes -= np.float32(share) * before.modes
        forces = self.forces + share * (self.forces - before.forces)
        return Start(forces, modes, extra=self.extra)


@dataclass(frozen=True, eq=False, kw_only=True)
class Place(Start, Shone):
    """Forces, and the light that they cause.

    Attributes
    ----------
    reference : Reference, optional
        What the spread of tractions is relative to, if not these.
    """

    reference: Reference | None = None

    @property
    def about(self) -> Reference:
        """What the spread of tractions is relative to."""
        return self.reference or Reference(self.forces, self.extra)


@dataclass(frozen=True, eq=False)
class FrameLight:
    """One frame, and what light makes of retardance.

    Attributes
    ----------
    model : PadModel
        Of the pad.
    response : Response
        Of its camera.
    frame : ndarray, shape (channels * P,)
        Grey levels.
    used : ndarray of bool, shape (channels * P,), optional
        Pixels that count; all if not given.
    uncertain : PadUncertainty, optional
        What is uncertain about the pad, if anything is.
    curve : Curve, optional
        Of the camera; as drawn if not given.
    """

    model: PadModel
    response: Response
    frame: Array
    used: Mask | None = None
    uncertain: PadUncertainty | None = None
    curve: Curve | None = None

    def shone(self, modes: Single, extra: Array) -> Shone:
        """The light of retardance, shape (2, modes, rows, columns), under unknowns (q,)."""
        known, pictures, lens = self.uncertain, self.model.pictures, self.model.lens
        gain, dark, uneven = 1.0, 0.0, None
        curve = self.curve or Curve.of(self.model.sensor.camera)
        amplitude = float(np.mean(self.response.amplitude))
        if np.ndim(self.response.amplitude):
            pixels = len(self.frame) // len(self.model.pictures)
            uneven = np.ravel(self.response.amplitude / amplitude)[:pixels]
        if known is not None:
            camera = known.camera
            pictures, lens = camera.pictures(extra), camera.lens(extra)
            curve = replace(curve, power=camera.gamma(extra))
            gain, dark = camera.gain(extra), camera.dark(extra)
            if shade := known.group(UNEVEN):
                uneven = 1.0 + known.shades.field(extra[shade.place]).ravel() / gain
        lights = [self.model.light(modes, picture) for picture in pictures]
        seen = [
            self.model.measured(light, picture, lens)
            for light, picture in zip(lights, pictures, strict=True)
        ]
        intensity = np.concatenate(seen).astype(float)
        dark = float(self.response.offset + dark)
        lit = intensity if uneven is None else np.tile(uneven, len(seen)) * intensity
        level, linear, bend = np.asarray(gain * amplitude * lit + dark), None, None
        bent = not curve.straight or (known is not None and known.group(GAMMA) is not None)
        if bent:
            linear = level
            level, bend = curve.level(linear), curve.slope(linear)
        return Shone(
            modes=modes,
            extra=extra,
            lights=lights,
            level=level,
            pictures=pictures,
            lens=lens,
            amplitude=float(gain * amplitude),
            intensity=intensity,
            dark=dark,
            uneven=uneven,
            curve=curve if bent else None,
            linear=linear,
            bend=bend,
        )

    def misfit(self, level: Array) -> Misfit:
        """What grey levels leave of the frame; nothing at pixels that do not count."""
        if self.used is None:
            return misfit(self.frame, level, self.response)
        few = misfit(self.frame[self.used], level[self.used], self.response)
        slope, weight = np.zeros((2, len(self.frame)))
        slope[self.used], weight[self.used] = few.slope, few.weight
        return Misfit(few.loss, slope, weight)

    def back(self, here: Shone, slope: Array) -> tuple[Single, Array]:
        """Half the derivative of the loss by the modes, and what light and camera add by unknowns.

        Parameters
        ----------
        here : Shone
            Where to take them.
        slope : ndarray, shape (channels * P,)
            Of the misfit there.

        Returns
        -------
        by_modes : ndarray, shape (2, modes, rows, columns)
        by_extra : ndarray, shape (q,)
        """
        scale = np.float32(here.amplitude / np.sqrt(self.response.variance))
        bent = slope if here.bend is None else slope * here.bend
        pulls = (scale * bent.astype(np.float32)).reshape(len(here.lights), -1)
        if here.uneven is not None:
            pulls *= here.uneven.astype(np.float32)
        by_modes = reduce(
            np.add,
            (
                self.model.picture_adjoint(here.modes, picture, light, pull, here.lens)
                for picture, light, pull in zip(here.pictures, here.lights, pulls, strict=True)
            ),
        )
        known = self.uncertain
        if known is None:
            return by_modes, np.zeros(0)
        unit = bent / np.sqrt(self.response.variance)
        lit = np.mean(self.response.amplitude) * here.intensity
        bright = float(np.vdot(unit, lit))
        camera, found = known.camera, np.zeros(known.size)
        found[: camera.size] = bright * camera.brightness + float(unit.sum()) * camera.darkness
        found[: camera.size] += camera.by_registration(here.modes, by_modes)
        if shade := known.group(UNEVEN):
            image = (unit * lit).reshape(len(here.lights), *self.model.frame_shape[-2:])
            found[shade.place] = known.shades.adjoint(image.sum(axis=0))
        gamma = known.group(GAMMA)
        if gamma and here.curve is not None and here.linear is not None:
            steep = here.curve.by_power(here.linear) / np.sqrt(self.response.variance)
            found[gamma.begin] = gamma.std * float(slope @ steep)
        for number, changes in camera.forms:
            for pull, picture, light, change in zip(
                pulls, here.pictures, here.lights, changes, strict=True
            ):
                turned = replace(picture, forms=change)
                found[number] += np.vdot(pull, self.model.measured(light, turned, here.lens))
        if blur := known.group(BLUR):
            low, high, apart = camera.lens_change(here.extra)
            for pull, picture, light in zip(pulls, here.pictures, here.lights, strict=True):
                ends = (self.model.measured(light, picture, lens) for lens in (high, low))
                found[blur.begin] += np.vdot(pull, np.subtract(*ends)) / apart
        return by_modes, found


def expected_response(response: Response, uncertain: PadUncertainty | None) -> Response:
    """A camera under the light that is expected of every pixel, if that is known."""
    light = None if uncertain is None else uncertain.expected_light
    if uncertain is None or light is None:
        return response
    channels = len(uncertain.model.pictures)
    return replace(response, amplitude=response.amplitude * np.tile(light.ravel(), channels))
