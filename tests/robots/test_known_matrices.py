"""Shipped robots against stiffness matrices from 60-digit arithmetic, and against the paper."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from tests.cases.metric import distance
from tests.paper.home_matrices import eq27, eq28

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
        return rs.JointCoordinates(params["q_rad"])
    return [params["x"], params["y"], params["theta"]]


CASES = [
    ("gough-stewart-a-beams", "b_stewartA_home"),
    ("gough-stewart-b-beams", "b_stewartB_home"),
    ("3-rpr", "f_3RPR_planar_pose0"),
    ("3-rpr-beams", "f_3RPR_flex6_pose1"),
    ("3-puu", "e_3PUU_pose0"),
    ("two-link-arm", "d01_arm2_planar"),
    ("gough-stewart-b-beams", "b_stewartB_pose1"),
    ("3-puu", "e_3PUU_pose1"),
]


@pytest.mark.parametrize(("robot", "case"), CASES)
def test_matrix_of_reference_case(robot, case):
    data = reference(case)
    result = rs.stiffness(rs.load(robot), pose_of(data))
    K = np.array(data["oracle"]["K"], dtype=float)
    assert distance(result.K, K) < data["oracle"]["suggested_rtol"]
    assert int(result.rank) == data["oracle"]["rank"]


R, r, h, k = 0.5, 0.3, 0.8, 1e8


@pytest.mark.parametrize(("case", "equation", "rank"), [("a", eq27, 3), ("b", eq28, 6)])
def test_hexapods_are_equations_27_and_28(case, equation, rank):
    result = rs.stiffness(rs.load(f"gough-stewart-{case}"))
    assert distance(result.K, equation(k, R, r, h)) < 1e-13
    assert int(result.rank) == rank


@pytest.mark.parametrize(("case", "L_squared"), [("a", 0.2**2 + h**2), ("b", 0.19 + h**2)])
def test_rigid_legs_are_beam_legs_of_the_same_stiffness(case, L_squared):
    section = rs.tube(0.040, 0.030)
    along = 210e9 * section.A / np.sqrt(L_squared)
    rigid = rs.stiffness(rs.load(f"gough-stewart-{case}", {"k": along}))
    beams = rs.stiffness(rs.load(f"gough-stewart-{case}-beams"))
    assert distance(rigid.K, beams.K) < 1e-11
