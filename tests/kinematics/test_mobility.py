"""The freedoms that the legs leave to the platform, and coordinates that describe them."""

import pytest

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.kinematics import PostureFinder
from robostiff.kinematics.closure.loops import fitting_coordinates, platform_mobility
from robostiff.robots import robot_file


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("3-puu", "x y z"),
        ("tripteron", "x y z"),
        ("orthoglide", "x y z"),
        ("delta", "x y z"),
        ("3-rrr", "x y rz"),
        ("3-rpr-beams", "x y rz"),
        ("gough-stewart-b", "x y z rx ry rz"),
        ("two-link-arm", "y rz"),
    ],
)
def test_freedoms_of_shipped_robots(name, expected):
    robot = rs.load(name)
    finder = PostureFinder(robot)
    q = [solver.home for solver in finder.solvers]
    mobility = platform_mobility(robot, finder.home_pose, q, finder.length)
    assert " ".join(c.value for c in fitting_coordinates(mobility)) == expected


def with_coordinates(line: str) -> rs.Robot:
    text = robot_file("3-puu").read_text()
    assert "coordinates: [x, y, z]\n" in text
    return model_from_document(parse_document(text.replace("coordinates: [x, y, z]\n", line)))


def test_coordinates_left_out_follow_from_the_legs():
    assert [c.value for c in with_coordinates("").coordinates] == ["x", "y", "z"]


def test_all_six_are_allowed():
    robot = with_coordinates("coordinates: [x, y, z, rx, ry, rz]\n")
    assert str(rs.stiffness(robot, [0, 0, 0.3, 0, 0, 0]).status) == "ok"
    assert str(rs.stiffness(robot, [0, 0, 0.3, 0.1, 0, 0]).status) == "unreachable"


@pytest.mark.filterwarnings("ignore::robostiff.errors.PlausibilityWarning")
@pytest.mark.parametrize("scale", [1e-5, 1e-3, 1.0, 1e3])
def test_newton_closes_at_every_size(scale):
    sizes = {"l": 0.35, "d": 0.45, "e": 0.06}
    resized = rs.load("tripteron", {name: f"{scale * own} m" for name, own in sizes.items()})
    poses = [[0.05 * scale, 0.02 * scale, -0.03 * scale], [-0.06 * scale, 0.04 * scale, 0.0]]
    assert rs.find_posture(resized, poses).reached.all()
