"""Standard deviations and intervals hold what they say; outliers are found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import robostiff as rs
from tests.identification.campaigns import (
    arm_campaign,
    arm_frames,
    hexapod_campaign,
    hexapod_frames,
    machine,
    with_values,
)

CAMPAIGNS = 80


@pytest.fixture(scope="module")
def hexapod():
    robot = machine("hexapod")
    return rs.identify(robot, hexapod_campaign(), ["leg*/strut"], frames=hexapod_frames())


@pytest.fixture(scope="module")
def arm():
    robot = machine("arm")
    return rs.identify(robot, arm_campaign(), ["arm/joint*"], frames=arm_frames())


@pytest.fixture(scope="module")
def few(hexapod):
    """Few numbers, so that the normal distribution would be too narrow where sigma is estimated."""
    return hexapod.measured.chosen(range(5))


@pytest.mark.parametrize("is_known", [True, False], ids=["sigma", "estimated sigma"])
def test_intervals_are_quantiles_of_their_distribution(hexapod, few, is_known):
    """Normal, or Student's of 15 numbers less 6 unknowns and of the sigma that is left."""
    sigma = np.full((5, 3), 1.5e-6 if is_known else np.nan)
    exact, _ = hexapod.predict(replace(few, sigma=sigma))
    noise = 1.5e-6 * np.random.default_rng(5).standard_normal(exact.shape)
    found = hexapod.fitted_to(replace(few, sigma=sigma, values=exact + noise))
    std = np.array([*found.std.values()])
    _, J = found.model.predicted(found.fit.x)
    left = 1.5e-6 if is_known else np.sqrt(np.sum(found.residuals**2) / 9)
    np.testing.assert_allclose(std, left * np.diag(np.linalg.inv(J.T @ J)) ** 0.5, rtol=1e-6)
    for part in (0.95, 0.6):
        quantile = stats.norm.ppf(0.5 + part / 2) if is_known else stats.t.ppf(0.5 + part / 2, 9)
        ends = np.array([*found.interval(part).values()])
        wanted = found.fit.x[:, None] + np.outer(std, [-quantile, quantile])
        np.testing.assert_allclose(ends, wanted, rtol=1e-9, atol=1e-9 * std.min())


@pytest.mark.slow
@pytest.mark.parametrize("is_known", [True, False], ids=["sigma", "estimated sigma"])
def test_intervals_cover_the_truth(hexapod, few, is_known):
    """Of six compliances in 80 campaigns 95 % lie in their intervals, within three errors."""
    sigma = 1.5e-6
    measured = replace(few, sigma=np.full((5, 3), sigma if is_known else np.nan))
    truth, random = hexapod.fit.x, np.random.default_rng(5)
    exact, _ = hexapod.predict(measured)
    inside = 0
    for _ in range(CAMPAIGNS):
        read = with_values(measured, exact + sigma * random.standard_normal(exact.shape))
        intervals = hexapod.fitted_to(read).interval(0.95)
        inside += sum(
            low <= x <= high for x, (low, high) in zip(truth, intervals.values(), strict=True)
        )
    share = inside / (6 * CAMPAIGNS)
    # the six of one campaign are not independent: the error of their mean is that of 80 to 480
    assert abs(share - 0.95) < 3 * (0.95 * 0.05 / CAMPAIGNS) ** 0.5 / 2


def _with_outlier(arm, number, loss):
    values = arm.measured.values.copy()
    values[number // 3, number % 3] += 1e-3
    return arm.fitted_to(with_values(arm.measured, values), loss)


def test_an_outlier_is_found_by_leaving_it_out(arm):
    """One coordinate 1 mm off among 108 of 20 um, where it does most."""
    assert arm.outliers == ()
    std = np.array([*arm.std.values()])
    _, J = arm.model.predicted(arm.fit.x)
    influence = np.abs(arm.covariance @ (J / 2e-5**2).T * 1e-3) / std[:, None]
    unknown, number = np.unravel_index(np.argmax(influence), influence.shape)
    squares = _with_outlier(arm, number, rs.Squares())
    off = np.abs(squares.fit.x - arm.fit.x) / std
    assert off[unknown] == pytest.approx(influence[unknown, number], rel=0.02)
    assert off[unknown] > 8
    assert squares.outliers[0] == number // 3
    assert rs.FitStatus.OUTLIERS in squares.status
    assert f"reading {number // 3 + 1}" in " ".join(squares.advice)
    robust = _with_outlier(arm, number, rs.Robust())
    assert (np.abs(robust.fit.x - arm.fit.x) / std).max() < 0.4 * off[unknown]
    assert robust.outliers[0] == number // 3


def test_leaving_one_out_is_what_it_says(arm):
    """The sum of squares without a reading is that of a fit without it, to second order."""
    k = 7
    rest = arm.measured.chosen([i for i in range(36) if i != k])
    without = arm.fitted_to(rest)
    less = arm._left_out[1][k]
    assert arm.chi_square - less == pytest.approx(without.chi_square, rel=1e-4)
    assert arm.leverage.sum() == pytest.approx(6)


def test_postures_that_were_not_seen(arm):
    crossed = arm.cross_validated(4)
    assert crossed.errors.shape == (36, 3)
    assert arm.residuals.std() < crossed.rms < 4 * arm.residuals.std()
    assert crossed.rms_of_fit == pytest.approx(np.sqrt(np.mean(arm.residuals**2)))
    predicted, sd = arm.predict(arm.measured)
    np.testing.assert_allclose(arm.measured.values - predicted, arm.residuals, atol=1e-12)
    assert np.all((sd > 0) & (sd < 2e-5))
