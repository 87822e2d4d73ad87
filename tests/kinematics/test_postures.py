"""Postures: reach, coordinates that the legs decide, and poses alone and in company."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.errors import PlausibilityWarning
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.kinematics import PostureFinder, find_posture, place_chain
from robostiff.model import PlacedFreedom
from robostiff.robots import load, robot_file
from tests.generators.legs import has_skewed_axes, random_leg
from tests.generators.machines import case_b, elbow_arm, five_bar


@pytest.mark.parametrize("kind", ["PUS", "PSU", "RUS", "RSU"])
@pytest.mark.parametrize("seed", range(6))
def test_out_of_reach_names_the_leg_and_the_distance(kind: str, seed: int):
    """Shortfall of a rod: by how much the nearest knee is too far from the wanted end."""
    case = random_leg(kind, seed)
    leg, home = case.leg, case.home_pose
    placed = place_chain(leg.chain, leg.chain.home, leg.base.R, leg.base.p)
    drive, *joints = (e for e in placed.elements if isinstance(e, PlacedFreedom))
    A, B = joints[0].point, joints[-1].point
    rod = np.linalg.norm(B - A)
    # straight away from the drive, at right angles to its slide or in the plane of its crank
    e = drive.axis
    if kind[0] == "P":
        away = np.cross(e, [0.3, 0.5, 0.7])
        far = A + (rod + 0.123) * away / np.linalg.norm(away)
        expected = 0.123
    else:
        arm = A - drive.point
        level = e * (e @ arm)
        across = arm - level
        outward = across / np.linalg.norm(across)
        far = drive.point + level + (np.linalg.norm(across) + rod + 0.123) * outward
        expected = 0.123
    pose = home.copy()
    pose[:3] += far - B
    posture = find_posture(case.robot, pose)
    assert not posture.reached[0]
    (sentence,) = posture.complaints
    assert f"leg {leg.name!r} falls short" in sentence
    if kind[1] == "S" or not has_skewed_axes(case):  # such a joint cannot point anywhere
        assert posture.turn_gaps[0, 0] < 1e-7
        assert np.isclose(posture.shift_gaps[0, 0], expected, rtol=0, atol=1e-9)
        assert "123 mm" in sentence


def test_reach_of_a_hexapod_leg_with_limits():
    robot = case_b(limits=(0.3, 0.8))
    inside = find_posture(robot, [0, 0, 0.6, 0, 0, 0])
    assert inside.reached.all()
    assert inside.within_limits.all()
    assert inside.complaints == ()
    above = find_posture(robot, [[0, 0, 0.95, 0, 0, 0], [0, 0, 0.6, 0, 0, 0]])
    assert above.reached.all()
    assert above.within_limits.tolist() == [False, True]
    assert len(above.complaints) == 6
    A = 0.5 * np.array([1, 0, 0])
    B = np.array([0.2 * np.cos(np.pi / 3), 0.2 * np.sin(np.pi / 3), 0.95])
    length = np.linalg.norm(B - A)
    assert above.complaints[0].startswith(f"'P' of leg 'leg1' is at {1e3 * length:.5g} mm, outside")


def test_an_arm_stretched_beyond_its_length():
    robot = elbow_arm()
    with pytest.warns(PlausibilityWarning, match="did you mean JointCoordinates"):
        posture = find_posture(robot, [3.0, 0, 0, 0, 0, 0])
    assert not posture.reached[0]
    # shoulder at (0.05, 0, 0.3): no nearer than this, whatever the turn
    assert posture.shift_gaps[0, 0] > 3.0 - 0.05 - 0.45 - 0.4 - 0.1 - 0.5
    assert "leg 'arm' falls short of the pose" in posture.complaints[0]


def test_planar_robot():
    robot = five_bar()
    posture = find_posture(robot, [[0.05, 0.75, 0, 0, 0, 0.2], [0.0, 0.8, 0, 0, 0, 0]])
    assert posture.reached.all()
    out = find_posture(robot, [0.0, 1.5, 0, 0, 0, 0])
    # both legs are stretched towards (0, 1.5): 1 m long from (+-0.3, 0)
    assert np.allclose(out.shift_gaps[0], np.hypot(0.3, 1.5) - 1.0, rtol=0, atol=1e-12)
    millimetres = f"{1e3 * (np.hypot(0.3, 1.5) - 1.0):.4g} mm"
    assert [
        f"leg {name!r}" in s and millimetres in s
        for name, s in zip(("left", "right"), out.complaints, strict=True)
    ] == [True, True]


@pytest.mark.parametrize("name", ["hexapod", "delta", "hexaglide", "agile-eye", "gantry-tau"])
def test_legs_computed_together_are_where_each_is_alone(name: str):
    """A few poses take equal legs together, many take each alone: coordinates, parts and gaps."""
    robot = load(name)
    finder = PostureFinder(robot)
    chosen = finder.home_pose[robot.coordinate_places]
    near = chosen + 0.01 * np.random.default_rng(2).uniform(-1, 1, (40, chosen.size))
    near[1, 0] += 3.0  # m or rad: out of reach, where there is such a place
    many, few = finder.find(near), finder.find(near[:3])
    assert np.array_equal(few.reached, many.reached[:3])
    for own, alone in zip(few.coordinates, many.coordinates, strict=True):
        assert np.allclose(own[[0, 2]], alone[[0, 2]], rtol=0, atol=1e-11)
    kept = np.array([0, 2])
    assert np.allclose(few.shift_gaps[kept], many.shift_gaps[kept], rtol=0, atol=1e-12)
    for leg, alone in zip(few.snapshot.legs, many.snapshot.legs, strict=True):
        assert leg.name == alone.name
        assert np.allclose(leg.end[kept], alone.end[kept], rtol=0, atol=1e-11)
        for part, other in zip(leg.parts, alone.parts, strict=True):
            assert part.name == other.name
            shown = np.broadcast_to(other.point, (40, 3))[kept]
            assert np.allclose(np.broadcast_to(part.point, (3, 3))[kept], shown, atol=1e-11)


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


def test_postures_are_the_same_to_the_last_bit_in_any_company():
    finder = PostureFinder(load("3-prs"))
    rng = np.random.default_rng(1)
    home = finder.home_pose[[2, 3, 4]]
    # As far as beyond reach, where poses are followed in many steps.
    poses = home + rng.uniform(-1, 1, (24, 3)) * [0.5, 2.0, 2.0]
    whole = finder.find(poses)
    lost = np.flatnonzero(~whole.reached)
    assert 0 < lost.size < 12
    for own in (rng.permutation(24)[:9], np.array([3]), lost[:1]):
        part = finder.find(poses[own])
        np.testing.assert_array_equal(part.pose, whole.pose[own])
        for few, many in zip(part.coordinates, whole.coordinates, strict=True):
            np.testing.assert_array_equal(few, many[own])


def test_at_home_legs_are_where_they_are():
    finder = PostureFinder(load("3-prs"))
    home = finder.home_pose[[2, 3, 4]]
    poses = np.array([home, home + np.array([0.01, 0.1, 0.0]), home])
    found = finder.find(poses)
    assert found.reached.all()
    for q, own in zip(found.coordinates, finder.homes, strict=True):
        np.testing.assert_array_equal(q[[0, 2]], [own, own])
    for q, alone in zip(found.coordinates, finder.find(poses[1]).coordinates, strict=True):
        np.testing.assert_array_equal(q[1], alone[0])
