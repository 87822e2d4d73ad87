"""A posture is chosen by joint coordinates, listed where it has closed form, or asked for."""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.kinematics.pose import pose_of_end
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Coordinate, beam_link, prismatic, revolute, spherical, universal
from robostiff.spatial import Frame, Space
from tests.cli.running import Running
from tests.generators.elements import ROD, STEEL, random_transform
from tests.generators.legs import random_leg
from tests.kinematics.test_choice_of_posture import planar_crank

DRIVE = rs.Actuated(1e4)
MOVED = np.array([0.02, 0.01, -0.03, 0.05, 0.02, 0.1])
IN_PLANE = (Coordinate.X, Coordinate.Y, Coordinate.RZ)


def planar_arm(home: list[float] | None = None) -> rs.Robot:
    elements = []
    for i, length in enumerate((0.4, 0.3, 0.2)):
        own = [] if home is None else [home[i]]
        elements += [
            revolute([0, 0, 1], DRIVE, home=own, name=f"joint{i + 1}"),
            rs.Rigid(Frame(np.eye(3), np.array([length, 0, 0]))),
        ]
    leg = rs.Leg("arm", Frame.identity(), rs.Chain(tuple(elements)), Frame.identity())
    return rs.Robot("arm", (leg,), coordinates=(), space=Space.PLANAR)


def textbook_stiffness(q: np.ndarray) -> np.ndarray:
    """(J k^-1 J^T)^-1 of the planar arm at its tool."""
    sums = np.cumsum(q)
    steps = np.stack([np.cos(sums), np.sin(sums)], axis=-1) * np.array([[0.4], [0.3], [0.2]])
    tool = steps.sum(axis=0)
    joints = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)[:2]])
    arms = tool - joints
    J = np.stack([-arms[:, 1], arms[:, 0], np.ones(3)])
    return np.linalg.inv(J @ J.T / 1e4)


def random_arm(seed: int) -> rs.Robot:
    """Six axes and beams, all of it random."""
    random = np.random.default_rng(seed)
    elements = []
    for i in range(6):
        elements += [
            revolute(random.normal(size=3), DRIVE, name=f"joint{i + 1}"),
            beam_link(random.uniform(0.1, 0.5) * random.normal(size=3), STEEL, ROD),
        ]
    leg = rs.Leg("arm", random_transform(random), rs.Chain(tuple(elements)), Frame.identity())
    return rs.Robot("arm", (leg,), coordinates=())


def test_both_elbows_of_an_arm_are_found_near_their_joint_coordinates():
    arm = planar_arm()
    q = np.array([0.3, 0.9, -0.4])
    known = rs.stiffness(arm, rs.JointCoordinates(q))
    assert known.advice == ()
    for near in (q, q + 0.2, [q], rs.JointCoordinates(q)):
        result = rs.stiffness(arm, known.pose, near=near)
        assert np.allclose(result.joint_coordinates["arm"], q, rtol=0, atol=1e-12)
        assert np.allclose(result.K, textbook_stiffness(q), rtol=1e-10)
        assert result.advice == ()
    (up, down) = rs.postures(closed_at(arm, known.pose), known.pose)["arm"]
    assert {up.mode.root, down.mode.root} == {1, -1}
    assert up.of_home
    assert not down.of_home
    other = next(p.coordinates for p in (up, down) if np.abs(p.coordinates - q).max() > 0.1)
    result = rs.stiffness(arm, known.pose, near=other)
    assert np.allclose(result.K, textbook_stiffness(other), rtol=1e-10)
    assert abs(result.K[1, 1] / known.K[1, 1] - 1) > 0.1
    # the same by deflection and compliance
    C = rs.compliance(arm, known.pose, near=other)
    assert np.allclose(
        C, np.linalg.inv(textbook_stiffness(other)), rtol=1e-10, atol=1e-10 * np.abs(C).max()
    )
    bent = rs.deflection(arm, known.pose, [1.0, 2.0, 0.5], near=other)
    assert np.allclose(
        bent.twist, C @ [1.0, 2.0, 0.5], rtol=1e-10, atol=1e-10 * np.abs(bent.twist).max()
    )
    loads = [actuator.load for actuator in bent.actuators]
    assert np.isclose(sum(load**2 / 1e4 for load in loads) / 2, bent.energy, rtol=1e-10, atol=0)
    assert np.isclose(bent.energy, 0.5 * bent.twist @ [1.0, 2.0, 0.5], rtol=1e-10, atol=0)


def closed_at(arm: rs.Robot, pose: np.ndarray | None) -> rs.Robot:
    """The arm with a home pose, and joints whose home coordinates are left out."""
    assert pose is not None
    turn = np.array([[np.cos(pose[5]), -np.sin(pose[5]), 0], [np.sin(pose[5]), np.cos(pose[5]), 0]])
    R = np.concatenate([turn, [[0, 0, 1]]])
    return rs.Robot("arm", arm.legs, Frame(R, pose[:3]), coordinates=IN_PLANE, space=arm.space)


@pytest.mark.parametrize("posed_by_home", [False, True])
def test_where_nobody_chose_among_several_postures_the_result_says_so(posed_by_home: bool):
    q = [0.3, 0.9, -0.4]
    pose = rs.stiffness(planar_arm(), rs.JointCoordinates(q)).pose
    assert pose is not None
    arm = planar_arm()
    if posed_by_home:
        arm = closed_at(arm, pose)
    result = rs.stiffness(arm, None if posed_by_home else pose)
    assert any("several postures of different stiffness" in words for words in result.advice)
    both = rs.stiffness(arm, np.stack([pose, pose]))
    assert any("several postures of different stiffness" in words for words in both.advice)
    # home coordinates near the wanted posture choose it
    chosen = planar_arm(home=[0.2, 0.7, 0.0])
    if posed_by_home:
        chosen = closed_at(chosen, pose)
    result = rs.stiffness(chosen, pose)
    assert result.advice == ()
    assert np.allclose(result.joint_coordinates["arm"], q, rtol=0, atol=1e-10)


def test_a_robot_drawn_at_zero_coordinates_has_chosen_its_posture():
    robot = rs.load("agile-eye")
    assert rs.stiffness(robot).advice == ()


@pytest.mark.parametrize("seed", range(6))
def test_arms_of_six_axes_return_to_the_coordinates_they_are_near(seed: int):
    arm = random_arm(seed)
    random = np.random.default_rng(seed)
    q = random.uniform(-3, 3, 6)
    known = rs.stiffness(arm, rs.JointCoordinates(q))
    result = rs.stiffness(arm, known.pose, near=q)
    assert np.allclose(result.joint_coordinates["arm"], q, rtol=0, atol=1e-9)
    assert np.allclose(result.K, known.K, rtol=1e-7, atol=1e-9 * np.abs(known.K).max())
    assert result.advice == ()
    moved = rs.stiffness(arm, known.pose, near=q + random.uniform(-1, 1, 6) * 1e-3)
    assert np.allclose(moved.joint_coordinates["arm"], q, rtol=0, atol=1e-8)


def test_any_choice_of_one_posture_for_each_leg_is_a_posture_of_the_robot():
    robot, pose = planar_crank(None, np.radians(200)), [0.02, -0.01, 0.1]
    found = rs.postures(robot, pose)
    assert [len(own) for own in found.values()] == [2, 2, 2]
    result = rs.stiffness(robot, pose)
    for leg, own in found.items():
        assert np.allclose(result.joint_coordinates[leg], own[0].coordinates)
    near = [own[i].coordinates for i, own in zip((1, 0, 1), found.values(), strict=True)]
    elbows = {
        leg: rs.Elbow.PLUS if own[i].mode.root > 0 else rs.Elbow.MINUS
        for i, (leg, own) in zip((1, 0, 1), found.items(), strict=True)
    }
    named = rs.stiffness(robot.with_elbows(elbows), pose)
    for choice in (near, np.concatenate(near)):
        mixed = rs.stiffness(robot, pose, near=choice)
        assert np.allclose(mixed.K, named.K, rtol=1e-12)
    assert np.abs(mixed.K - result.K).max() > 1e-3 * np.abs(result.K).max()


def test_legs_by_iteration_are_followed_from_near():
    robot = rs.load("agile-eye")
    known = rs.find_posture(robot)
    again = rs.find_posture(robot, near=[q[0] for q in known.coordinates])
    for a, b in zip(known.coordinates, again.coordinates, strict=True):
        assert np.allclose(a, b, rtol=0, atol=1e-9)
    arm = random_arm(0)
    pose = rs.find_posture(arm, rs.JointCoordinates(np.full(6, 0.4))).pose[0]
    with pytest.raises(rs.InputError, match="closed by iteration"):
        rs.postures(arm, pose)


def test_a_slide_may_be_chosen_on_either_side():
    """UPS, whose strut stands upside down in one posture."""
    chain = rs.Chain(
        (
            universal([1, 0, 0], [0, 1, 0], rs.Passive()),
            prismatic([0, 0, 1], rs.Actuated(1e7), home=[0.6]),
            spherical(rs.Passive()),
        )
    )
    leg = rs.Leg("leg", Frame.identity(), chain, Frame.identity())
    robot = rs.Robot("leg", (leg,), home=Frame(np.eye(3), np.array([0.1, 0.2, 0.5])))
    found = rs.postures(robot)["leg"]
    lengths = sorted(float(posture.coordinates[2]) for posture in found)
    size = np.sqrt(0.3)
    assert np.allclose(lengths, [-size, -size, size, size])
    for posture in found:
        q = rs.find_posture(robot, near=posture.coordinates).coordinates[0][0]
        assert np.allclose(q, posture.coordinates, atol=1e-12)


def test_drives_that_move_alone_leave_the_posture_open_and_the_result_says_so():
    """Seven driven turns: the elbow moves while the hand stands, and the stiffness with it."""
    axes = ([0, 0, 1], [0, 1, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1])
    homes = (0.2, 0.6, -0.3, 1.1, 0.4, -0.7, 0.1)
    elements = []
    for i, (axis, home) in enumerate(zip(axes, homes, strict=True)):
        elements.append(revolute(axis, rs.Actuated(1e5), home=[home], name=f"j{i + 1}"))
        elements.append(beam_link([0.02, 0, 0.3], STEEL, ROD))
    at_home = rs.Leg("arm", Frame.identity(), rs.Chain(tuple(elements)), Frame.identity())
    q = np.array(homes)
    end = pose_of_end(at_home, q)
    arm = rs.Robot("arm", (at_home,), home=Frame(turn_by_vector(end[3:]), end[:3]))
    pose = end + MOVED
    found = rs.stiffness(arm, pose)
    (advice,) = found.advice
    assert found.status == rs.Status.OK
    assert "drives of leg 'arm' can move while the platform stands still" in advice
    near = rs.stiffness(arm, pose, near=[q + np.array([0.3, 0, -0.3, 0, 0, 0, 0])])
    assert near.advice == ()
    assert np.abs(near.K / found.K - 1).max() > 1e-3
    six = replace(at_home, chain=rs.Chain((*elements[:4], *elements[6:])))  # without the third turn
    end = pose_of_end(six, np.delete(q, 2))
    arm = rs.Robot("arm", (six,), home=Frame(turn_by_vector(end[3:]), end[:3]))
    assert rs.stiffness(arm, end + MOVED).advice == ()


@pytest.mark.parametrize("kind", ["PUU", "RUU"])
def test_a_pose_that_is_reached_in_another_working_mode_only_says_so(kind: str):
    """The end of five freedoms says which way the rod goes: here not as at home."""
    case, refused = random_leg(kind, 4), 0
    random = np.random.default_rng(7)
    pose = pose_of_end(case.leg, case.leg.chain.home)
    for _ in range(30):
        q = case.leg.chain.home + 0.6 * random.uniform(-1, 1, case.leg.chain.size)
        pose = pose_of_end(case.leg, q)
        found = rs.stiffness(case.robot, pose)
        if found.status & rs.Status.UNREACHABLE:
            said = [sentence for sentence in found.advice if "another working mode" in sentence]
            assert len(said) == 1
            near = rs.stiffness(case.robot, pose, near=[q])
            assert not near.status & rs.Status.UNREACHABLE
            assert np.allclose(near.joint_coordinates[case.leg.name], q, rtol=0, atol=1e-6)
            refused += 1
    far = rs.stiffness(case.robot, pose + 9 * np.eye(6)[0])
    assert far.status == rs.Status.UNREACHABLE
    assert not any("working mode" in sentence for sentence in far.advice)
    assert 0 < refused < 30


def test_near_chooses_the_posture_of_every_question(tmp_path):
    robot = rs.load("3-rrr")
    pose = [0.02, 0.01, 0.1]
    own, *others = rs.postures(robot, pose)["leg1"]
    q = [leg[0] for leg in rs.find_posture(robot, pose).coordinates]
    near = [others[0].coordinates, *q[1:]]
    K, plain = rs.stiffness(robot, pose, near=near).K, rs.stiffness(robot, pose).K
    assert own.of_home
    assert not np.allclose(K, plain, rtol=1e-3)
    assert np.array_equal(rs.indices(robot, pose, near=near).result.K, K)
    assert np.array_equal(rs.verify(robot, pose, near=near).reference.K, K)
    assert rs.verify(robot, pose, near=near).agree
    C = rs.compliance(robot, [pose, pose], near=near)
    np.testing.assert_allclose(C @ K, np.tile(np.eye(3), (2, 1, 1)), atol=1e-9)
    bent = rs.deflection(robot, [pose], [10, 0, 0], near=near)
    np.testing.assert_allclose(bent.twist[0], 10 * C[0, :, 0], rtol=1e-9)
    words = ["--pose", " ".join(map(str, pose)), "--near", " ".join(map(str, np.concatenate(near)))]
    smallest = rs.indices(robot, pose, near=near).collinear.smallest
    shown = Running("indices", "3-rrr").done(*words, "--json").stdout
    assert f"{smallest:.9g}"[:8] in shown
    Running("verify", "3-rrr").done(*words)
    Running("report", "3-rrr").done("-o", tmp_path / "page.html", *words)
    assert (tmp_path / "page.html").exists()
