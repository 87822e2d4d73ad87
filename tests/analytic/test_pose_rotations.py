"""Formulas at poses in Euler angles, roll-pitch-yaw and quaternions, against the numerical form."""

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.analytic.export import derivation_text, python_function
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


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ZXZ", "phi, theta, psi: rotation of the platform, Rz(phi) Rx(theta) Rz(psi)"),
        ("rpy", "roll, pitch, yaw: rotation of the platform, Rz(yaw) Ry(pitch) Rx(roll)"),
        ("quaternion", "q_x, q_y, q_z: rotation of the platform, the unit quaternion (q_w, q_x,"),
    ],
)
def test_the_nomenclature_says_what_the_angles_are(name, words):
    pose = rs.AtSymbols(rotation_by_name(name))
    derivation = rs.derive("gough-stewart-b-beams", pose=pose, leg="leg1")
    text = derivation_text(derivation)
    assert f"\n{words}" in text
    assert "\nx, y, z: place of the platform's origin [m]\n" in text


def test_functions_say_what_coordinates_are():
    robot = rs.load("3-rrr", symbols=("k",))
    source = python_function(rs.derive(robot, pose=rs.AtSymbols()))
    assert "    gamma : array_like\n        rotation of the platform, Rz(gamma)\n" in source
    assert "    x : array_like\n        place of the platform's origin [m]\n" in source
    assert source.index("Parameters\n    -----") < source.index(
        "Raises\n    ------\n    ValueError"
    )
    joint = rs.AtCoordinates({"q1": sp.Symbol("theta")})
    words = rs.derive("two-link-arm", symbols=(), pose=joint).meanings
    assert words["theta"] == "joint coordinate, in the order of the arm [rad, or m of a slide]"


def test_platforms_that_follow_their_legs_have_other_angles_as_well():
    derivation = rs.derive("3-rps", symbols=("k",), pose=rs.AtSymbols(rs.roll_pitch_yaw()))
    assert derivation.following == ("x", "y", "yaw")


@pytest.mark.parametrize("sequence", ["ZXx", "ZZX", "ABC", "", "XY", 3])
def test_sequences_that_are_none_are_refused(sequence):
    with pytest.raises(rs.InputError, match="sequence of Euler angles"):
        rs.EulerAngles(sequence)


@pytest.mark.parametrize("rotation", [rs.EulerAngles("ZXZ"), rs.UnitQuaternion()])
def test_rotations_that_do_not_fit_the_robot_are_refused(rotation):
    with pytest.raises(rs.InputError, match="turns about x and y alone"):
        rs.derive("3-rps", pose=rs.AtSymbols(rotation))
    with pytest.raises(rs.InputError, match="joints q1"):
        rs.derive("two-link-arm", pose=rs.AtSymbols(rotation))
