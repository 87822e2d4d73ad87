"""Identification against references in other arithmetic, and the intervals of what it finds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

import robostiff as rs
from tests.identification.campaigns import (
    arm_campaign,
    arm_frames,
    case,
    column,
    hexapod_campaign,
    hexapod_frames,
    machine,
    model_file,
    with_values,
)


@pytest.mark.parametrize("by_name", ["parameters", "springs"])
def test_compliances_of_an_arm_under_weights_and_hooked_loads(tmp_path, by_name):
    names, own = case("arm")["names"], [f"arm/joint{k}" for k in range(1, 7)]
    file = model_file("arm", tmp_path)
    robot = rs.load(file, symbols=names) if by_name == "parameters" else rs.load(file)
    own = names if by_name == "parameters" else own
    pattern = names if by_name == "parameters" else ["arm/joint*"]
    found = rs.identify(robot, arm_campaign(), pattern, frames=arm_frames())
    values, std = column("arm", "estimate"), column("arm", "std")
    assert found.names == tuple(own)
    np.testing.assert_allclose(
        [found.values[n] for n in own], values, atol=1e-6 * std.min(), rtol=0
    )
    np.testing.assert_allclose([found.std[n] for n in own], std, rtol=1e-8)
    for i, row in enumerate(case("arm")["correlation"]):
        np.testing.assert_allclose(found.correlations[i, : len(row)], row, atol=1e-8)
    assert found.chi_square == pytest.approx(126.1268872594892579, abs=1e-6)
    assert found.degrees_of_freedom == case("arm")["degrees_of_freedom"]
    assert found.status is rs.FitStatus.OK


def test_frames_and_markers_that_are_not_known():
    """With unknown frames estimates are as near to the truth as their errors say."""
    robot = machine("arm")
    found = rs.identify(robot, arm_campaign(), ["arm/joint*"])
    true = column("arm", "true")
    names = [f"arm/joint{k}" for k in range(1, 7)]
    off = (np.array([found.values[n] for n in names]) - true) / [found.std[n] for n in names]
    assert np.abs(off).max() < 3
    known = case("arm")["known"]
    for axis, value in zip("xyz", known["base"], strict=False):
        assert abs(found.values[f"instrument {axis}"] - value) < 4 * found.std[f"instrument {axis}"]
    for mark, place in zip("abc", known["marks"], strict=True):
        for axis, value in zip("xyz", place, strict=True):
            assert abs(found.values[f"{mark} {axis}"] - value) < 4 * found.std[f"{mark} {axis}"]
    assert found.status is rs.FitStatus.OK


def test_compliances_of_a_hexapod_from_displacements():
    robot = machine("hexapod")
    found = rs.identify(robot, hexapod_campaign(), ["leg*/strut"], frames=hexapod_frames())
    values, std = column("hexapod", "estimate"), column("hexapod", "std")
    assert found.names == tuple(f"leg{k}/strut" for k in range(1, 7))
    np.testing.assert_allclose([*found.values.values()], values, atol=1e-6 * std.min(), rtol=0)
    np.testing.assert_allclose([*found.std.values()], std, rtol=1e-9)
    expected = column("hexapod", "covariance")
    np.testing.assert_allclose(found.covariance, expected, atol=1e-9 * np.abs(expected).max())
    assert found.chi_square == pytest.approx(38.9501954642454404, abs=1e-7)
    k, low, high = found.stiffness_interval("leg1/strut")
    assert 1 / k == pytest.approx(values[0], rel=1e-9)
    assert 1 / high == pytest.approx(values[0] - 1.959963985 * std[0], rel=1e-9)
    assert 1 / low == pytest.approx(values[0] + 1.959963985 * std[0], rel=1e-9)


def test_stiffnesses_of_the_file_become_compliances(tmp_path):
    names = [f"k{k}" for k in range(1, 7)]
    robot = rs.load(model_file("hexapod", tmp_path), symbols=names)
    found = rs.identify(robot, hexapod_campaign(), ["k*"], frames=hexapod_frames())
    assert found.names == tuple(f"1/k{k}" for k in range(1, 7))
    std = column("hexapod", "std")
    values = [*found.values.values()]
    np.testing.assert_allclose(values, column("hexapod", "estimate"), atol=1e-6 * std.min(), rtol=0)


def test_finite_loads_of_the_hexapod_give_almost_the_same():
    """Points instead of displacements: the same compliances to a hundredth of an error."""
    robot = machine("hexapod")
    small = rs.identify(robot, hexapod_campaign(), ["leg*/strut"], frames=hexapod_frames())
    truth = small.robot
    loaded = rs.equilibrium(truth, column("hexapod", "poses"), column("hexapod", "wrenches"))
    poses = np.asarray(loaded.pose)
    marks = np.array(case("hexapod")["marks_platform"])
    R = Rotation.from_rotvec(poses[:, 3:]).as_matrix()
    points = poses[:, None, :3] + np.einsum("nij,kj->nki", R, marks)
    measured = rs.Measurements(
        hexapod_campaign().postures,
        points.reshape(-1, 3),
        wrenches=hexapod_campaign().wrenches,
        markers=hexapod_campaign().markers,
        sigma=column("hexapod", "sigma_xyz"),
    )
    found = rs.identify(robot, measured, ["leg*/strut"], frames=hexapod_frames())
    std = column("hexapod", "std")
    assert np.abs(np.subtract([*found.values.values()], [*small.values.values()])).max() < 1e-8 * (
        std.min()
    )
    assert found.chi_square < 1e-8


def test_displacements_are_those_of_the_compliance_matrix():
    """``J c = y`` at nominal compliances, and y the deflection; J by differences."""
    robot = machine("hexapod")
    found = rs.identify(robot, hexapod_campaign(), ["leg*/strut"], frames=hexapod_frames())
    c = found.fit.start
    y, J = found.model.prediction(c)
    np.testing.assert_allclose(J @ c, y, atol=1e-12 * np.abs(y).max())
    marks = np.array(case("hexapod")["marks_platform"])
    poses, wrenches = column("hexapod", "poses"), column("hexapod", "wrenches")
    for k, (pose, wrench) in enumerate(zip(poses, wrenches, strict=True)):
        t = np.asarray(rs.deflection(robot, pose, wrench=wrench).twist)
        R = Rotation.from_rotvec(pose[3:]).as_matrix()
        moved = t[:3] + np.cross(t[3:], marks @ R.T)
        np.testing.assert_allclose(y.reshape(-1, 3, 3)[k], moved, atol=1e-12 * np.abs(t).max())
    step = 1e-4 * c[2]
    shift = np.eye(6)[2] * step
    by_differences = (found.model.prediction(c + shift)[0] - y) / step
    np.testing.assert_allclose(J[:, 2], by_differences, atol=1e-8 * np.abs(J[:, 2]).max())


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
    _, J = found.model.prediction(found.fit.x)
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
    _, J = arm.model.prediction(arm.fit.x)
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
