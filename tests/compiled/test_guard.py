"""Compiled robots against `stiffness`: same status, same rank, same K, wherever the pose is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.compiled_stiffness import CompiledStiffness, compile_stiffness
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.compiled import Backend, machine_code_is_available
from robostiff.model import ALL_COORDINATES, Coordinate, parallelogram
from tests.analysis.kernels.cases import every_output
from tests.compiled.agreement import agreement
from tests.generators.kernel_robots import ALL_ROBOTS, flat_struts, robot_called, thin_legs
from tests.generators.machines import five_bar
from tests.generators.planted_poses import PoseSpace

BACKENDS = [Backend.ARRAYS, *([Backend.MACHINE] if machine_code_is_available() else [])]
#: Their unreachable poses are followed by Newton's method, which takes its time.
OPEN = (
    *("3-puu", "tripteron", "3-rpr-beams"),
    *("3-prs", "3-rps", "capaman", "h4", "t3r1"),
    *("four-bar legs", "nested parallelograms", "pairs of struts"),
)
#: These take some hundredths of a second a pose, far from home at least.
SLOW = ("capaman", "h4")


def compiled_with(robot: rs.Robot, backend: Backend) -> CompiledStiffness:
    return compile_stiffness(robot, backend=backend)


@pytest.mark.parametrize("part", [8, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ALL_ROBOTS)
def test_random_and_special_poses(name: str, part: int):
    robot = robot_called(name)
    space, rng = PoseSpace(robot), np.random.default_rng(11)
    rows = [space.near_home(rng), space.drawn(rng, 40, 0.1)]
    if name not in OPEN:
        rows += [space.drawn(rng, 200, size) for size in (0.6, 1.5)]
        rows.append(space.round_values())
    rows = np.concatenate(rows)[:: 4 * part if name in SLOW else part]
    for backend in BACKENDS:
        compiled = compiled_with(robot, backend)
        assert compiled.verified
        found = agreement(compiled, space, rows)
        assert found.status.size == 0
        assert found.rank.size == 0
        assert found.K.max() <= 1e-9


@pytest.mark.parametrize("backend", BACKENDS)
def test_one_row_of_all_wrenches_vanishes(backend: Backend):
    """Legs nearly parallel hold the platform across them by next to nothing."""
    robot = flat_struts()
    space, rng = PoseSpace(robot), np.random.default_rng(0)
    rows = space.home + 10.0 ** rng.uniform(-8, -3, (4000, 1)) * rng.uniform(-1, 1, (4000, 3))
    found = agreement(compiled_with(robot, backend), space, rows)
    codes = direct_stiffness(robot, rows).status_codes
    assert np.count_nonzero(codes & int(rs.Status.ILL_CONDITIONED)) > 100
    assert found.status.size == found.rank.size == 0
    assert found.K.max() <= 1e-9


@pytest.mark.parametrize("backend", BACKENDS)
def test_poses_out_of_reach_are_reported_at_once(backend: Backend):
    robot = rs.load("3-rrr")
    space, rng = PoseSpace(robot), np.random.default_rng(1)
    rows = space.drawn(rng, 3000, 3.0)
    answer = compiled_with(robot, backend).evaluate(rows)
    lost = answer.status_codes == int(rs.Status.UNREACHABLE)
    assert 500 < np.count_nonzero(lost) < 2900
    assert np.count_nonzero(answer.guarded & lost) < 30
    assert (answer.rank[lost] == -1).all()
    assert np.isnan(answer.values["K"][lost]).all()
    assert np.isfinite(answer.values["K"][~lost]).all()
    assert np.array_equal(answer.status_codes, direct_stiffness(robot, rows).status_codes)


@pytest.mark.parametrize("backend", BACKENDS)
def test_poses_that_are_nearly_singular_are_computed_again(backend: Backend):
    """At home the legs of case A meet in one point: rank 3, though 5 elsewhere."""
    robot = rs.load("gough-stewart-a")
    compiled = compiled_with(robot, backend)
    home = PoseSpace(robot).home
    away = home + np.array([0.01, 0.02, 0, 0.05, 0.03, 0.1])
    near = home + 1e-12 * np.arange(1, 7)
    answer = compiled.evaluate(np.array([home, near, away, away]))
    assert answer.guarded.tolist() == [False, True, False, False]
    assert answer.rank.tolist() == [3, 3, 5, 5]
    assert answer.guarded_share == 0.25


@pytest.mark.parametrize("backend", BACKENDS)
def test_actuators_at_their_limits(backend: Backend):
    robot = robot_called("six-joint-arm")
    compiled = compiled_with(robot, backend)
    space = PoseSpace(robot)
    roles = robot.legs[0].chain.roles
    rows, expected = [], []
    for i, role in enumerate(roles):
        limits = getattr(role, "limits", None)
        if limits is None:
            continue
        for limit, outwards in zip(limits, (-1, 1), strict=True):
            for by in (0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-3, -1e-3):
                q = space.home.copy()
                q[i] = limit + outwards * by
                rows.append(q)
                expected.append(q[i] < limits[0] or q[i] > limits[1])
    assert rows
    answer = compiled.evaluate(space.pose(np.array(rows)))
    assert ((answer.status_codes & int(rs.Status.BEYOND_LIMITS)) != 0).tolist() == expected


def test_a_robot_far_from_generic_is_computed_in_full():
    robot = thin_legs()
    answer = compile_stiffness(robot).evaluate(np.tile(PoseSpace(robot).home, (3, 1)))
    assert answer.guarded.all()


def test_a_planar_robot_takes_the_coordinates_of_its_plane():
    robot = five_bar()
    assert robot.coordinates == ALL_COORDINATES
    answer = compile_stiffness(robot).evaluate(np.array([[0.05, 0.8, 0.1]]))
    expected = direct_stiffness(robot, [0.05, 0.8, 0, 0, 0, 0.1]).K
    assert np.abs(answer.values["K"][0] - expected).max() <= 1e-9 * np.abs(expected).max()


def test_no_poses():
    robot = rs.load("gough-stewart-b")
    answer = compile_stiffness(robot).evaluate(np.empty((0, 6)))
    assert answer.values["K"].shape == (0, 6, 6)
    assert answer.guarded_share == 0.0


def test_coordinates_that_the_legs_decide_are_met_to_the_last_digits():
    """A platform that misses its legs by less than what counts as reached is moved on to them."""
    poses = np.array([[0.60129927, 0.00086437, 0.0006468]])
    posture = rs.find_posture(rs.load("3-rps"), poses)
    assert posture.shift_gaps.max() <= 1e-12
    assert np.abs(posture.pose[0, :2]).max() > 1e-10


#: Heights and tilts of a 3-PRS at which its legs just reach the platform, or miss it by less
#: than what counts as reached.
AT_THE_LIMIT = np.array([
    [0.7803624773843099, 0.03962182293595368, 1.2312985189690662],
    [0.4233512741927026, -0.12900444825018356, 1.2345512695966732],
    [1.263708814323993, 1.0781642697589393, 0.5947329768854863],
    [0.35388371565403764, 1.1112925528303255, 0.5404198881440447],
    [1.2637088143239934, 1.0781642697589398, 0.5947329768854865],
    [0.3909747353271547, 1.0741760743320437, 0.6015042633817488],
    [0.748091148231985, 1.1890457391486466, 0.4245961477131506],
])  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("backend", BACKENDS)
def test_legs_closed_by_iteration_at_their_limit_of_reach(backend: Backend):
    robot = rs.load("3-prs", {"R": 0.5, "l": 0.5})
    space, rng = PoseSpace(robot), np.random.default_rng(4)
    compiled = compiled_with(robot, backend)
    rows = np.concatenate([space.drawn(rng, 40, 0.2), AT_THE_LIMIT])
    for some in (rows, AT_THE_LIMIT, AT_THE_LIMIT[:1]):
        found = agreement(compiled, space, some)
        assert found.status.size == found.rank.size == 0
        assert found.K.max() <= 1e-9
    assert compiled.evaluate(AT_THE_LIMIT[:2]).guarded.all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_poses_computed_again_are_about_a_far_reference_point(backend: Backend):
    wrench = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    robot = rs.load("gough-stewart-b")
    robot = replace(robot, reference_point=np.array([0.0, 0.0, 30.0]))
    compiled = replace(rs.compile(robot, every_output(wrench), backend=backend), verified=False)
    poses = np.array([[0.02, 0, 0.8, 0, 0.1, 0], [0, 0.03, 0.75, 0.05, 0, 0.1]])
    answer = compiled.evaluate(poses)
    assert answer.guarded.all()
    for i, pose in enumerate(poses):
        K = direct_stiffness(robot, pose).K
        C = rs.compliance(robot, pose)
        expected = {
            "K": K,
            "compliance": C,
            "deflection": C @ wrench,
            "principal_stiffness": [*np.linalg.eigvalsh(K[:3, :3]), *np.linalg.eigvalsh(K[3:, 3:])],
            "worst_deflection": np.linalg.eigvalsh(C[:3, :3])[-1],
        }
        for name, value in expected.items():
            found = answer.values[name][i]
            assert np.max(np.abs(found - value)) <= 1e-9 * np.max(np.abs(value)), name


@pytest.mark.parametrize("backend", BACKENDS)
def test_joint_coordinates_that_leave_a_loop_open(backend: Backend):
    """The record follows one bar alone: where the other bar ends elsewhere there is no answer."""
    pins = [rs.revolute([0, 0, 1], rs.Passive(), name=name) for name in ("near pin", "far pin")]
    bar = rs.beam_link([0.4, 0, 0], rs.material("steel"), rs.circle(0.02))
    drives = (rs.revolute([0, 0, 1], rs.Actuated(1e6)), rs.prismatic([0, 1, 0], rs.Actuated(1e6)))
    block = parallelogram(rs.Chain((pins[0], bar, pins[1])), [0, 0.2, 0])
    here, home = (rs.Frame(np.eye(3), np.array([x, 0, 0])) for x in (0.0, 0.4))
    leg = rs.Leg("arm", here, rs.Chain((drives[0], block, drives[1])), here)
    robot = rs.Robot("arm", (leg,), home=home, coordinates=(Coordinate.Y, Coordinate.RZ))
    joints = rs.JointCoordinates(
        [
            [0, 0.1, -0.1, 0.1, -0.1, 0],
            [0, 0.1, -0.1, 0.3, 0.2, 0],
            [0.2, -0.2, 0.2, -0.2, 0.2, 0.1],
        ]
    )
    found, expected = (
        compiled_with(robot, backend).evaluate(joints),
        direct_stiffness(robot, joints),
    )
    assert expected.answered.tolist() == [True, False, True]
    assert found.status_codes.tolist() == expected.status_codes.tolist()
    assert found.rank.tolist() == expected.rank.tolist()


@pytest.mark.parametrize("make", [rs.compile, rs.compile_loaded])
def test_parameters_of_no_robot_have_a_status_beside_those_of_robots(make):
    """Motors 2 m from the axis: rods of 0.25 m do not reach the platform at home."""
    robot = rs.load("3-rrr", symbols=("R", "l2"))
    kernel = make(robot, parameters=("R", "l2"), backend=Backend.ARRAYS)
    load_ = () if make is rs.compile else (np.array([0, -10.0, 0]),)
    poses = np.tile([0.01, 0.0, 0.05], (3, 1))
    answer = kernel.evaluate(poses, *load_, parameters={"R": [0.38, 2.0, 0.4], "l2": 0.25})
    assert [int(code) for code in answer.status_codes] == [0, int(rs.Status.UNREACHABLE), 0]
    own = kernel.evaluate(poses[:1], *load_, parameters={"R": 0.4, "l2": 0.25})
    found, alone = (
        (answer.values["K"], own.values["K"]) if make is rs.compile else (answer.K, own.K)
    )
    assert np.allclose(found[2], alone[0], rtol=1e-12, atol=1e-3)
    if make is rs.compile:
        assert np.isnan(found[1]).all()
        assert answer.rank.tolist() == [3, -1, 3]
