"""Arms at poses of their end: the closed form of a wrist on three turns, and open drives."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff import Status
from robostiff.kinematics import posture_finder
from robostiff.kinematics.closure import LegSolver
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Joint
from robostiff.spatial import Frame
from tests.generators.elements import ROD, STEEL

HOME = np.array([0.3, -0.5, 0.9, 0.4, 0.8, -0.6])


def random_arm(seed: int, *, ball: bool = False, home: Any = HOME) -> rs.Robot:
    """Links and axes at random, but the second axis parallel to the third; perhaps a ball wrist."""
    random = np.random.default_rng(seed)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    axes = random.uniform(-1, 1, (6, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    if seed % 2:  # as drawn in catalogues
        axes = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], float)
    axes[2] = axes[1] * (1 if seed % 3 else -1)
    links = random.uniform(-0.4, 0.4, (3, 3)) + 0.3 * axes[[4, 0, 3]]
    elements: list[Any] = []
    for i in range(3):
        elements.append(rs.revolute(axes[i], rs.Actuated(1e5), home=[home[i]], name=f"j{i + 1}"))
        elements.append(rs.beam_link(links[i], STEEL, ROD))
    if ball:
        elements.append(rs.spherical(rs.Passive()))
    else:
        for i in range(3, 6):
            elements.append(
                rs.revolute(axes[i], rs.Actuated(2e4), home=[home[i]], name=f"j{i + 1}")
            )
            elements.append(
                rs.beam_link(0.1 * axes[i], STEEL, ROD) if i == 5 else rs.Rigid(Frame.identity())
            )
    base = Frame(turn, random.uniform(-1, 1, 3))
    tool = Frame(
        Rotation.random(rng=np.random.default_rng(seed + 9)).as_matrix(),
        random.uniform(-0.2, 0.2, 3),
    )
    return rs.Robot("arm", (rs.Leg("arm", base, rs.Chain(tuple(elements)), tool),))


def solver_of(robot: rs.Robot) -> LegSolver:
    (solver,) = posture_finder(robot).solvers
    return solver


def poses_at(robot: rs.Robot, q: Any) -> np.ndarray:
    return rs.find_posture(robot, rs.JointCoordinates(q)).pose


def turned_apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """By how much angles differ, but for full turns."""
    return np.abs(np.sin(0.5 * (a - b)))


@pytest.mark.parametrize("ball", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_postures_are_those_that_newton_follows_from_home(seed: int, ball: bool):
    """Three turns and a ball close in the same form as six turns."""
    robot, random = random_arm(seed, ball=ball), np.random.default_rng(seed)
    solver = solver_of(robot)
    assert solver.closed_form is not None
    assert solver.recorded_form is None
    home = np.concatenate([HOME[:3], np.zeros(3)]) if ball else HOME
    assert ball or np.allclose(solver.home, HOME, rtol=0, atol=1e-12)
    poses = poses_at(robot, home + random.uniform(-0.3, 0.3, (20, 6)))
    found = rs.find_posture(robot, poses)
    (q,), elsewhere, _ = replace(solver, closed_form=None).solve(
        poses, turn_by_vector(poses[:, 3:])
    )
    met = found.reached & ~elsewhere
    assert np.count_nonzero(met) >= 5
    assert np.allclose(found.coordinates[0][met], q[met], rtol=0, atol=1e-9)
    assert max(found.shift_gaps[found.reached].max(), found.turn_gaps[found.reached].max()) < 1e-12


@pytest.mark.parametrize("seed", range(4))
def test_eight_postures_reach_a_pose_and_each_is_chosen_by_coordinates_close_by(seed: int):
    robot = random_arm(seed)
    pose = poses_at(robot, HOME)[0]
    found = rs.postures(robot, pose)["arm"]
    every = np.array([own.coordinates for own in found])
    assert np.allclose(every[0], HOME, rtol=0, atol=1e-9)
    assert len(found) in (2, 4, 8)
    assert np.allclose(poses_at(robot, every), pose, rtol=0, atol=1e-12)
    apart = [turned_apart(a, b).max() for i, a in enumerate(every) for b in every[:i]]
    assert min(apart) > 1e-3
    for own in every:
        near = own + np.random.default_rng(1).uniform(-1e-3, 1e-3, 6)
        q = rs.find_posture(robot, pose, near=near).coordinates[0][0]
        assert np.allclose(q, own, rtol=0, atol=1e-9)


def test_out_of_reach_the_pose_is_reported_and_the_arm_points_there():
    robot = rs.load("six-joint-arm")
    pose = poses_at(robot, HOME)[0]
    pose[0] += 1.0
    found = rs.find_posture(robot, pose)
    assert not found.reached[0]
    assert "falls short of the pose by" in found.complaints[0]


IN_LINE = np.array([0.1, 0.2, 0.3, 0.4, 0.0, 0.2])


def without_parallel_axes() -> rs.Robot:
    """The shipped arm with its third axis turned, which has no closed form."""
    robot = rs.load("six-joint-arm")
    elements = list(robot.legs[0].chain.elements)
    (at,) = (i for i, own in enumerate(elements) if own.name == "joint3")
    third = elements[at]
    assert isinstance(third, Joint)
    skew = rs.revolute([0, np.cos(0.2), np.sin(0.2)], third.role, home=[0.26], name="joint3")
    elements[at] = skew
    return replace(robot, legs=(replace(robot.legs[0], chain=rs.Chain(tuple(elements))),))


@pytest.mark.parametrize("robot", [rs.load("six-joint-arm"), without_parallel_axes()])
def test_a_wrist_in_line_leaves_two_drives_open_and_every_answer_says_so(robot: rs.Robot):
    F = [100, 200, -150, 0, 0, 0]
    pose = poses_at(robot, IN_LINE)
    open_, sure = rs.stiffness(robot, pose[0]), rs.stiffness(robot, rs.JointCoordinates(IN_LINE))
    assert sure.status == Status.OK
    assert open_.status == Status.ILL_CONDITIONED
    assert "two axes of a wrist in one line" in open_.advice[0]
    q = open_.joint_coordinates["arm"]
    assert np.isclose(q[3] + q[5], 0.6)
    assert np.abs(open_.K / sure.K - 1).max() > 1e-3
    assert rs.equilibrium(robot, pose[0], F).status == Status.ILL_CONDITIONED
    fast = rs.compile(robot, backend=rs.Backend.ARRAYS).evaluate(pose)
    assert fast.status_codes.tolist() == [int(Status.ILL_CONDITIONED)]
    near = rs.stiffness(robot, pose[0], near=IN_LINE)
    assert near.status == Status.OK
    assert np.allclose(near.K, sure.K, rtol=1e-9, atol=1e-9 * np.abs(sure.K).max())
    assert rs.equilibrium(robot, pose[0], F, near=IN_LINE).status == Status.OK


def test_a_kernel_under_load_says_so_of_a_wrist_in_line():
    robot = rs.load("six-joint-arm")
    loaded = rs.compile_loaded(robot, backend=rs.Backend.ARRAYS)
    found = loaded.evaluate(poses_at(robot, IN_LINE), [100, 200, -150, 0, 0, 0])
    assert found.status == Status.ILL_CONDITIONED


def test_of_the_postures_of_a_wrist_in_line_the_nearest_to_home_is_taken():
    robot = rs.load("six-joint-arm")
    home, pose = robot.legs[0].chain.home, poses_at(robot, IN_LINE)[0]
    q = rs.find_posture(robot, pose).coordinates[0][0]
    a = 0.5 * (0.6 + home[3] - home[5])
    assert np.allclose(q, [0.1, 0.2, 0.3, a, 0, 0.6 - a], rtol=0, atol=1e-7)


def test_a_wrist_point_on_the_first_axis_leaves_that_drive_open():
    robot = rs.load("six-joint-arm")
    W = np.array([0.0, 0.0, 1.4])  # above the base, where the first axis is
    # Two links of 0.6 and 0.65 m from the shoulder at (0.15, 0, 0.45).
    to_W = W - [0.15, 0, 0.45]
    r, a, b = np.linalg.norm(to_W), 0.6, 0.65
    at = np.arctan2(to_W[0], to_W[2]) - np.arccos((r * r + a * a - b * b) / (2 * r * a))
    elbow = np.array([0.15, 0, 0.45]) + a * np.array([np.sin(at), 0, np.cos(at)])
    along = (W - elbow) / b
    q = np.array([0.3, at, np.arctan2(along[0], along[2]) - 0.5 * np.pi - at, 0.2, 0.7, 0.1])
    pose = poses_at(robot, q)[0]
    found = rs.find_posture(robot, pose)
    assert found.reached[0]
    assert found.undetermined[0]
    assert rs.stiffness(robot, pose, near=q).status in (Status.OK, Status.BEYOND_LIMITS)


def test_from_a_home_with_all_joints_at_zero_the_nearest_posture_is_found_on_both_sides():
    """There the wrist is in line, so that its two ways meet."""
    robot = rs.load("six-joint-arm")
    chain = robot.legs[0].chain
    elements = [
        replace(own, home=np.zeros(1)) if hasattr(own, "home") else own for own in chain.elements
    ]
    robot = replace(robot, legs=(replace(robot.legs[0], chain=rs.Chain(tuple(elements))),))
    assert rs.stiffness(robot, poses_at(robot, np.zeros(6))[0]).status == Status.OK
    for bend in (0.2, -0.2):
        q = np.array([0.1, 0.15, 0.05, 0.1, bend, -0.2])
        found = rs.find_posture(robot, poses_at(robot, q))
        assert np.allclose(found.coordinates[0], q, rtol=0, atol=1e-9)


def test_an_arm_that_is_stretched_out_at_its_end_of_reach_is_not_open():
    robot = rs.load("six-joint-arm")
    pose = poses_at(robot, [0.1, 0.4, -0.5 * np.pi, 0.2, 0.6, 0.1])[0]
    found = rs.find_posture(robot, pose)
    assert found.reached[0]
    assert not found.undetermined[0]
