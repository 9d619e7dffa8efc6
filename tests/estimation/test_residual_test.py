"""What is left of a frame is judged as the chi-square distribution says."""

import numpy as np
import pytest
from scipy.stats import binomtest, chi2, kstest

from fringeforce.estimation.residual_test import (
    GROUP,
    absorbed,
    bumps_are_noise,
    group_sums,
    is_noise,
    reduced_chi_square,
)


def test_the_mean_square_of_residuals_of_a_fit_is_one_and_scatters_as_chi_square() -> None:
    rng = np.random.default_rng(0)
    design = rng.normal(size=(60, 7))
    project = np.eye(60) - design @ np.linalg.pinv(design)
    found = [reduced_chi_square(project @ rng.normal(size=60), 7) for _ in range(500)]
    assert kstest(53 * np.array(found), chi2(53).cdf).pvalue > 1e-3
    assert reduced_chi_square(np.array([3.0, 4.0]), 2) == 25


def test_sums_of_neighbours_keep_unit_noise_and_add_up_a_wave() -> None:
    noise = np.random.default_rng(1).normal(size=(GROUP * 4000 + 5, 2))
    sums = group_sums(noise)
    assert sums.shape == (4000, 2)
    np.testing.assert_allclose(np.cov(sums.T), np.eye(2), atol=4 * np.sqrt(2 / 4000))
    np.testing.assert_allclose(group_sums(np.ones((GROUP * 3, 1))), np.sqrt(GROUP))


@pytest.mark.parametrize("unknowns", [0, 22])
@pytest.mark.parametrize("chance", [1e-2, 1e-7])
def test_squares_may_be_as_large_as_noise_makes_them_by_the_stated_chance(
    unknowns: int, chance: float
) -> None:
    limit = chi2.isf(chance, 1024 - unknowns)
    alternating = np.resize([1.0, -1.0], 1024)  # sums over neighbours vanish
    below, above = (np.sqrt(limit * share / 1024) * alternating for share in (0.999, 1.001))
    assert is_noise(below, unknowns, chance)
    assert not is_noise(above, unknowns, chance)


@pytest.mark.parametrize("unknowns", [0, 22])
def test_a_long_wave_shows_in_the_sums_long_before_it_shows_in_pixels(unknowns: int) -> None:
    groups = 1024 // GROUP
    limit = chi2.isf(1e-7, groups - unknowns)
    for share, noise in ((0.999, True), (1.001, False)):
        wave = np.full(1024, np.sqrt(limit * share / groups / GROUP))
        assert wave @ wave < 1024
        assert is_noise(wave, unknowns) is noise


@pytest.mark.parametrize("fringes", [2.0, 40.0])
def test_a_fit_takes_from_the_sums_as_much_as_their_mean_square_falls_short(fringes: float) -> None:
    rng, pixels = np.random.default_rng(3), 512
    x = np.arange(pixels) / pixels
    influence = np.stack([np.exp(-0.5 * ((x - k / 12) / 0.05) ** 2) for k in range(13)], axis=1)
    slope = 3 * np.sin(2 * np.pi * fringes * x)
    covariance = np.linalg.inv((influence.T * slope**2) @ influence)
    turned = slope[:, None] * influence
    project = np.eye(pixels) - turned @ covariance @ turned.T
    sums = group_sums(project @ rng.normal(size=(pixels, 3000)))
    found = pixels // GROUP - (sums**2).sum(axis=0).mean()
    taken = absorbed(slope, influence, covariance)
    assert taken == pytest.approx(found, abs=4 * np.sqrt(2 * 32 / 3000))
    assert taken < 13 / (1 if fringes < 10 else 2)


@pytest.mark.parametrize("unknowns", [0, 22])
def test_noise_fails_as_often_as_the_stated_chance(unknowns: int) -> None:
    rng, chance, tries = np.random.default_rng(4), 0.02, 4000
    basis = np.linalg.qr(rng.normal(size=(1024, unknowns)))[0]
    noise = rng.normal(size=(tries, 1024))
    left = noise - noise @ basis @ basis.T
    alarms = sum(not is_noise(each, unknowns, chance, grouped=False) for each in left)
    assert binomtest(alarms, tries, chance).pvalue > 1e-3


def test_bumps_of_noise_are_told_as_often_as_stated() -> None:
    rng, chance = np.random.default_rng(4), 0.05
    told = [not bumps_are_noise(rng.normal(size=1024), 40, chance) for _ in range(2000)]
    # stretches that overlap are alike, so that alarms are rarer than for as many independent ones
    assert 0.001 < np.mean(told) < chance


def test_a_bump_is_found_that_the_squares_of_all_residuals_hide() -> None:
    rng = np.random.default_rng(5)
    residuals = rng.normal(size=2048)
    residuals[700:800] += 0.8
    assert is_noise(residuals, 0, 1e-5, grouped=False)
    assert not bumps_are_noise(residuals, 40, 1e-5)
