"""From a fit to a calibrated model: its covariance as modes, and what is to be said of it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fringeforce.base.arrays import Array, Index
from fringeforce.calibration.bench import SCALE, SHIFT
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.bench_posterior import GROUPS
from fringeforce.calibration.bench_record import bench_record
from fringeforce.calibration.checks import see_strip
from fringeforce.calibration.crosstalk import allowed_shares
from fringeforce.calibration.design_entries import POSITIONS, entries, names, units, values, varied
from fringeforce.calibration.design_jacobian import design_jacobian
from fringeforce.calibration.findings import findings, unidentified, with_readings
from fringeforce.calibration.fit import BenchFit
from fringeforce.calibration.judgement import judgement
from fringeforce.calibration.strip_search import StripSearch
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.design.light import pairs_of_channels
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Tolerances, with_values
from fringeforce.estimation.frame_exposure import NARROWEST_BLUR, positive
from fringeforce.models.as_built import PLACEMENT, WIDTH
from fringeforce.models.imaging import Calibration, Imaging
from fringeforce.models.strip import SensorModel, characterize

LEFT_OUT = 0.001
"""Share of what the calibration adds to the readings' variances that need not be kept."""


def calibrated_strip(
    search: StripSearch, fit: BenchFit, levels: Array, loads: BenchLoads | TimedLoads
) -> SensorModel:
    """The calibrated model with its covariance.

    Parameters
    ----------
    search : StripSearch
        Where it was found.
    fit : BenchFit
        The fit.
    levels : ndarray, shape (F, P)
        Frames with loads.
    loads : BenchLoads or TimedLoads
        What was written down for them.
    """
    known = loads if isinstance(loads, BenchLoads) else loads.at(fit.delay)
    sensor, paths, at = fit.sensor, fit.paths, fit.posterior.bench.at
    shared = fit.state.shared
    covariance = fit.covariance * max(fit.chi2, 1.0)
    order = _entry_order(fit)
    design, (shift, scale) = shared[order], shared[at.own("camera")]
    made = _made(fit)
    model, origin = _corrected(characterize(made), fit)
    whole = names(sensor, paths)
    single = np.array([path != POSITIONS for path in entries(sensor, paths)], dtype=bool)
    leaks = np.arange(at.crosstalk, at.written)
    named = np.concatenate([order, np.arange(at.camera, at.height), leaks])
    shares = _crosstalk(fit)
    unit = np.concatenate([units(sensor, paths, design), [SHIFT, SCALE], shares.std])
    own = fit.covariance[np.ix_(order[single], order[single])]
    root = _root(fit, covariance)
    calibration = Calibration(
        names=(*whole, "camera shift", "camera scale", *shares.names),
        drawing=np.concatenate(
            [values(sensor, paths, np.zeros(len(whole))), [0.0, 1.0], shares.drawing]
        ),
        values=np.concatenate(
            [values(sensor, paths, design), [shift * SHIFT, 1 + scale * SCALE], shares.values]
        ),
        covariance=covariance[np.ix_(named, named)] * np.outer(unit, unit),
        unidentified=unidentified(tuple(np.array(whole)[single].tolist()), own),
        outliers=tuple(np.flatnonzero(~fit.kept[: len(levels)]).tolist()),
        dead=tuple(np.flatnonzero(~fit.sound).tolist()),
        chi2=fit.chi2,
        findings=(),
        checked=tuple(fit.checked),
        delay=fit.delay,
        modes=root[np.r_[: len(order) + 2, len(root) - len(leaks) : len(root)]] * unit[:, None],
        scatter=_scatter(fit),
    )
    model = replace(
        model,
        imaging=_imaging(fit, root),
        calibration=calibration,
        provenance={
            **model.provenance,
            "method": "finite elements, calibrated",
            "calibration frames": int(fit.kept[: len(levels)].sum()),
            **origin,
        },
    )
    found = zip(calibration.values.tolist(), calibration.std.tolist(), strict=True)
    paths = (name.replace("camera ", "camera.") for name in calibration.names)
    judged = judgement(fit, levels, known, dict(zip(paths, found, strict=True)))
    model = replace(model, calibration=replace(calibration, usable=judged.usable))
    record = with_readings(bench_record(search, fit, levels, known), model, levels)
    calibration = replace(calibration, usable=judged.usable, record=record)
    model = replace(model, calibration=calibration)
    said = findings(model, levels, known, fit.kept[len(levels) :])
    return replace(model, calibration=replace(calibration, findings=(*judged.words, *said)))


def _made(fit: BenchFit) -> Sensor:
    """The design as found; contacts keep their tolerances, and all else was found."""
    stated = {
        path: std for path, std in fit.sensor.tolerances.items() if path in (PLACEMENT, WIDTH)
    }
    found = varied(fit.sensor, fit.paths, fit.state.shared[_entry_order(fit)])
    blur, gamma = _lens(fit)[0].tolist()
    known = {"camera.unevenness": 0.0, "transducer.influence_error": 0.0}
    shares = _crosstalk(fit)
    told = dict(zip(shares.names, shares.values.tolist(), strict=True))
    known |= allowed_shares(found.polariscope, told)
    return with_values(found, {"camera.blur": blur, "camera.gamma": gamma, **known}).model_copy(
        update={"tolerances": Tolerances(stated)}
    )


class _Crosstalk(NamedTuple):
    """Shares of light that the drawing gives a tolerance: paths, as drawn, as found, tolerances."""

    names: tuple[str, ...]
    drawing: Array
    values: Array
    std: Array


def _crosstalk(fit: BenchFit) -> _Crosstalk:
    """Cross-talk that was unknown, in the order of its unknowns."""
    sensor, tolerances = fit.sensor, fit.sensor.tolerances
    pairs = pairs_of_channels(len(sensor.polariscope.pictures))
    paths = tuple(path for path in pairs if tolerances.get(path))
    drawn = np.array([sensor.polariscope.crosstalk[c][d] for c, d in (pairs[p] for p in paths)])
    std = np.array([tolerances[path] for path in paths])
    found = drawn + std * fit.state.shared[fit.posterior.bench.at.own("crosstalk")]
    return _Crosstalk(paths, drawn, found, std)


def _corrected(model: SensorModel, fit: BenchFit) -> tuple[SensorModel, dict[str, str]]:
    """The model with the errors of its columns that were found, and words on them."""
    bench = fit.posterior.bench
    if bench.columns is None or not (fit.shown("height") or fit.shown("slope")):
        return model, {}
    errors = fit.state.shared[bench.at.height : bench.at.residual]
    change = bench.columns.correction(errors, model.x).reshape(model.psi.shape)
    share = np.sqrt(np.square(change).sum() / np.square(model.psi).sum())
    words = f"{share:.2%}, smooth over {1e3 * bench.columns.depth:.2g} mm"
    return replace(model, psi=model.psi + change), {"column correction": words}


def _entry_order(fit: BenchFit) -> Index:
    """Where the entries of the design, places of tactels included, stand among the unknowns."""
    at = fit.posterior.bench.at
    owners = np.array(entries(fit.sensor, fit.paths))
    order = np.empty(len(owners), dtype=int)
    places = owners == POSITIONS
    order[~places] = np.arange(at.design, at.camera)
    order[places] = at.written + np.arange(places.sum())
    return order


def _lens(fit: BenchFit) -> tuple[Array, Array]:
    """Blur [m] and gamma of the camera, and what their unknowns change in them; shapes (2,)."""
    template, at = fit.posterior.bench.template, fit.posterior.bench.at
    camera, shared = fit.sensor.camera, fit.state.shared
    pixel = fit.sensor.transducer.length / camera.pixels
    blur, slope = positive(template.blur + template.blur_std * shared[at.blur], NARROWEST_BLUR)
    power = template.gamma / camera.gamma  # of the response itself
    gamma = template.gamma + template.gamma_std * shared[at.gamma]
    changes = slope * template.blur_std * pixel, template.gamma_std / power
    return np.array([blur * pixel, gamma / power]), np.array(changes)


def _scatter(fit: BenchFit) -> tuple[float, ...]:
    """How much loads and lamp scatter as stated or as found; `Calibration.scatter`."""
    posterior, size = fit.posterior, fit.posterior.bench.contacts.size
    unit = {"place": size.place, "width": size.width_std} | _lamp(fit)
    found, kept = [], np.flatnonzero(fit.kept).tolist()
    for name in GROUPS:
        squares = [
            1 / (posterior.precision(f)[posterior.group(name, f)] * posterior.unit(name, f) ** 2)
            for f in kept
        ]
        found.append(float(np.sqrt(np.mean(np.concatenate(squares)))) * unit.get(name, 1.0))
    return tuple(found)


def _lamp(fit: BenchFit) -> dict[str, float]:
    """Units of a frame's own gain, and of its offset in grey levels."""
    lamp = fit.posterior.bench.lamp
    return {"gain": float(lamp[0, 0, 0]), "offset": float(lamp[1, 1, 0])}


def _root(fit: BenchFit, covariance: Array) -> Array:
    """Modes of what readings need of the covariance: design, camera, columns, fields, lens.

    If columns enter, modes are turned so that they show in readings of the calibration's frames one
    after the other, and those that add next to nothing are left out.
    """
    at = fit.posterior.bench.at
    order = np.concatenate([_entry_order(fit), np.arange(at.camera, at.written)])
    root = _square_root(covariance[np.ix_(order, order)])
    if fit.posterior.bench.columns is None:
        return root
    sizes, turn = np.linalg.eigh(root.T @ fit.moved[np.ix_(order, order)] @ root)
    sizes, turn = np.maximum(sizes[::-1], 0.0), turn[:, ::-1]
    enough = int(np.searchsorted(np.cumsum(sizes), (1 - LEFT_OUT) * sizes.sum())) + 1
    return np.asarray(root @ turn[:, :enough], dtype=float)


def _square_root(covariance: Array) -> Array:
    """A square root R R' of a covariance, which wrong loads may leave singular but for rounding."""
    try:
        return np.asarray(np.linalg.cholesky(covariance), dtype=float)
    except np.linalg.LinAlgError:
        sizes, turn = np.linalg.eigh((covariance + covariance.T) / 2)
        return np.asarray(turn * np.sqrt(np.maximum(sizes, 0.0)), dtype=float)


def _crosstalk_modes(fit: BenchFit, root: Array) -> Array | None:
    """`Imaging.crosstalk_modes`, from the modes of the shares that were unknown."""
    shares = _crosstalk(fit)
    if not shares.names:
        return None
    paths = list(pairs_of_channels(len(fit.sensor.polariscope.pictures)))
    modes = np.zeros((root.shape[1], len(paths)))
    modes[:, [paths.index(path) for path in shares.names]] = root.T * shares.std
    return modes


def _imaging(fit: BenchFit, root: Array) -> Imaging:
    """Registration, light and residual, with their modes as of `_root`."""
    bench, shared = fit.posterior.bench, fit.state.shared
    sensor, at, template = fit.sensor, bench.at, bench.template
    positions = bench.positions(shared, sensor.pixel_positions)
    seen = np.tile(see_strip(sensor, positions), len(template.bias))
    entries_at = _entry_order(fit)
    design = shared[entries_at]
    jacobian = design_jacobian(sensor, fit.paths, design)
    slope = jacobian.matrix(design, positions, slope=True)
    changes = np.concatenate(
        [
            jacobian.at(positions)[1:],
            [slope * SHIFT, slope * (sensor.pixel_positions * SCALE)[:, None]],
        ]
    )  # (d + 2, P, 2n)
    begins = len(entries_at) - at.camera + np.array(at)
    height, residual, bright, blur = begins[[2, 4, 5, 7]]
    influence = np.tensordot(root[:height].T, changes, 1)
    if bench.columns is not None:
        influence += bench.columns.correction(root[height:residual].T, positions)

    def pixels(rows: Array) -> Array:
        """Values at the pixels of each channel, from those at the nodes."""
        nodes = len(template.fixed)
        own = rows.reshape(len(rows), rows.shape[1] // nodes, nodes)
        first, weights = template.first[: len(positions)], template.weights[: len(positions)]
        values = sum(own[..., first + k] * weights[:, k] for k in range(4))
        return np.asarray(values).reshape(len(rows), -1)

    fields = pixels(template.fields)
    brightness, darkness = pixels(template.brightness), pixels(template.darkness)
    light = shared[at.bright : at.blur]
    amplitude = template.amplitude
    modes = root[bright:blur].T
    sizes = fit.posterior.expected.sizes
    gain, offset = (sizes[name] * unit * fit.shown(name) for name, unit in _lamp(fit).items())
    return Imaging(
        positions=positions,
        amplitude=amplitude * (1 + light @ brightness),
        offset=template.offset + light @ darkness,
        usable=fit.sound & seen,
        influence_modes=influence.reshape(*influence.shape[:2], -1, 2),
        amplitude_modes=amplitude * (modes @ brightness),
        offset_modes=modes @ darkness,
        light_variance=0.0
        if fit.pattern is None
        else fit.pattern.variance_of(fit.sound & seen, len(template.bias)),
        drift=(gain, offset),
        residual=shared[at.own("residual")] @ fields,
        phase_modes=root[residual:bright].T @ fields,
        lens_modes=root[blur : blur + 2].T * _lens(fit)[1],
        crosstalk_modes=_crosstalk_modes(fit, root[blur + 2 :]),
    )
