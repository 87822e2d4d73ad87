"""Shipped robots against stiffness matrices from 60-digit arithmetic, and against the paper."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from robostiff.analysis import stiffness
from robostiff.elasticity import rectangle, tube
from robostiff.kinematics import JointCoordinates
from robostiff.robots import load
from tests.cases.metric import distance

DATA = Path(__file__).parents[1] / "cases" / "data"


def reference(name):
    return json.loads((DATA / f"{name}.json").read_text())


def pose_of(data):
    """The pose that a case states, None for the robot's home."""
    params = data["params"]
    if "pose" in params:
        at, angles = params["pose"]["p"], params["pose"]["rotvec_deg"]
        return RigidTransform.from_components(at, Rotation.from_rotvec(angles, degrees=True))
    if "p" in params:
        return params["p"]
    if "q_rad" in params:
        return JointCoordinates(params["q_rad"])
    return [params["x"], params["y"], params["theta"]]


AT_HOME = [
    ("gough-stewart-a-beams", "b_stewartA_home"),
    ("gough-stewart-b-beams", "b_stewartB_home"),
    ("3-rpr", "f_3RPR_planar_pose0"),
    ("3-rpr-beams", "f_3RPR_flex6_pose1"),
    ("3-puu", "e_3PUU_pose0"),
    ("two-link-arm", "d01_arm2_planar"),
]
AWAY = [("gough-stewart-b-beams", "b_stewartB_pose1"), ("3-puu", "e_3PUU_pose1")]


@pytest.mark.parametrize(("robot", "case"), AT_HOME + AWAY)
def test_matrix_of_reference_case(robot, case):
    data = reference(case)
    result = stiffness(load(robot), pose_of(data))
    K = np.array(data["oracle"]["K"], dtype=float)
    assert distance(result.K, K) < data["oracle"]["suggested_rtol"]
    assert int(result.rank) == data["oracle"]["rank"]


@pytest.mark.parametrize(("robot", "case"), AT_HOME)
def test_home_is_the_pose_of_the_case(robot, case):
    K = np.array(reference(case)["oracle"]["K"], dtype=float)
    assert distance(stiffness(load(robot)).K, K) < 1e-10


R, r, h, k = 0.5, 0.3, 0.8, 1e8


def matrix_of_paper(d, diagonal, rotation, L_squared):
    """(27) and (28), which differ in a few places only."""
    K = np.zeros((6, 6))
    K[0, 0] = K[1, 1] = diagonal
    K[2, 2] = 2 * h**2
    K[3, 3] = K[4, 4] = r**2 * h**2
    K[0, 4] = K[4, 0] = r * h * d
    K[1, 3] = K[3, 1] = -r * h * d
    K[5, 5] = rotation
    return 3 * k / L_squared * K


def test_case_a_is_equation_27():
    d_a = R - r
    K = matrix_of_paper(d_a, d_a**2, 0.0, (R - r) ** 2 + h**2)
    result = stiffness(load("gough-stewart-a"))
    assert distance(result.K, K) < 1e-13
    assert int(result.rank) == 3


def test_case_b_is_equation_28():
    d_a, d_b = R - r, R / 2 - r
    K = matrix_of_paper(d_b, d_a**2 + R * r, 1.5 * r**2 * R**2, R**2 - R * r + r**2 + h**2)
    result = stiffness(load("gough-stewart-b"))
    assert distance(result.K, K) < 1e-13
    assert int(result.rank) == 6


@pytest.mark.parametrize(("case", "L_squared"), [("a", 0.2**2 + h**2), ("b", 0.19 + h**2)])
def test_rigid_legs_are_beam_legs_of_the_same_stiffness(case, L_squared):
    section = tube(0.040, 0.030)
    along = 210e9 * section.A / np.sqrt(L_squared)
    rigid = stiffness(load(f"gough-stewart-{case}", {"k": along}))
    beams = stiffness(load(f"gough-stewart-{case}-beams"))
    assert distance(rigid.K, beams.K) < 1e-11


def test_planar_link_is_equation_4():
    section, L, E = rectangle(0.020, 0.040), 0.5, 210e9
    K = np.array(
        [
            [E * section.A / L, 0, 0],
            [0, 12 * E * section.Iz / L**3, -6 * E * section.Iz / L**2],
            [0, -6 * E * section.Iz / L**2, 4 * E * section.Iz / L],
        ]
    )
    freed = K[:2, :2] - np.outer(K[:2, 2], K[2, :2]) / K[2, 2]
    result = stiffness(load("planar-link"))
    np.testing.assert_allclose(result.K[:2, :2], freed, rtol=1e-12)
    assert not result.K[2].any()
    assert int(result.rank) == 2
