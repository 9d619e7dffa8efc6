"""Channels that see light of each other: frames of the exact series under three lights."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.stats import binom, chi2

import fringeforce as ff
from fringeforce.base.errors import DesignError
from reading.exact_frames import Bench, drawing, loads

Array = NDArray[np.float64]
COLOURS = [{"wavelength": "635 nm"}, {"wavelength": "525 nm"}, {"wavelength": "470 nm"}]
CROSSTALK = "polariscope.crosstalk"
FRAMES, REFUSED = 120, 20
PLATES = {
    "retardance_error": 5.0,
    "extinction_ratio": 0.01,
    "dispersion": "quarter wave at wavelength",
}


@pytest.fixture(scope="module")
def plain() -> ff.Sensor:
    return drawing(**{"polariscope.channels": COLOURS})


def reader_of(plain: ff.Sensor, crosstalk: object) -> ff.Reader:
    return ff.Reader(ff.characterize(plain.replace(**{CROSSTALK: crosstalk})))


def shares(others: Array) -> Array:
    mixed = others * (1 - np.eye(3))
    return mixed + np.diag(1 - mixed.sum(axis=1))


def exact(plain: ff.Sensor, seed: int, frames: int, mixed: Array | None = None) -> tuple:
    """Forces, and frames of them on strips of their own: 5 +- 2 % if not given."""
    rng = np.random.default_rng([31, seed])
    places = plain.tactels.positions
    forces, bench = loads(rng, frames), Bench(plain, places, np.zeros(11))
    influence = bench.influence()
    bench.influence = lambda: influence  # type: ignore[method-assign]  # the same of all strips
    seen = []
    for load in forces:
        bench.shares = mixed
        if mixed is None:
            bench.shares = shares(np.abs(rng.normal(0.05, 0.02, (3, 3))))
        seen.append(bench.frames(load[None], rng)[0])
    return forces, np.array(seen)


def distances(readings: list[ff.Reading], forces: Array) -> Array:
    """Squared Mahalanobis distances, each a chi-square number of 22."""
    off = [(one.forces - load).ravel() for one, load in zip(readings, forces, strict=True)]
    return np.array(
        [e @ np.linalg.solve(r.covariance, e) for e, r in zip(off, readings, strict=True)]
    )


def test_channels_show_shares_of_the_light_of_each(plain: ff.Sensor) -> None:
    rows = [[0.0, 0.08, 0.01], [0.04, 0.0, 0.06], [0.0, 0.02, 0.0]]
    mixed = ff.characterize(plain.replace(**{CROSSTALK: rows}))
    own, force = ff.characterize(plain).intensity(ff.polar(1.0, 10, 11)), ff.polar(1.0, 10, 11)
    assert_allclose(mixed.intensity(force), shares(np.array(rows)) @ own, atol=1e-12)
    built = ff.characterize(plain.replace(**{CROSSTALK: "5 +/- 2 %"})).as_built(0)
    drawn = built.model.sensor.polariscope.channel_shares
    assert_allclose(drawn.sum(axis=1), 1)
    apart = drawn[~np.eye(3, dtype=bool)] - 0.05
    assert len(np.unique(apart)) == 6
    assert chi2.cdf(np.square(apart / 0.02).sum(), 6) == pytest.approx(0.5, abs=0.499)


@pytest.mark.slow
def test_a_reader_that_knows_the_shares_reads_to_what_noise_leaves(plain: ff.Sensor) -> None:
    reader = reader_of(plain, "5 %")
    forces, frames = exact(plain, 0, FRAMES, shares(np.full((3, 3), 0.05)))
    readings = [reader.search(frame) for frame in frames]
    assert all(one.ok for one in readings)
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 22 * FRAMES)
    # the finite elements are within 1e-4 of the series
    assert low < distances(readings, forces).sum() < 1.02 * high
    # a crossed light takes little: unmixing noise makes it 1.1 times as large
    clean = reader_of(plain, [])
    same, sharp = exact(plain, 0, FRAMES, np.eye(3))
    assert_allclose(forces, same)
    deviation = np.mean([clean.search(frame).std for frame in sharp[:20]])
    assert deviation < np.mean([one.std for one in readings[:20]]) < 1.3 * deviation


@pytest.mark.slow
def test_intervals_of_readings_with_a_tolerance_hold(plain: ff.Sensor) -> None:
    reader = reader_of(plain, "5 +/- 2 %")
    forces, frames = exact(plain, 1, FRAMES)
    readings = [reader.search(frame) for frame in frames]
    # one in 50 shows waves that noise leaves so rarely, and is ambiguous
    good = [k for k, one in enumerate(readings) if one.ok]
    assert FRAMES - len(good) <= binom.ppf(1 - 1e-3, FRAMES, 0.02)
    forces, readings = forces[good], [readings[k] for k in good]
    inside = [
        np.abs(one.forces - load) < 1.96 * one.std
        for one, load in zip(readings, forces, strict=True)
    ]
    # forces of a frame share its cross-talk: about half of its 22 errors are independent
    count = 11 * len(good)
    low, high = binom.ppf([1e-3, 1 - 1e-3], count, 0.95) / count
    assert low < np.mean(inside) < high
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 22 * len(good))
    assert low < distances(readings, forces).sum() < 1.02 * high


@pytest.mark.slow
def test_a_reader_that_knows_of_none_refuses_and_names_it(plain: ff.Sensor) -> None:
    reader = reader_of(plain, [])
    _, frames = exact(plain, 2, REFUSED, shares(np.full((3, 3), 0.05)))
    readings = [reader.search(frame) for frame in frames]
    assert all(one.status is ff.Status.MODEL_MISMATCH for one in readings)
    named = sum("cross-talk" in one.findings[0] for one in readings)
    assert named >= binom.ppf(1e-3, REFUSED, 0.9)
    assert "% root mean square of the light of each other one" in readings[1].findings[0]
    assert readings[1].findings[0].endswith("a tolerance or calibrate.")


@pytest.mark.slow
def test_a_frame_that_loads_explain_shows_cross_talk_all_the_same(plain: ff.Sensor) -> None:
    reader = reader_of(plain, [])
    _, frames = exact(plain, 3, REFUSED, shares(np.full((3, 3), 0.005)))
    refused = [one for one in map(reader.search, frames) if not one.ok]
    assert len(refused) > REFUSED / 2
    assert all("cross-talk" in one.findings[0] for one in refused)


@pytest.mark.parametrize("stated", ["5 %", "5 +/- 2 %"])
def test_followed_frames_read_as_searched_ones(plain: ff.Sensor, stated: str) -> None:
    sensor = plain.replace(**{"camera.pixels": 1024, CROSSTALK: stated})
    reader, rng = ff.Reader(ff.characterize(sensor)), np.random.default_rng(7)
    mean = loads(rng, 1)[0] + 0.2
    forces = mean * (1 + 0.2 * np.sin(np.linspace(0, 0.6, 40)))[:, None, None]
    frames = reader.model.as_built(rng).expose(forces, rng)
    batch = reader.read_on(frames, covariance=True)
    assert batch.tracked[1:].all()
    assert batch.covariance is not None
    for k in (10, 39):
        alone = ff.Reader(reader.model).search(frames[k])
        apart = (batch.forces[k] - alone.forces).ravel()
        # the first frame tells other shares than this one, of which there are six
        limit = 2 * chi2.ppf(1 - 1e-3, 6) if "+/-" in stated else 0.01
        assert apart @ np.linalg.solve(alone.covariance, apart) < limit
        assert_allclose(batch.std[k], alone.std, rtol=0.1)


def test_plates_that_are_no_quarter_wave_for_all_colours_are_allowed_for(plain: ff.Sensor) -> None:
    sensor = plain.replace(**{"polariscope.plates": PLATES, CROSSTALK: "5 +/- 2 %"})
    model, rng = ff.characterize(sensor), np.random.default_rng(8)
    reader, readings, forces = ff.Reader(model), [], loads(rng, 30)
    for load in forces:
        readings.append(reader.search(model.as_built(rng).expose(load, rng)))
    good = [k for k, one in enumerate(readings) if one.ok]
    assert 30 - len(good) <= binom.ppf(1 - 1e-3, 30, 0.02)
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 22 * len(good))
    assert low < distances([readings[k] for k in good], forces[good]).sum() < high


@pytest.mark.slow
def test_skins_read_with_cross_talk_and_name_it_where_none_is_stated(plain: ff.Sensor) -> None:
    skin = plain.replace(**{"skin": {"extent": "11 mm"}, CROSSTALK: "5 +/- 2 %"})
    model, press = ff.characterize(skin), ff.Press(x=1.1e-3, normal=1.5, tangential=0.3, width=1e-3)
    frame = model.expose([press], rng=1)
    reading = ff.Reader(model).search(frame)
    assert reading.status is ff.Status.OK
    (contact,) = reading.contacts
    assert (np.abs(contact.force - [1.5, 0.3]) < 4 * contact.force_std).all()
    refused = ff.Reader(ff.characterize(skin.replace(**{CROSSTALK: []}))).search(frame)
    assert refused.status is ff.Status.MODEL_MISMATCH
    assert "cross-talk" in refused.findings[0]


def test_a_share_for_all_pairs_stands_for_a_row_for_each_channel(
    plain: ff.Sensor, tmp_path
) -> None:
    short = plain.replace(**{CROSSTALK: "5 +/- 2 %"})
    some = [["5 +/- 2 %" if c != d else 0 for d in range(3)] for c in range(3)]
    assert plain.replace(**{CROSSTALK: some}) == short
    assert plain.replace(**{CROSSTALK: "0.05 +/- 0.02"}) == short
    assert plain.replace(**{CROSSTALK: "5 % ± 2 %"}) == short
    assert short.tolerances[f"{CROSSTALK}.0.2"] == 0.02
    (tmp_path / "short.toml").write_text(
        plain.to_toml().replace("[camera]", 'crosstalk = "5 +/- 2 %"\n\n[camera]')
    )
    (tmp_path / "long.toml").write_text(short.to_toml())
    assert (
        ff.load_sensor(tmp_path / "short.toml") == ff.load_sensor(tmp_path / "long.toml") == short
    )
    model = ff.characterize(short)
    model.save(tmp_path / "m.h5")
    assert ff.load_model(tmp_path / "m.h5").sensor == short
    loose = ff.characterize(plain).with_tolerances(**{CROSSTALK: "5 +/- 2 %"})
    assert loose.sensor == short


@pytest.mark.parametrize(
    ("stated", "problem"),
    [
        ("-5 %", "from 0 to less than 0.25 for 3 channels"),
        ("40 %", "from 0 to less than 0.25 for 3 channels"),
        ("much", "from 0 to less than 0.25 for 3 channels"),
        ("5 +/- -2 %", "finite and not negative"),
        ([[0, 0.6, 0.5], [0, 0, 0], [0, 0, 0]], "110% of channel 1 light of others"),
        ([[0, 0.05], [0.05, 0]], "2 rows of 2 shares for 3 channels"),
        ([[0.9, 0.05, 0.05]] * 3, "0.9 of channel 1 in itself; write 0"),
        ([0.05, 0.05, 0.05], "3 rows of 1 shares for 3 channels"),
    ],
)
def test_cross_talk_that_cannot_be_is_refused_once(
    plain: ff.Sensor, stated: object, problem: str
) -> None:
    with pytest.raises(DesignError, match="has a problem") as refused:
        plain.replace(**{CROSSTALK: stated})
    assert problem in str(refused.value)


def test_cross_talk_of_one_channel_or_of_a_pad_is_refused(sensor: ff.Sensor) -> None:
    with pytest.raises(DesignError, match=r"list them in polariscope\.channels"):
        sensor.replace(**{CROSSTALK: "5 %"})
    with pytest.raises(DesignError, match=r"list them in polariscope\.channels"):
        sensor.replace(**{"polariscope.channels": [{}], CROSSTALK: "5 %"})
    with pytest.raises(DesignError, match="strips with several channels: leave it out"):
        ff.load_sensor("pad").replace(**{CROSSTALK: "5 %"})
