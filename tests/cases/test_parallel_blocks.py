"""Two cases with loops inside legs, as model files with parallel blocks, against 60 digits."""

from __future__ import annotations

import json

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis import stiffness
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.network import network_of_snapshot
from tests.cases.metric import distance
from tests.network.frames import GRAPHS

PARALLELOGRAM = """\
robostiff: 1
name: parallelogram
source: a reference case
home: {at: [600 mm, 0, 0]}
coordinates: [z]
legs:
  - name: leg
    chain:
      - type: parallelogram
        across: [0, 0, -100 mm]
        chain:
          - {type: revolute, axis: -y, role: passive}
          - type: beam
            to: [600 mm, 0, 0]
            material: {E: 210 GPa, poisson_ratio: 0.3}
            section: {tube: {outer_diameter: 16 mm, inner_diameter: 12 mm}}
          - {type: revolute, axis: -y, role: passive}
"""


def oracle(name: str) -> dict:
    return json.loads((GRAPHS / f"{name}.json").read_text())["oracle"]


def test_parallelogram():
    expected = oracle("h_parallelogram_square")
    robot = model_from_document(parse_document(PARALLELOGRAM))
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


@pytest.mark.parametrize("method", [rs.SaddlePoint(), rs.Block(), rs.Recursive()])
def test_forms_of_stiffness_hold_for_the_orthoglide_or_say_why_not(method):
    expected = oracle("h_orthoglide_pose0")
    result = rs.stiffness(rs.load("orthoglide"), method=method)
    if rs.Status.FORM_DOES_NOT_HOLD in result.status:
        assert result.advice
        return
    assert distance(result.K, np.array(expected["K"])) < expected["suggested_rtol"]


def test_orthoglide_as_a_network_of_the_posture_found():
    expected = oracle("h_orthoglide_pose0")
    snapshot = rs.find_posture(rs.load("orthoglide")).snapshot.one(0)
    result = stiffness(network_of_snapshot(snapshot))
    assert distance(result.K, np.array(expected["K"])) < expected["suggested_rtol"]
