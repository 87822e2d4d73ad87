"""Compliances of an arm with heavy links and of a hexapod against references of 40 digits."""

from __future__ import annotations

import numpy as np
import pytest
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
    y, J = found.model.predicted(c)
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
    by_differences = (found.model.predicted(c + shift)[0] - y) / step
    np.testing.assert_allclose(J[:, 2], by_differences, atol=1e-8 * np.abs(J[:, 2]).max())
