"""Exported functions of whole robots against the numerical form, at random poses and values."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic.export import python_function

TURNED = {"x": 0, "y": 1, "z": 2, "rx": 3, "ry": 4, "rz": 5}
ROBOTS = {
    "gough-stewart-a": ("R", "r", "h", "k"),
    "gough-stewart-b": ("R", "r", "h", "k"),
    "gough-stewart-a-beams": rs.ALL_PARAMETERS,
    "gough-stewart-b-beams": rs.ALL_PARAMETERS,
    "hexapod": ("R", "r", "k_screw", "k_joint"),
    "3-puu": rs.ALL_PARAMETERS,
    "3-rrr": rs.ALL_PARAMETERS,
    "tripteron": rs.ALL_PARAMETERS,
    "two-link-arm": rs.ALL_PARAMETERS,
    "six-joint-arm": rs.ALL_PARAMETERS,
}
POSE_NAMES = {"rx": "alpha", "ry": "beta", "rz": "gamma"}


def compiled(source):
    space = {}
    exec(source, space)  # noqa: S102
    return space["stiffness"]


def rotation_vector(alpha, beta, gamma):
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler("xyz", [alpha, beta, gamma]).as_rotvec()


@pytest.mark.parametrize("name", ROBOTS)
def test_the_exported_function_at_a_general_pose_agrees_with_the_numerical_form(name):
    robot = rs.load(name, symbols=ROBOTS[name])
    derivation = rs.derive(robot, pose=rs.AtSymbols(), form=rs.Steps())
    function = compiled(python_function(derivation))
    random = np.random.default_rng(3)
    nominal = dict(robot.nominal)
    coordinates = derivation.coordinates
    for _ in range(5):
        values = {k: v * random.uniform(0.98, 1.02) for k, v in nominal.items()}
        numeric = robot.substituted(values)
        if numeric.is_serial and numeric.home is None:
            home = numeric.legs[0].chain.home
            q = home + random.uniform(-0.2, 0.2, home.shape)
            given = {f"q{i + 1}": value for i, value in enumerate(q)}
            expected = rs.stiffness(numeric, rs.JointCoordinates(q))
        else:
            assert numeric.home is not None
            pose = np.zeros(6)
            pose[:3] = numeric.home.p
            angles = np.zeros(3)
            given = {}
            for coordinate in numeric.coordinates:
                place = TURNED[coordinate.value]
                if place < 3:
                    pose[place] += 0.02 * random.uniform(-1, 1)
                    given[coordinate.value] = pose[place]
                else:
                    angles[place - 3] = 0.1 * random.uniform(-1, 1)
                    given[POSE_NAMES[coordinate.value]] = angles[place - 3]
            pose[3:] = rotation_vector(*angles)
            expected = rs.stiffness(numeric, pose)
        assert not expected.status.is_bad
        known = dict(zip(coordinates, given.values(), strict=True)) | values
        wanted = {symbol.name: known[symbol.name] for symbol in derivation.symbols}
        K = function(**wanted)
        assert np.max(np.abs(K - expected.K)) < 1e-12 * np.max(np.abs(expected.K))
