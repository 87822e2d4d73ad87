"""Arms in model files: tables of Denavit and Hartenberg, and coordinates that pose an arm."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.model import ALL_COORDINATES
from tests.files import FILES, text_of

EXAMPLE = Path(__file__).parents[2] / "examples" / "ur5-dh.yaml"

ARM = text_of("table-of-dh.yaml")


def read(text: str, **more):
    return model_from_document(parse_document(text, "arm.yaml"), **more)


def test_example_is_the_one_of_the_page():
    page = EXAMPLE.parents[1] / "docs" / "model-files.md"
    assert f"```yaml\n{EXAMPLE.read_text(encoding='utf-8')}```" in page.read_text(encoding="utf-8")


def test_file_is_the_arm_that_python_makes():
    rows = [
        rs.DHRow(d=0.4),
        rs.DHRow(alpha=-np.pi / 2, theta=-np.pi / 2, name="shoulder"),
        rs.DHRow(a=0.5),
        rs.DHRow(alpha=np.pi / 2, d=0.1, slides=True),
    ]
    own = rs.serial_arm(
        rows,
        convention=rs.DHConvention.MODIFIED,
        joint_stiffness=[2e4, 2e4, 2e4, 1e7],
        limits=[(-np.radians(170), np.radians(170)), None, None, None],
        home=[0, np.radians(20), np.radians(45), 0.05],
        base=rs.Frame(np.eye(3), np.array([0, 0, 1])),
        tool=RigidTransform.from_components(
            [0, 0, 0.08], Rotation.from_rotvec([0, np.radians(30), 0])
        ),
    )
    found = read(ARM)
    (leg,), (other,) = found.legs, own.legs
    assert leg.chain.coordinate_names == ("joint1", "shoulder", "joint3", "joint4")
    assert leg.chain.roles == other.chain.roles
    assert leg.chain.home.tolist() == other.chain.home.tolist()
    assert found.reference_point.tolist() == [0, 0, 0.01]
    at = rs.stiffness(found).reference_point
    np.testing.assert_allclose(
        rs.compliance(found), rs.compliance(own, at=at), rtol=1e-12, atol=1e-18
    )


def test_other_values_of_parameters_and_symbols():
    longer = read(ARM, parameters={"l": "700 mm"})
    end, start = rs.stiffness(longer).pose, rs.stiffness(read(ARM)).pose
    assert end is not None
    assert start is not None
    assert np.linalg.norm(end - start) == pytest.approx(0.2)
    robot = read(ARM, symbols=("l", "k"))
    assert [str(symbol) for symbol in robot.symbols] == ["k", "l"]
    assert robot.nominal == {"l": 0.5, "k": 2e4}
    np.testing.assert_allclose(
        rs.compliance(robot.numeric), rs.compliance(read(ARM)), rtol=1e-12, atol=1e-18
    )


SIDE = text_of("ur5-of-example.stiffness.yaml")


def test_published_arm_in_ten_lines_is_that_of_its_urdf(tmp_path):
    """In ROS the base of a UR5 is turned by half a turn about z."""
    side = tmp_path / "ur5.stiffness.yaml"
    side.write_text(SIDE)
    table, described = rs.load(EXAMPLE), rs.load(EXAMPLE.with_name("ur5.urdf"), side=side)
    half = np.diag([-1.0, -1, 1])
    both = np.kron(np.eye(2), half)
    for q in np.random.default_rng(3).uniform(-2, 2, (4, 6)):
        at = rs.JointCoordinates(q)
        own, other = rs.stiffness(table, at), rs.stiffness(described, at)
        np.testing.assert_allclose(half @ own.pose[:3], other.pose[:3], atol=1e-12)
        C, expected = rs.compliance(table, at), rs.compliance(described, at)
        np.testing.assert_allclose(both @ C @ both, expected, rtol=1e-9, atol=1e-15)


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
