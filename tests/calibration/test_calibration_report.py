"""The page of a calibration holds what the calibration found."""

import re
from dataclasses import replace

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.calibration.bench_loads import presses_as_loads
from fringeforce.plotting.calibration_report import calibration_report

pytestmark = pytest.mark.slow

STRAIN_OPTIC = "transducer.photoelastic.strain_optic_coefficient"
TITLES = [
    "What the model leaves of the frames",
    "Contacts as written and as found",
    "Frames that were put aside",
    "Fields found",
    "Values beside the drawing",
]
SHIFTED = 8


@pytest.fixture(scope="module")
def bench() -> tuple[ff.SensorModel, np.ndarray]:
    """A calibration with one press written down 3 mm beside its place, and the true places."""
    rng = np.random.default_rng(4)
    drawing = ff.load_sensor("saad").replace(**{"camera.pixels": 256, "camera.noise": 4.0})
    made = ff.characterize(drawing.replace(**{STRAIN_OPTIC: 0.054}))
    true = np.linspace(-4e-3, 4e-3, 20)
    presses = [
        [ff.Press(x=x, normal=n, width=0.4e-3)]
        for x, n in zip(true, rng.uniform(0.6, 2.5, 20), strict=True)
    ]
    loads = presses_as_loads(presses)
    places = loads.places + 0.08e-3 * rng.standard_normal((20, 1))
    places[SHIFTED] += 3e-3
    frames = made.expose(presses, rng)
    return ff.calibrate(drawing, frames, replace(loads, places=places), [STRAIN_OPTIC]), true


def test_contacts_are_found_nearer_to_the_truth_than_written(bench) -> None:
    model, true = bench
    record = model.calibration.record
    kept = np.isin(record.frames, [SHIFTED], invert=True)
    off = record.found[:, 0] - true[record.frames]
    written = record.written[:, 0] - true[record.frames]
    assert np.abs(off[kept]).mean() < 0.5 * np.abs(written[kept]).mean()
    assert (np.abs(off[kept]) < 5 * record.std[kept, 0]).all()


def test_a_wrong_place_is_put_right(bench) -> None:
    model, true = bench
    record = model.calibration.record
    (row,) = np.flatnonzero(record.frames == SHIFTED)
    assert abs(record.found[row, 0] - true[SHIFTED]) < 0.5e-3
    assert abs(record.written[row, 0] - true[SHIFTED]) > 2e-3


def test_residuals_of_explained_frames_are_noise(bench) -> None:
    record = bench[0].calibration.record
    kept = np.arange(len(record.misfits)) != SHIFTED
    assert np.nanstd(record.residuals[kept]) == pytest.approx(1, abs=0.1)
    assert record.misfits[SHIFTED] > 2 * record.misfits[kept].max()


def test_the_record_agrees_with_the_check(bench) -> None:
    found = bench[0].calibration
    off, std = found.record.aside[:, 2:].T
    assert (len(np.unique(found.record.aside[:, 0])), len(off)) == (found.checked[0], 8)
    assert (np.abs(off) < 1.96 * std).sum() == found.checked[2]


def test_the_page_of_a_saved_model_holds_every_figure_and_outlier(bench, tmp_path) -> None:
    bench[0].save(tmp_path / "m.h5")
    model = ff.load_model(tmp_path / "m.h5")
    np.testing.assert_array_equal(model.calibration.record.found, bench[0].calibration.record.found)
    calibration_report(model, tmp_path / "r.html")
    page = (tmp_path / "r.html").read_text()
    assert re.findall(r"<h2>(.*)</h2>\n<p>", page) == TITLES
    assert page.count("data:image/png;base64,") == len(TITLES)
    assert "This model can be used." in page
    assert model.calibration.outliers == (SHIFTED,)
    assert f"Frame {SHIFTED}, recorded as" in page
    assert not re.findall(r'(?:src|href)="(?!data:)', page)
    words = re.sub(r"base64,[^\"]*", "", page)
    assert not re.findall(r"\d\.\d{12,}", words)  # nobody reads so many digits


def test_a_model_without_a_record_or_of_no_use_has_a_page_too(bench, tmp_path) -> None:
    model = bench[0]
    bare = replace(model.calibration, record=None, usable=False)
    calibration_report(replace(model, calibration=bare), tmp_path / "r.html")
    page = (tmp_path / "r.html").read_text()
    assert page.count("data:image/png;base64,") == 2
    assert "Do not use this model." in page
