"""The part of a model's HDF5 file that a calibration adds: groups imaging and calibration."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from fringeforce.base.storage import read, read_by_tactel
from fringeforce.models.bench_record import BenchRecord
from fringeforce.models.imaging import Calibration, Imaging

if TYPE_CHECKING:
    import h5py

ARRAYS = {
    "positions": "m",
    "amplitude": "grey levels",
    "offset": "grey levels",
    "usable": "",
    "influence_modes": "rad/N",
    "amplitude_modes": "grey levels",
    "offset_modes": "grey levels",
}
FIELDS = {"residual": "rad", "phase_modes": "rad", "lens_modes": "m, 1", "crosstalk_modes": "1"}
"""Arrays that an imaging may lack."""
NUMBERS = ("drawing", "values", "covariance")
RECORD = {
    "frames": "",
    "written": "m, N, m",
    "found": "m, N, m",
    "std": "m, N, m",
    "residuals": "",
    "misfits": "",
    "aside": ", , N, N",
}
"""Arrays of the record of a bench with their units."""
WORDS = ("names", "unidentified", "outliers", "dead", "findings", "checked", "scatter")


def write_imaging(file: h5py.File, imaging: Imaging) -> None:
    """Write registration and lighting with their modes."""
    group = file.create_group("imaging")
    for name, unit in (ARRAYS | FIELDS).items():
        data = getattr(imaging, name)
        if data is None:
            continue
        dataset = group.create_dataset(name, data=data, compression="gzip" if data.size else None)
        dataset.attrs["units"] = unit
    group.attrs["light_variance"] = imaging.light_variance
    group.attrs["drift"] = imaging.drift


def read_imaging(file: h5py.File) -> Imaging | None:
    """Registration and lighting, if the file has them.

    Raises
    ------
    ValueError
        If the arrays do not fit each other.
    """
    if "imaging" not in file:
        return None
    attributes = file["imaging"].attrs
    gain, offset = np.asarray(attributes["drift"]).tolist()
    read_as = {"influence_modes": read_by_tactel}
    imaging = Imaging(
        **{name: read_as.get(name, read)(file, f"imaging/{name}") for name in ARRAYS},
        light_variance=np.asarray(attributes["light_variance"], dtype=float),
        drift=(gain, offset),
        **{n: read(file, f"imaging/{n}") for n in FIELDS if f"imaging/{n}" in file},
    )
    pixels, every = len(imaging.positions), len(imaging.amplitude)
    lengths = (
        imaging.influence_modes.shape[1],
        *(len(field.T) for field in (imaging.residual, imaging.phase_modes) if field is not None),
    )
    light = (
        len(imaging.offset),
        len(imaging.usable),
        imaging.amplitude_modes.shape[1],
        imaging.offset_modes.shape[1],
    )
    if any(length != pixels for length in lengths) or any(length != every for length in light):
        raise ValueError(f"imaging of {pixels} pixels holds arrays of {lengths}, {every}, {light}")
    lens, count = imaging.lens_modes, len(imaging.amplitude_modes)
    shares = imaging.crosstalk_modes
    if shares is not None and len(shares) != count:
        raise ValueError(f"imaging of {count} modes holds {len(shares)} modes of cross-talk")
    if lens is not None and lens.shape != (count, 2):
        raise ValueError(f"imaging of {count} modes holds lens modes of the shape {lens.shape}")
    return imaging


def write_calibration(file: h5py.File, found: Calibration) -> None:
    """Write what a calibration found."""
    group = file.create_group("calibration")
    for name in NUMBERS:
        group.create_dataset(name, data=getattr(found, name))
    if found.modes is not None:
        group.create_dataset("modes", data=found.modes)
    for name in WORDS:
        group.attrs[name] = json.dumps(getattr(found, name))
    group.attrs["chi2"], group.attrs["delay"] = found.chi2, found.delay
    group.attrs["usable"] = found.usable
    for name, unit in RECORD.items() if found.record is not None else ():
        data = getattr(found.record, name)
        dataset = group.create_dataset(
            f"record/{name}", data=data, compression="gzip" if data.size else None
        )
        dataset.attrs["units"] = unit


def read_calibration(file: h5py.File) -> Calibration | None:
    """What a calibration found, if the file tells."""
    if "calibration" not in file:
        return None
    attributes = file["calibration"].attrs
    found: dict[str, Any] = {name: np.asarray(file[f"calibration/{name}"]) for name in NUMBERS}
    found |= {
        name: tuple(json.loads(str(attributes[name]))) for name in WORDS if name in attributes
    }
    if "calibration/modes" in file:
        found["modes"] = np.asarray(file["calibration/modes"])
    return Calibration(
        chi2=float(np.asarray(attributes["chi2"])),
        usable=bool(attributes.get("usable", True)),
        delay=float(np.asarray(attributes.get("delay", 0.0))),
        record=_read_record(file),
        **found,
    )


def _read_record(file: h5py.File) -> BenchRecord | None:
    """Contacts and residuals behind a calibration, if the file has them."""
    if "calibration/record" not in file:
        return None
    return BenchRecord(**{name: read(file, f"calibration/record/{name}") for name in RECORD})
