"""From loads and all that is uncertain to the grey levels of a frame, in compiled loops.

The equations are those of `frame_model`.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from numpy.typing import NDArray

from fringeforce.estimation.compiling import apart, copied, sums, sums_entry
from fringeforce.estimation.frame_model import FrameModel

Array = NDArray[np.float64]

NARROWEST_BLUR = 0.5
"""Deviation of the point spread below which it is no longer told from none [pixels]."""
KERNEL_REACH = 5.0
"""Deviations as far as a kernel reaches: a millionth of the light lies beyond, so that the loss
does not jump where the kernel grows by a pixel."""
_PI, _PI_REST = 3.14159265160560607910, 1.98418714791870343106e-9
# through Chebyshev's nodes of half a period, in the square
_SINE, _COSINE = (
    Chebyshev.interpolate(function, 7, [0, np.pi**2 / 4]).convert(kind=Polynomial).coef
    for function in (lambda x: np.sinc(np.sqrt(x) / np.pi), lambda x: np.cos(np.sqrt(x)))
)
_S0, _S1, _S2, _S3, _S4, _S5, _S6, _S7 = map(float, _SINE)
_C0, _C1, _C2, _C3, _C4, _C5, _C6, _C7 = map(float, _COSINE)


@sums
def patch_moments(place, half, profile, mean, by_place, by_half):
    """Moments of a traction at a place, and their derivatives by that and its half width.

    Those of (place + half u)^k, where u has the weight (1 - u^2)^(profile - 1), are Gegenbauer's
    polynomials (Laplace's integral, DLMF 18.10.4), which follow each other in three terms.
    """
    squares = place * place - half * half
    mean[0], by_place[0], by_half[0] = 1.0, 0.0, 0.0
    if len(mean) > 1:
        mean[1], by_place[1], by_half[1] = place, 1.0, 0.0
    for k in range(2, len(mean)):
        scale = 1 / (k + 2 * profile - 1)
        one, two = 2 * (k + profile - 1) * scale * place, (k - 1) * scale
        mean[k] = one * mean[k - 1] - two * squares * mean[k - 2]
        by_place[k] = k * mean[k - 1]
        by_half[k] = one * by_half[k - 1] - two * (
            squares * by_half[k - 2] - 2 * half * mean[k - 2]
        )


def positive(value, soft):
    """A smooth function that is `value` where that is large and 0 where it is very negative."""
    root = np.sqrt(value * value + soft * soft)
    return (value + root) / 2, 0.5 * (1 + value / root)


positive_in_loops = sums(positive)
"""The same where compiled functions call it."""


@sums
def dot(a, b):
    """Sum of the products of two lines."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@apart
def contact_moments(model, unknowns, moments):
    """Mixtures of moments of every contact, and derivatives, into `moments`, shape (n, 4, k).

    The derivatives are those by its place [1/m], by its width's unknown and by the scale of what it
    adds that is not as drawn.  The place is where the camera sees it, beside its tactel.
    """
    at, order = model.at, model.mixing.shape[1]
    own, one, other = np.empty(order), np.empty(order), np.empty(order)
    placed, wider = at.width > at.place, at.fields > at.width
    scale, drawn = 1.0, np.zeros(moments.shape[2])
    for k in range(len(drawn)):
        for i in range(len(model.drawn)):
            drawn[k] += model.mixing[k, i] * model.drawn[i]
    for d in range(len(model.scaling)):
        scale += model.scaling[d] * (unknowns[at.modes + d] - model.origin[d])
    for j in range(len(moments)):
        if j > 0 and not (placed or wider or len(model.moving) > 0):
            for x in range(4):
                for k in range(moments.shape[2]):
                    moments[j, x, k] = moments[0, x, k]
            continue
        shift = model.place * unknowns[at.place + j] if placed else 0.0
        for d in range(len(model.moving)):
            shift += model.moving[d, j] * (unknowns[at.modes + d] - model.origin[d])
        wide, slope = model.width, 0.0
        if wider:
            wide, slope = positive_in_loops(
                wide + model.width_std * unknowns[at.width + j], model.narrow
            )
        half = wide / (2 * model.reach)
        patch_moments(shift / model.reach, half, model.profile, own, one, other)
        along, across = 1 / model.reach, slope / 2 * model.width_std / model.reach
        for k in range(moments.shape[2]):
            a = b = c = 0.0
            for i in range(order):
                share = model.mixing[k, i]
                a += share * own[i]
                b += share * one[i]
                c += share * other[i]
            moments[j, 0, k] = drawn[k] + scale * (a - drawn[k])
            moments[j, 1, k], moments[j, 2, k] = scale * along * b, scale * across * c
            moments[j, 3, k] = a - drawn[k]


@apart
def bend(curvature, unknowns, out):
    """Add the second order of the phase in the loads to `out`, shape (m,)."""
    for a in range(len(curvature)):
        for b in range(a + 1):
            factor, row = unknowns[a] * unknowns[b] * (1.0 if a == b else 2.0), curvature[a, b]
            for i in range(len(out)):
                out[i] += factor * row[i]


@apart
def bend_columns(curvature, unknowns, columns):
    """Add its change with every load to `columns`, shape (size, m)."""
    for a in range(len(curvature)):
        own = columns[a]
        for b in range(len(curvature)):
            factor, row = 2 * unknowns[b], curvature[a, b]
            for i in range(len(own)):
                own[i] += factor * row[i]


@apart
def fill_node_phase(model, unknowns, out):
    """Phase lead at the nodes, into `out`, shape (m,)."""
    order, at = model.profiles.shape[2], model.at
    moments = np.empty((len(model.moments), 4, order))
    contact_moments(model, unknowns, moments)
    copied(model.fixed, out)
    for j in range(len(moments)):
        for c in range(2):
            force = unknowns[2 * j + c]
            for k in range(order):
                factor, row = force * moments[j, 0, k], model.profiles[j, c, k]
                for i in range(len(out)):
                    out[i] += factor * row[i]
            for d in range(len(model.influence)):
                factor = force
                for q in range(model.influence.shape[1]):
                    factor *= unknowns[at.modes + d]
                    row = model.influence[d, q, j, c]
                    for i in range(len(out)):
                        out[i] += factor * row[i]
    bend(model.curvature, unknowns, out)
    for r in range(len(model.fields)):
        factor, row = unknowns[at.fields + r], model.fields[r]
        for i in range(len(out)):
            out[i] += factor * row[i]


@apart
def fill_columns(model, unknowns, columns):
    """Change of the phase at the nodes with every unknown that has one, shape (size, m)."""
    order, at = model.profiles.shape[2], model.at
    moments = np.empty((len(model.moments), 4, order))
    contact_moments(model, unknowns, moments)
    placed, scaled = at.width > at.place or len(model.moving) > 0, len(model.scaling) > 0
    slope, beyond = np.empty(len(model.fixed)), np.zeros(len(model.fixed))
    columns[:] = 0.0
    for j in range(len(moments)):
        slope[:] = 0.0
        for c in range(2):
            force, own = unknowns[2 * j + c], columns[2 * j + c]
            for k in range(order):
                row, a = model.profiles[j, c, k], moments[j, 0, k]
                for i in range(len(row)):
                    own[i] += a * row[i]
                if placed:
                    b = force * moments[j, 1, k]
                    for i in range(len(row)):
                        slope[i] += b * row[i]
                if scaled:
                    b = force * moments[j, 3, k]
                    for i in range(len(row)):
                        beyond[i] += b * row[i]
                if at.fields > at.width:
                    wide, b = columns[at.width + j], force * moments[j, 2, k]
                    for i in range(len(row)):
                        wide[i] += b * row[i]
            for d in range(len(model.influence)):
                e, turned, power = unknowns[at.modes + d], columns[at.modes + d], 1.0
                for q in range(model.influence.shape[1]):
                    row, factor = model.influence[d, q, j, c], force * (q + 1) * power
                    power *= e
                    for i in range(len(row)):
                        own[i] += power * row[i]
                        turned[i] += factor * row[i]
        if at.width > at.place:
            beside = columns[at.place + j]
            for i in range(len(slope)):
                beside[i] += model.place * slope[i]
        for d in range(len(model.moving)):
            factor, turned = model.moving[d, j], columns[at.modes + d]
            for i in range(len(slope)):
                turned[i] += factor * slope[i]
    for d in range(len(model.scaling)):
        factor, turned = model.scaling[d], columns[at.modes + d]
        for i in range(len(beyond)):
            turned[i] += factor * beyond[i]
    bend_columns(model.curvature, unknowns, columns)
    for r in range(len(model.fields)):
        copied(model.fields[r], columns[at.fields + r])


@apart
def kernel_of(deviation):
    """One half of a Gaussian kernel, from its middle, as `optics.camera.blurred` says.

    The discrete Gaussian exp(-t) I_k(t) of variance t is found downwards from I_(k-1)(t) =
    (2k / t) I_k(t) + I_(k+1)(t) (Miller's method).
    """
    reach = int(KERNEL_REACH * deviation) + 2
    kernel, t = np.zeros(reach + 1), deviation * deviation
    if deviation >= 1:
        for step in range(reach + 1):
            kernel[step] = np.exp(-0.5 * (step / deviation) ** 2)
    elif t > 1e-12:
        kernel[reach] = t**reach
        after = 0.0
        for step in range(reach, 0, -1):
            kernel[step - 1] = 2 * step / t * kernel[step] + after
            after = kernel[step]
    else:
        kernel[0] = 1.0
    total = kernel[0]
    for step in range(1, reach + 1):
        total += 2 * kernel[step]
    for step in range(reach + 1):
        kernel[step] /= total
    return kernel


@apart
def blurred(line, kernel, out):
    """A line behind a symmetric kernel; what lies beyond its ends is as the ends are."""
    size, reach = len(line), len(kernel) - 1
    padded = np.empty(size + 2 * reach)
    copied(line, padded[reach : reach + size])
    padded[:reach] = line[0]
    padded[reach + size :] = line[size - 1]
    for p in range(size):
        out[p] = kernel[0] * padded[reach + p]
    for step in range(1, reach + 1):
        factor = kernel[step]
        for p in range(size):
            out[p] += factor * (padded[reach + p - step] + padded[reach + p + step])


@sums
def half_waves(phase):
    """Sine and cosine of half a phase, both perhaps with the other sign, to 1e-13.

    As `vector_loops.waves`: polynomials run in vector units, which the library's functions do not.
    """
    half = 0.5 * phase
    turns = np.floor(half * (1 / np.pi) + 0.5)
    half = (half - turns * _PI) - turns * _PI_REST
    x = half * half
    sine = _S0 + x * (_S1 + x * (_S2 + x * (_S3 + x * (_S4 + x * (_S5 + x * (_S6 + x * _S7))))))
    cosine = _C0 + x * (_C1 + x * (_C2 + x * (_C3 + x * (_C4 + x * (_C5 + x * (_C6 + x * _C7))))))
    return half * sine, cosine


@sums
def lens(model, unknowns):
    """Visibility, deviation of the point spread and its derivative by its unknown.

    No spread is wider than the line: steps far from any top try any, and kernels grow with it.
    """
    at, seen = model.at, model.visibility
    if at.blur > at.visibility:
        seen += model.visibility_std * unknowns[at.visibility]
    deviation, slope = model.blur, 0.0
    if at.gamma > at.blur:
        deviation, slope = positive_in_loops(
            model.blur + model.blur_std * unknowns[at.blur], NARROWEST_BLUR
        )
        slope *= model.blur_std
        widest = float(len(model.amplitude))
        if deviation > widest:
            deviation, slope = widest, 0.0
    return seen, deviation, slope


@sums
def power_of(model, unknowns):
    """Power of the camera's response."""
    if model.at.crosstalk > model.at.gamma:
        return model.gamma + model.gamma_std * unknowns[model.at.gamma]
    return model.gamma


@apart
def channel_shares(model, unknowns):
    """Cross-talk with what is unknown of it, as `FrameModel.crosstalk`."""
    shares = model.crosstalk.copy()
    for k in range(len(model.leaks)):
        e, leak = unknowns[model.at.crosstalk + k], model.leaks[k]
        for c in range(len(shares)):
            for d in range(shares.shape[1]):
                shares[c, d] += e * leak[c, d]
    return shares


@sums
def mix(shares, lines, out):
    """Lines of all channels in turn, mixed by a row of shares, into `out`; one more is added."""
    pixels = len(out)
    channels = len(lines) // pixels
    out[:] = shares[channels] if len(shares) > channels else 0.0
    for d in range(channels):
        share, line = shares[d], lines[d * pixels : (d + 1) * pixels]
        for p in range(pixels):
            out[p] += share * line[p]


@sums
def encoded(model, gamma, light):
    """Grey level of the camera's response to a linear one, and its derivative."""
    share, slope = max(light / model.full_scale, 1e-6), 1.0
    if model.srgb:
        if share <= 0.0031308:
            share, slope = 12.92 * share, 12.92
        else:
            power = share ** (1 / 2.4)
            slope = 1.055 * power / (2.4 * share)
            share = 1.055 * power - 0.055
    if gamma == 1.0:
        return model.full_scale * share, slope
    grey = share**gamma
    return model.full_scale * grey, slope * gamma * grey / share


@sums
def by_gamma_of(model, unknowns, level):
    """Derivative of a grey level by the power of the response."""
    share = max(level / model.full_scale, 1e-6)
    return level * np.log(share) / power_of(model, unknowns)


@sums
def _interpolated(model, nodes, out):
    """Values at the pixels of one channel or all, from those at the nodes."""
    begin, weights = 0, model.weights
    while begin < len(out):
        i, end = model.first[begin], begin + 1
        while end < len(out) and model.first[end] == i:
            end += 1
        a, b, c, d = nodes[i], nodes[i + 1], nodes[i + 2], nodes[i + 3]
        for p in range(begin, end):
            out[p] = (weights[p, 0] * a + weights[p, 1] * b) + (
                weights[p, 2] * c + weights[p, 3] * d
            )
        begin = end


@apart
def _light(model, unknowns, bright, dark):
    """Fill in the amplitude relative to the nominal one, and the offset."""
    at, m = model.at, len(model.fixed)
    channels = len(model.bias)
    pixels = len(dark) // channels
    if len(model.brightness) == 0:
        bright[:] = 1.0
        copied(model.offset, dark)
        return
    more, darker = np.ones(channels * m), np.zeros(channels * m)
    for s in range(len(model.brightness)):
        e = unknowns[at.modes + s]
        for i in range(len(more)):
            more[i] += e * model.brightness[s, i]
            darker[i] += e * model.darkness[s, i]
    for c in range(channels):
        lines, nodes = slice(c * pixels, (c + 1) * pixels), slice(c * m, (c + 1) * m)
        _interpolated(model, more[nodes], bright[lines])
        _interpolated(model, darker[nodes], dark[lines])
    for p in range(len(dark)):
        dark[p] += model.offset[p]


@apart
def fill_exposure(model, unknowns, work):
    """Grey levels of a frame; `work` holds what derivatives need of it."""
    nodes, phase, swing, seen, level, slope, bright = work
    fill_node_phase(model, unknowns, nodes)
    contrast, deviation, _ = lens(model, unknowns)
    channels = len(model.bias)
    pixels = len(phase) // channels
    gamma = power_of(model, unknowns)
    linear = gamma == 1.0 and not model.srgb
    _interpolated(model, nodes, phase)
    for c in range(channels):
        ratio, bias, spread = model.dispersion[c], model.bias[c], model.spread[c]
        for p in range(c * pixels, (c + 1) * pixels):
            phase[p] *= ratio
            sine, _ = half_waves(phase[p] + bias)
            swing[p] = 1 - 2 * sine * sine
        if spread > 0:
            for p in range(c * pixels, (c + 1) * pixels):
                swing[p] *= np.exp(-0.5 * (spread * phase[p]) ** 2)
    shares, mixed = channel_shares(model, unknowns), np.empty(pixels)
    for c in range(channels):
        lines = slice(c * pixels, (c + 1) * pixels)
        line = swing[lines]
        if len(shares) > 0:
            mix(shares[c], swing, mixed)
            line = mixed
        if deviation > 0:
            blurred(line, kernel_of(deviation), seen[lines])
        else:
            copied(line, seen[lines])
    _light(model, unknowns, bright, slope)
    for p in range(len(phase)):
        level[p] = slope[p] + model.amplitude[p] * bright[p] * (1 - contrast * seen[p]) / 2
        slope[p] = 1.0
    if not linear:
        for p in range(len(phase)):
            level[p], slope[p] = encoded(model, gamma, level[p])


@apart
def fill_slopes(model, unknowns, work, out):
    """Minus the derivative of every channel's fringes by the phase lead, without a point spread."""
    _, phase, swing, _, _, _, _ = work
    channels = len(model.bias)
    pixels = len(phase) // channels
    for c in range(channels):
        ratio, bias, spread = model.dispersion[c], model.bias[c], model.spread[c]
        for p in range(c * pixels, (c + 1) * pixels):
            sine, cosine = half_waves(phase[p] + bias)
            out[p] = 2 * ratio * sine * cosine
        if spread > 0:
            for p in range(c * pixels, (c + 1) * pixels):
                share = np.exp(-0.5 * (spread * phase[p]) ** 2)
                out[p] = share * out[p] + ratio * spread * spread * phase[p] * swing[p]
    shares = channel_shares(model, unknowns)
    if len(shares) > 0:
        own = out.copy()
        for c in range(channels):
            mix(shares[c, :channels], own, out[c * pixels : (c + 1) * pixels])


@sums
def workspace(model):
    """Room for what `fill_exposure` leaves: nodes, phase, swing, blurred, level, slope, bright."""
    nodes, pixels = len(model.fixed), len(model.amplitude)
    return (
        np.empty(nodes),
        np.empty(pixels),
        np.empty(pixels),
        np.empty(pixels),
        np.empty(pixels),
        np.empty(pixels),
        np.empty(pixels),
    )


@sums_entry
def expose(model, unknowns):
    """Grey levels of a frame, shape (P,), and the phase lead at the nodes, shape (m,).

    Parameters
    ----------
    model : FrameModel
        What makes a frame.
    unknowns : ndarray, shape (size,)
        Loads [N] and standardised unknowns.
    """
    work = workspace(model)
    fill_exposure(model, unknowns, work)
    return work[4], work[0]


@sums_entry
def node_phase(model, unknowns):
    """Phase lead at the nodes, shape (m,) [rad]; parameters as of `expose`."""
    out = np.empty(len(model.fixed))
    fill_node_phase(model, unknowns, out)
    return out


@sums_entry
def node_columns(model, unknowns):
    """Change of the phase at the nodes with every unknown, shape (size, m); as of `expose`."""
    columns = np.empty((model.at.size, len(model.fixed)))
    fill_columns(model, unknowns, columns)
    return columns


@sums_entry
def point_spread(model, unknowns):
    """One half of the point spread, from its middle, shape (k,); empty if there is none.

    Parameters are those of `expose`.
    """
    deviation = lens(model, unknowns)[1]
    return kernel_of(deviation) if deviation > 0 else np.empty(0)


@sums_entry
def shares_of_channels(model, unknowns):
    """As `channel_shares`, for Python."""
    return channel_shares(model, unknowns)


@sums_entry
def contact_mixtures(model, unknowns, moments):
    """As `contact_moments`, for Python."""
    contact_moments(model, unknowns, moments)


@sums_entry
def contact_columns(model, unknowns):
    """Change of the phase per force with each contact's place, its width's unknown and its scale.

    Parameters
    ----------
    model, unknowns
        As of `expose`.

    Returns
    -------
    ndarray, shape (3, n, 2, m)
        Place, width and scale of what is not as drawn, contact, component, node: rad/(N m) and
        rad/N.
    """
    tactels, components, order, nodes = model.profiles.shape
    found = np.zeros((3, tactels, components, nodes))
    moments = np.empty((tactels, 4, order))
    contact_moments(model, unknowns, moments)
    for j in range(tactels):
        for c in range(components):
            for k in range(order):
                for i in range(nodes):
                    found[0, j, c, i] += moments[j, 1, k] * model.profiles[j, c, k, i]
                    found[1, j, c, i] += moments[j, 2, k] * model.profiles[j, c, k, i]
                    found[2, j, c, i] += moments[j, 3, k] * model.profiles[j, c, k, i]
    return found


def influence_slopes(model: FrameModel, unknowns: Array) -> Array:
    """Change of the influence matrix with its modes, at some unknowns.

    Parameters
    ----------
    model, unknowns
        As of `expose`.

    Returns
    -------
    ndarray, shape (d, n, 2, m)
        At the nodes [rad/N].
    """
    at, powers = model.at, np.arange(model.influence.shape[1])
    e = unknowns[at.modes : at.modes + len(model.influence), None]
    found = np.einsum("dq,dqncm->dncm", (powers + 1) * e**powers, model.influence)
    if not len(model.moving) and not len(model.scaling):
        return np.asarray(found)
    by_place, _, by_scale = contact_columns(model, unknowns)
    if len(model.moving):
        found += np.einsum("dn,ncm->dncm", model.moving, by_place)
    if len(model.scaling):
        found += np.einsum("d,ncm->dncm", model.scaling, by_scale)
    return np.asarray(found)
