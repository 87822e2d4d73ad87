"""Newton steps as a record: where they arrive, and where they say that they do not."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.compiled import closed, machine_code_is_available
from robostiff.kinematics import PostureFinder, posture_finder
from robostiff.kinematics.formula import FormulaPose
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Branch, Coordinate, Joint, ParallelBlock
from robostiff.record import CLOSED, Program, Record
from robostiff.recorded import RecordedClosure, record_closure
from robostiff.recorded.newton_step import LegAtGuess, newton_step
from robostiff.spatial import Frame
from tests.generators.machines import elbow_arm
from tests.generators.planted_poses import PoseSpace

MODELS = Path(__file__).parent / "models"
BACKENDS = [rs.Backend.ARRAYS, *([rs.Backend.MACHINE] if machine_code_is_available() else [])]


def robot_called(name: str) -> rs.Robot:
    path = MODELS / f"{name}.yaml"
    robot = rs.load(path if path.exists() else name)
    return robot


def closure_of(robot: rs.Robot) -> RecordedClosure:
    joints = [f"{leg.name}/{i}" for leg in robot.legs for i in range(leg.chain.size)]
    closure = record_closure(robot.numeric, PostureFinder(robot.numeric), joints)
    assert closure is not None
    return closure


def arrivals(closure: RecordedClosure, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates of all legs (N, m), and where the closure arrives (N,)."""
    record = Record({name: [0.5] for name in closure.joints})
    joints = Program.of(record, [record.input(x) for x in closure.joints])
    program = closure.after_all_steps(closure.at_end(joints))
    with np.errstate(all="ignore"):
        found = program.evaluate(dict(zip(closure.inputs, poses.T, strict=True)))
    *q, gap, mode = (np.broadcast_to(x, len(poses)) for x in found)
    return np.stack(q, axis=-1), (gap < CLOSED) & (mode > 0)


def largest_difference(K: np.ndarray, expected: np.ndarray) -> float:
    size = np.sqrt(np.einsum("nii->ni", expected))
    return float(np.max(np.abs(K - expected) / (size[:, :, None] * size[:, None, :])))


@pytest.mark.parametrize("name", ["tricept", "exechon", "t3r1", "h4", "held-bars"])
def test_stiffness_from_poses(name: str):
    robot = robot_called(name)
    poses = PoseSpace(robot).beside(30, 0.05 if name == "held-bars" else 0.12)
    result = rs.stiffness(robot, poses)
    for backend in BACKENDS:
        compiled = rs.compile(robot, backend=backend)
        assert compiled.verified
        assert not compiled.takes_joints
        assert compiled.kernel.inputs == tuple(c.value for c in robot.coordinates)
        answer = compiled.evaluate(poses)
        assert answer.guarded_share < 0.3
        np.testing.assert_array_equal(answer.status_codes, result.status_codes)
        np.testing.assert_array_equal(answer.rank, result.rank)
        ok = result.answered & ~answer.guarded
        assert largest_difference(answer.values["K"][ok], result[ok].K) < 1e-9


def test_a_loop_over_one_step_is_the_same_as_all_steps_written_out(monkeypatch):
    robot = robot_called("exechon")
    poses = PoseSpace(robot).beside(1500, 0.2)
    monkeypatch.setattr("robostiff.analysis.recording.is_trusted", lambda *_: True)
    whole = rs.compile(robot, backend=rs.Backend.ARRAYS)
    monkeypatch.setattr(closed, "_LONGEST", 0)
    for backend in BACKENDS:
        loop = rs.compile(robot, backend=backend)
        assert isinstance(loop.kernel.code, closed.ClosedCode)
        assert loop.kernel.code.whole is None
        assert 0.9 < loop.kernel.operations / whole.kernel.operations < 1.5
        found, expected = loop.evaluate(poses, again=False), whole.evaluate(poses, again=False)
        np.testing.assert_array_equal(found.guarded, expected.guarded)
        own = ~found.guarded
        assert largest_difference(found.values["K"][own], expected.values["K"][own]) < 1e-11
        rows = np.ascontiguousarray(poses.T)
        again = pickle.loads(pickle.dumps(loop.kernel)).evaluate(rows, threads=2)  # noqa: S301
        np.testing.assert_array_equal(again, loop.kernel.evaluate(rows))
        assert loop.kernel.evaluate(rows[:, :0]).shape == (loop.kernel.rows, 0)


def test_poses_far_from_home_take_more_steps():
    robot = robot_called("t3r1")
    poses = PoseSpace(robot).beside(600, 0.25)
    closure = closure_of(robot)
    _, arrived = arrivals(closure, poses)
    assert 0.02 < np.mean(~arrived) < 0.6
    compiled = rs.compile(robot, backend=rs.Backend.ARRAYS)
    found = compiled.evaluate(poses, again=False)
    assert not found.guarded.any()
    some = np.flatnonzero(~arrived)[:20]
    assert largest_difference(found.values["K"][some], rs.stiffness(robot, poses[some]).K) < 1e-9


@pytest.mark.parametrize("name", ["capaman", "h4", "t3r1", "3-prs", "exechon"])
def test_a_pose_is_out_of_reach_where_the_way_to_it_ends(name: str):
    robot = robot_called(name)
    finder, fast = posture_finder(robot), rs.compile(robot)
    places = robot.coordinate_places
    sizes = np.where(np.array(places) < 3, finder.length, 2.0)
    poses = np.random.default_rng(7).uniform(-1, 1, (60, len(places)))
    poses[:12, 1:] = 0  # only some legs close where another coordinate is as at home
    poses = finder.home_pose[places] + sizes * poses
    answer, direct = fast.evaluate(poses), direct_stiffness(robot, poses)
    np.testing.assert_array_equal(answer.status_codes, direct.status_codes)
    np.testing.assert_array_equal(answer.rank, direct.rank)
    lost = answer.status_codes == int(rs.Status.UNREACHABLE)
    assert lost.sum() > 10
    assert np.isnan(answer.values["K"][lost]).all()
    assert np.mean(answer.guarded[lost]) < 0.5


def test_a_parallelogram_does_not_pass_through_its_line():
    """Equal coordinates close it beyond as well, in another assembly mode."""

    def crank(y: float) -> Branch:
        elements = (
            rs.revolute(
                [1, 0, 0], rs.Actuated(1e3) if y < 0 else rs.Passive(), name="pin", home=[0.4]
            ),
            rs.Rigid(Frame(np.eye(3), np.array([0, 0, 0.1]))),
            rs.revolute([1, 0, 0], rs.Passive(), name="coupler", home=[-0.4]),
        )
        at = Frame(np.eye(3), np.array([0, y, 0]))
        return Branch(f"at {y:g}", at, rs.Chain(elements), at)

    block = ParallelBlock((crank(-0.1), crank(0.1)), "parallelogram")
    y, z = -0.1 * np.sin(0.4), 0.1 * np.cos(0.4)
    home = Frame(np.eye(3), np.array([0, y, z]))
    leg = rs.Leg("leg", Frame.identity(), rs.Chain((block,)), Frame.identity())
    robot = rs.Robot("crank", (leg,), home=home, coordinates=(Coordinate.Z,))
    closure = closure_of(robot)
    assert sum("leg/" in name for name in closure.start) == 2
    z = np.array([[0.08], [0.02], [-0.02]])
    q, arrived = arrivals(replace(closure, steps=6), z)
    np.testing.assert_allclose(0.1 * np.cos(q[:, 0]), z[:, 0], atol=1e-12)
    assert arrived.tolist() == [True, True, False]
    reached = PostureFinder(robot).find(z).reached
    np.testing.assert_array_equal(reached, arrived)


def test_half_a_turn_is_not_closed():
    """There vee(D - D^T) vanishes, so that a step moves nothing; the chord does not."""
    here = Frame(np.eye(3), np.zeros(3))
    leg = rs.Leg("pin", here, rs.Chain((rs.revolute([0, 0, 1], rs.Actuated(1.0)),)), here)
    record = Record({"q": [0.3, -0.2], "rz": [0.3, -0.2]})
    q, rz = (np.array([record.input(name)], dtype=object) for name in ("q", "rz"))
    r = np.array([0, 0, rz[0]], dtype=object)
    pose = FormulaPose.of_coordinates(np.array([0, 0, 0, *r], dtype=object))
    step = newton_step([LegAtGuess(leg, ["q"], q)], pose, r, {}, 1.0)
    program = Program.of(record, [step.size, step.gap])
    size, gap = program.evaluate({"q": 0.0, "rz": np.pi})
    assert size < 1e-30
    assert gap == pytest.approx(8.0)
    assert program.evaluate({"q": 0.4, "rz": 0.4})[1] < 1e-30


def limited_arm() -> rs.Robot:
    """A serial arm posed by its platform; its first joint is limited to another turn."""
    arm = elbow_arm()
    home = rs.find_posture(arm).pose[0]
    (leg,) = arm.legs
    first, *others = leg.chain.elements
    assert isinstance(first, Joint)
    first = replace(first, role=rs.Actuated(1e5, limits=(1.9 * np.pi, 2.2 * np.pi)))
    leg = replace(leg, chain=rs.Chain((first, *others)))
    return replace(arm, legs=(leg,), home=Frame(turn_by_vector(home[3:]), home[:3]))


def test_an_arm_takes_poses_and_joint_coordinates():
    robot = limited_arm()
    compiled = rs.compile(robot, backend=rs.Backend.ARRAYS)
    assert compiled.verified
    assert compiled.takes_joints
    poses = PoseSpace(robot).beside(40, 0.1)
    result = rs.stiffness(robot, poses)
    answer = compiled.evaluate(poses)
    np.testing.assert_array_equal(answer.status_codes, result.status_codes)
    assert largest_difference(answer.values["K"], result.K) < 1e-9
    joints = rs.JointCoordinates(np.hstack(list(result.joint_coordinates.values())))
    by_joints = compiled.evaluate(joints)
    assert largest_difference(by_joints.values["K"], result.K) < 1e-9


def test_a_rod_that_spins_is_held_where_it_is_at_home():
    """No step determines the spin of struts between spherical joints, and K does not need it."""
    robot = robot_called("sps-wrist")
    spins = [name.split("/")[0] for name in closure_of(robot).held]
    assert spins == ["strut1", "strut2", "strut3"]
    poses = PoseSpace(robot).beside(40, 0.2)
    compiled = rs.compile(robot, backend=rs.Backend.ARRAYS)
    assert compiled.verified
    assert compiled.kernel.inputs == ("rx", "ry", "rz")
    answer, result = compiled.evaluate(poses), rs.stiffness(robot, poses)
    assert not answer.guarded.any()
    np.testing.assert_array_equal(answer.status_codes, result.status_codes)
    np.testing.assert_array_equal(answer.rank, result.rank)
    assert largest_difference(answer.values["K"], result.K) < 1e-11


def test_a_chain_that_folds_freely_has_no_steps():
    """Four parallel joints: K depends on the fold, which the way of the iteration chooses."""
    robot = robot_called("folding-legs")
    assert closure_of(robot).held
    compiled = rs.compile(robot, backend=rs.Backend.ARRAYS)
    assert compiled.kernel.inputs[0] == "l1/0"
    poses = PoseSpace(robot).beside(10, 0.02)
    answer, result = compiled.evaluate(poses), rs.stiffness(robot, poses)
    np.testing.assert_array_equal(answer.status_codes, result.status_codes)
    np.testing.assert_allclose(answer.values["K"], result.K, atol=1e-9 * np.max(result.K))
