"""Which coordinates of the platform pose an arm that has a home of its platform."""

from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.model import ALL_COORDINATES
from tests.files import FILES

SCARA = """\
robostiff: 1
name: scara
source: a test
home: {{at: [0.3, 0.3, 0]}}
{chosen}
legs:
  - name: arm
    chain:
      - {{type: revolute, axis: z, role: actuated, stiffness: 1e5 N m/rad}}
      - {{type: beam, to: [0.3, 0, 0], material: steel, section: {{circle: {{diameter: 20 mm}}}}}}
      - {{type: revolute, axis: z, role: actuated, stiffness: 1e5 N m/rad}}
      - {{type: beam, to: [0, 0.3, 0], material: steel, section: {{circle: {{diameter: 20 mm}}}}}}
      - {{type: prismatic, axis: z, role: actuated, stiffness: 1e7 N/m}}
"""


def read(text: str) -> Any:
    return model_from_document(parse_document(text, file="arm.yaml"))


def scara(chosen: str = "") -> Any:
    return read(SCARA.format(chosen=chosen))


@pytest.mark.parametrize("chosen", ["", "coordinates: [x, y, z]"])
def test_they_are_as_many_as_its_freedoms(chosen):
    robot = scara(chosen)
    names = [coordinate.value for coordinate in robot.coordinates]
    assert names == (["x", "y", "z"] if chosen else ["y", "z", "rz"])
    values = np.array([[0.3, 0.29, 0.01, 0, 0, 0.1]])[:, robot.coordinate_places]
    K = rs.stiffness(robot, values).K
    by_kernel = rs.compile(robot).evaluate(values).values["K"]
    np.testing.assert_allclose(by_kernel, K, rtol=1e-9, atol=1e-9 * np.max(K))


def test_all_of_them_pose_an_arm_whose_home_is_singular():
    assert rs.load(FILES / "wrist.yaml").coordinates == ALL_COORDINATES
