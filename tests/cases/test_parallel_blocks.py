"""Two cases with loops inside legs, as model files with parallel blocks, against 60 digits."""

from __future__ import annotations

import json

import numpy as np

import robostiff as rs
from tests.cases.metric import distance
from tests.files import FILES
from tests.network.frames import GRAPHS


def oracle(name: str) -> dict:
    return json.loads((GRAPHS / f"{name}.json").read_text())["oracle"]


def test_parallelogram():
    expected = oracle("h_parallelogram_square")
    robot = rs.load(FILES / "parallelogram-of-tubes.yaml")
    result = rs.stiffness(robot)
    assert distance(result.K, np.array(expected["K"])) < expected["suggested_rtol"]
    assert int(result.rank) == expected["rank"]
    assert [str(motion) for motion in result.free_motions] == ["translation along z"]


def test_orthoglide_through_inverse_kinematics():
    """The shipped robot has the dimensions of the case."""
    expected = oracle("h_orthoglide_pose0")
    result = rs.stiffness(rs.load("orthoglide"), [0.0, 0.0, 0.0])
    assert distance(result.K, np.array(expected["K"])) < expected["suggested_rtol"]
    assert int(result.rank) == expected["rank"]
    C = np.array(expected["compliance"])
    assert distance(result.required_compliance(), C, 1.0) < expected["suggested_rtol"]
