"""Formulas at poses in Euler angles, roll-pitch-yaw and quaternions, against the numerical form."""

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.analytic.placement.robot_pose import rotation_by_name

ROTATIONS = ["ZXZ", "ZYX", "XYZ", "yzx", "rpy", "quaternion"]


def of_scipy(name, values):
    """The rotation as SciPy has it, which shares nothing with ours."""
    if name == "quaternion":
        w = np.sqrt(1 - np.sum(np.square(values)))
        return Rotation.from_quat([*values, w])
    return Rotation.from_euler("xyz" if name == "rpy" else name, values)


@pytest.mark.parametrize("name", ROTATIONS)
def test_formulas_are_right_at_random_rotations(name):
    rotation = rotation_by_name(name)
    robot = rs.load("gough-stewart-b", symbols=("k",))
    derivation = rs.derive(robot, pose=rs.AtSymbols(rotation))
    assert set(rotation.names) <= set(derivation.coordinates)
    K = derivation.lambdify()
    random = np.random.default_rng(5)
    reached = 0
    for _ in range(6):
        p = np.array([0.0, 0.0, 0.75]) + 0.05 * random.uniform(-1, 1, 3)
        turns = 0.4 * random.uniform(-1, 1, 3)
        pose = RigidTransform.from_components(p, of_scipy(name, turns))
        expected = rs.stiffness(robot.substituted({"k": 2e8}), pose)
        given = dict(zip(("x", "y", "z", *rotation.names), [*p, *turns], strict=True))
        found = K(**given, k=2e8)
        assert np.max(np.abs(found - expected.K)) < 1e-11 * np.max(np.abs(expected.K))
        reached += 1
    assert reached == 6


def test_given_angles_are_put_in():
    pose = rs.AtCoordinates({"phi": 0.1, "theta": sp.Symbol("t")}, rs.EulerAngles("ZXZ"))
    derivation = rs.derive("gough-stewart-b", symbols=("k",), pose=pose)
    assert [s.name for s in derivation.symbols] == ["k", "t"]
    assert derivation.where == "at phi = 1/10, theta = t, turned by Rz(1/10) Rx(t)"
    R = Rotation.from_euler("ZXZ", [0.1, 0.2, 0.0])
    robot = rs.load("gough-stewart-b", symbols=("k",))
    home = robot.numeric.home
    assert home is not None
    at = RigidTransform.from_components(home.p, R)
    expected = rs.stiffness(robot.substituted({"k": 1e8}), at).K
    found = derivation.lambdify("k", "t")(1e8, 0.2)
    assert np.max(np.abs(found - expected)) < 1e-11 * np.max(np.abs(expected))


def test_platforms_that_follow_their_legs_have_other_angles_as_well():
    derivation = rs.derive("3-rps", symbols=("k",), pose=rs.AtSymbols(rs.roll_pitch_yaw()))
    assert derivation.following == ("x", "y", "yaw")
