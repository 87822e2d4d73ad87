"""Two cases with loops inside legs, as model files with parallel blocks, against 60 digits."""

from __future__ import annotations

import json

import numpy as np

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
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
