"""Many poses and one: the record of a robot and the direct form say the same, and no more."""

from __future__ import annotations

import pickle
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis import Deflection, compiled_stiffness, posed_stiffness, questions
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.compiled import MachineCode
from robostiff.elastostatics import CartesianStiffness
from robostiff.kinematics import posture_finder
from tests.analysis.kernels.cases import row
from tests.generators.elements import ROD, STEEL, shift_by
from tests.generators.kernel_robots import thin_legs

# Closed forms, closure by iteration, a block in a leg, free motions, a plane, arms by joints.
ROBOTS = ["hexapod", "3-puu", "3-rps", "delta", "gough-stewart-a", "3-rpr", "six-joint-arm"]
COUNT = 40


@pytest.fixture
def recorded_at_once(monkeypatch):
    monkeypatch.setattr(questions.PosesOfRobot, "pays", (250, 0, 2**20))


@pytest.fixture
def asked_of_direct_form(monkeypatch) -> list[int]:
    """How many poses the direct form was asked for, call by call."""
    counts = []
    solve = questions.PosesOfRobot.direct_answer

    def counted(self: Any, rows: np.ndarray) -> Any:
        counts.append(rows.size)
        return solve(self, rows)

    monkeypatch.setattr(questions.PosesOfRobot, "direct_answer", counted)
    return counts


def posed(robot: rs.Robot, count: int, spread: float, seed: int = 3) -> Any:
    """Poses around home, some of them very near to it and some out of reach."""
    random = np.random.default_rng(seed)
    near = np.where(np.arange(count) % 5 == 0, 1e-5, 1.0)[:, None]
    if robot.is_posed_by_joints:
        home = robot.legs[0].chain.home
        return rs.JointCoordinates(home + near * random.uniform(-1, 1, (count, home.size)))
    finder, places = posture_finder(robot), robot.coordinate_places
    size = np.where(np.array(places) < 3, finder.length, 1.5)
    shift = near * spread * size * random.uniform(-1, 1, (count, len(places)))
    return finder.home_pose[places] + shift


def assert_same(one: Any, other: Any) -> None:
    """Equal, numbers within rounding of the largest of them."""
    if isinstance(one, CartesianStiffness):
        assert_same(one.matrix[one.answered], other.matrix[other.answered])
        assert_same(one.status_codes, other.status_codes)
    elif isinstance(one, tuple):
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            assert_same(a, b)
    elif isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            assert_same(one[key], other[key])
    elif isinstance(one, np.ndarray) and one.dtype.kind == "f":
        size = np.max(np.abs(other), initial=1e-9)
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * size)
    elif isinstance(one, np.ndarray):
        np.testing.assert_array_equal(one, other)
    else:
        # What rounding leaves of a dropped value differs between arrays of two lengths.
        one, other = (
            re.sub(r"(?<=largest dropped )\S+e-1[5-9]", "0", str(x)) for x in (one, other)
        )
        assert one == other


@pytest.mark.parametrize("name", [*ROBOTS, "h4"])
@pytest.mark.parametrize("spread", [0.05, 0.6])
def test_both_ways_say_the_same(name, spread, recorded_at_once):
    """Also near singular poses, out of reach and beyond limits; and one pose as a row of many."""
    robot: Any = rs.load(name)
    pose = posed(robot, COUNT, spread)
    found, expected = rs.stiffness(robot, pose), direct_stiffness(robot, pose)
    assert "_kept robostiff.analysis.posed_stiffness.record_of" in vars(robot)
    for part in ("status_codes", "rank", "answered"):
        np.testing.assert_array_equal(getattr(found, part), getattr(expected, part))
    known = found.answered
    assert known.any()
    assert_same(found[known].K, expected[known].K)
    for i in range(0, COUNT, 3):
        one = rs.stiffness(robot, row(pose, i))
        for alone in (one, *([] if i % 7 else [direct_stiffness(robot, row(pose, i))])):
            assert (alone.status, int(alone.rank)) == (found[i].status, int(found[i].rank))
            assert alone.advice == found[i].advice
        if one.status.has_stiffness:
            for part in ("K", "reference_point", "pose"):
                assert_same(getattr(one, part), getattr(found[i], part))
    check_questions(robot, pose)


def check_questions(robot: Any, pose: Any) -> None:
    """Compliance, deflection and indices by the record are those of the direct form."""
    n, d, at = robot.space.size, robot.space.translations, np.full(3, 0.1)
    at = at * [1, 1, n == 6]
    expected = direct_stiffness(robot, pose, at)
    C = np.ma.asarray(rs.compliance(robot, pose, at=at))
    np.testing.assert_array_equal(~np.ma.getmaskarray(C)[..., 0, 0], expected.has_compliance)
    for i in np.flatnonzero(expected.has_compliance):
        assert_same(C.data[i], expected[i].compliance)
    F = 100 * np.random.default_rng(1).uniform(-1, 1, (COUNT, n))
    bent, alone = rs.deflection(robot, pose, F, at=at), Deflection(F, expected)
    np.testing.assert_array_equal(bent.status_codes, alone.status_codes)
    np.testing.assert_array_equal(bent.answered, alone.answered)
    for i in np.flatnonzero(bent.answered):
        assert_same(bent.twist.data[i], alone.twist.data[i])
        assert np.isclose(bent.energy[i], alone.energy[i], rtol=1e-9, atol=0)
    found, by_one = rs.indices(robot, pose, at=at, length=0.3), rs.indices(expected, length=0.3)
    every = [
        (found.principal_stiffness[..., :d], lambda one: one.principal.translational),
        (found.principal_stiffness[..., d:], lambda one: one.principal.rotational),
        (found.collinear_stiffness[..., :d], lambda one: one.collinear.translational),
        (found.collinear_stiffness[..., d:], lambda one: one.collinear.rotational),
        (found.worst_deflection, lambda one: one.worst_deflection.translational),
        (found.anisotropy[..., 0], lambda one: one.anisotropy.translational),
        (found.anisotropy[..., 1], lambda one: one.anisotropy.rotational),
        (found.condition_number, lambda one: one.condition.two_norm),
    ]
    for i in range(0, COUNT, 3):
        for values, index in every:
            value = index(by_one[i]) if expected.answered[i] else None
            assert np.ma.getmaskarray(values)[i].all() == (value is None)
            if value is not None:
                np.testing.assert_allclose(values[i], value, rtol=1e-8)


def test_one_pose_by_the_record_is_read_as_any_other(recorded_at_once):
    robot: Any = rs.load("hexapod")
    pose = [0, 0, 1, 0, 0, 0]
    K = rs.stiffness(robot, pose).K
    assert np.array_equal(rs.stiffness(robot, pose, at=[0, 0, 1.2]).about([0, 0, 1]).matrix, K)
    assert rs.stiffness(robot, np.array(pose)).K.tolist() == K.tolist()
    for wrong in ([0, 0, np.nan, 0, 0, 0], [0, 0, "1", 0, 0, 0], pose[1:]):
        with pytest.raises(rs.InputError, match="pose of 'hexapod'"):
            rs.stiffness(robot, wrong)
    with pytest.warns(rs.PlausibilityWarning, match="in mm"):
        rs.stiffness(robot, [0, 0, 900, 0, 0, 0])
    with pytest.warns(rs.PlausibilityWarning, match="in degrees"):
        rs.stiffness(robot, [0, 0, 0.9, 0, 0, 30])


OTHER_PARTS = (
    *("pose", "reference_point", "origin", "length", "joint_coordinates", "has_compliance"),
    *("compliance", "redundant_joints", "leg_stiffness", "space"),
)


@pytest.mark.parametrize("name", ROBOTS)
def test_what_else_a_result_holds_is_that_of_the_direct_form(name, recorded_at_once):
    robot: Any = rs.load(name)
    pose = posed(robot, 6, 0.05)
    some = rs.stiffness(robot, pose)[1:5]
    for found, expected in (
        (some, direct_stiffness(robot, pose)[1:5]),
        (some[2], direct_stiffness(robot, row(pose, 3))),
        (rs.stiffness(robot, row(pose, 2)), direct_stiffness(robot, row(pose, 2))),
    ):
        one, other = found.details(), expected.details()
        assert_same(one, other)
        for a, b, parts in (
            (found, expected, OTHER_PARTS),
            (one, other, ("legs", "passive_joint_names")),
        ):
            for part in parts:
                assert_same(getattr(a, part), getattr(b, part))
    for part in ("free_motions", "rigid_directions", "decision"):
        one, other = some[0], direct_stiffness(robot, row(pose, 1))
        assert_same(getattr(one, part), getattr(other, part))
    with pytest.raises(AttributeError, match="stiffnesses"):
        _ = some.stiffnesses


def test_questions_of_regular_poses_need_no_direct_form(recorded_at_once, asked_of_direct_form):
    robot: Any = rs.load("hexapod")
    poses = posed(robot, 200, 0.05)
    rs.stiffness(robot, poses)
    asked_of_direct_form.clear()
    bent, found = rs.deflection(robot, poses, np.arange(6.0)), rs.indices(robot, poses, length=0.3)
    _ = rs.compliance(robot, poses), bent.twist, bent.energy, bent.status_codes
    _ = found.principal_stiffness, found.anisotropy, found.condition_number
    assert asked_of_direct_form == []
    assert len(bent[3].parts) > 0  # how parts share is found by the direct form
    assert asked_of_direct_form == [1]


def test_a_part_is_worked_out_at_the_poses_of_which_it_is_asked(
    recorded_at_once, asked_of_direct_form
):
    robot: Any = rs.load("hexapod")
    found = rs.stiffness(robot, posed(robot, 500, 0.05))
    asked_of_direct_form.clear()
    _ = found.K, found.rank, found.status, found.status_codes, found.answered, found.advice
    _ = found.pose, found.reference_point, found.batch_shape, repr(found), found[3:9].K
    assert asked_of_direct_form == []
    assert len(found[7].details().legs) == 6
    assert asked_of_direct_form == [1]
    assert len(found[10:30].leg_stiffness) == 6
    assert asked_of_direct_form == [1, 20]
    for i in range(100, 164):  # one by one they are worked out in blocks
        assert found[i].details().matrix.shape == (6, 6)
    assert asked_of_direct_form[2:] == [64, 64]
    _ = found.details(), found[3].details(), found[50:70].details()
    assert asked_of_direct_form[4:] == [500]


def test_the_record_waits_until_it_pays(asked_of_direct_form):
    robot: Any = rs.load("3-rpr")
    poses = posed(robot, 10_000, 0.05)
    for _ in range(3):
        rs.stiffness(robot, poses[0])
    rs.stiffness(robot, poses[:500])
    assert asked_of_direct_form == [1, 1, 1, 500]
    rs.stiffness(robot, poses)
    asked_of_direct_form.clear()
    one, few = rs.stiffness(robot, poses[0]), rs.stiffness(robot, poses[:30])
    assert asked_of_direct_form == []
    assert_same(one.K, few.K[0])


def test_a_record_on_disk_answers_the_first_call(asked_of_direct_form, monkeypatch, tmp_path):
    monkeypatch.setenv("ROBOSTIFF_CACHE", str(tmp_path / "records"))
    robot: Any = rs.load("3-rpr")
    poses = posed(robot, 6, 0.05)
    rs.compile(robot, backend=rs.Backend.ARRAYS)  # puts it there
    again: Any = rs.load("3-rpr")
    asked_of_direct_form.clear()
    found = rs.stiffness(again, poses[1])
    assert asked_of_direct_form == []
    assert_same(found.K, direct_stiffness(robot, poses[1]).K)
    monkeypatch.setenv("ROBOSTIFF_CACHE", "off")
    asked_of_direct_form.clear()
    _ = rs.stiffness(rs.load("3-rpr"), poses[1])
    assert asked_of_direct_form == [1]


@pytest.mark.parametrize(
    "options",
    [
        {"method": rs.Recursive()},
        {"tolerance": rs.Tolerance(independence=1e-8)},
        {"near": [[0.01, 0.3, 0.0]] * 3},
    ],
)
def test_other_questions_take_the_direct_form(options, recorded_at_once, asked_of_direct_form):
    robot: Any = rs.load("3-rpr")
    rs.stiffness(robot, posed(robot, 4, 0.05), **options)
    assert asked_of_direct_form == [4]


def test_poses_in_other_ways(recorded_at_once, asked_of_direct_form):
    robot: Any = rs.load("3-puu")
    home = rs.stiffness(robot)
    asked_of_direct_form.clear()
    assert_same(home.K, rs.stiffness(robot).K)
    assert asked_of_direct_form == []
    # All six coordinates fix what the legs would decide.
    six = rs.stiffness(robot, [0.01, 0, 0.3, 0, 0, 0.1])
    assert asked_of_direct_form == [1]
    assert six.status is rs.Status.UNREACHABLE
    planar: Any = rs.load("3-rpr")
    pose = posed(planar, 5, 0.05)
    six_of_plane = np.zeros((5, 6))
    six_of_plane[:, [0, 1, 5]] = pose
    assert_same(rs.stiffness(planar, six_of_plane).K, direct_stiffness(planar, pose).K)


def test_a_point_and_a_shape_of_the_batch(recorded_at_once):
    robot: Any = rs.load("hexapod")
    poses = posed(robot, 6, 0.05).reshape(2, 3, 6)
    point = np.arange(18.0).reshape(2, 3, 3) / 20
    found = rs.stiffness(robot, poses, at=point)
    expected = direct_stiffness(robot, poses).about(point)
    for one, other in ((found, expected), (found[1], expected[1]), (found[1, 2], expected[1, 2])):
        assert one.batch_shape == other.batch_shape
        assert_same(one.K, other.K)
        assert_same(one.reference_point, other.reference_point)
        assert_same(one.compliance, other.compliance)
    again = pickle.loads(pickle.dumps(found))  # noqa: S301
    assert_same(again.K, found.K)
    assert_same(again.details().legs, found.details().legs)


def test_of_no_pose_there_is_an_empty_batch_of_each_answer(recorded_at_once):
    robot, none = rs.load("hexapod"), np.empty((0, 6))
    for ask in (rs.stiffness, direct_stiffness):
        found = ask(robot, none)
        assert found.K.shape == found.required_compliance().shape == (0, 6, 6)
        assert found.batch_shape == (0,)
    assert rs.deflection(robot, none, np.ones(6)).twist.shape == (0, 6)
    assert rs.indices(robot, none).condition_number.shape == (0,)


@pytest.mark.needs("llvmlite")
def test_machine_code_takes_over_where_it_pays(recorded_at_once, monkeypatch):
    monkeypatch.setattr(questions.PosesOfRobot, "pays", (250, 0, 150))
    robot: Any = rs.load("3-rpr")
    poses = posed(robot, 100, 0.05)
    first, second = rs.stiffness(robot, poses), rs.stiffness(robot, poses)
    kept = posed_stiffness.record_of(robot)
    assert isinstance(kept.by_machine_code.kernel.code, MachineCode)
    assert kept.for_poses(1, questions.PosesOfRobot.pays) is kept.compiled  # of one pose
    np.testing.assert_array_equal(first.status_codes, second.status_codes)
    assert_same(second.K, first.K)


def test_a_wrong_record_is_an_error(recorded_at_once, monkeypatch):
    """Also where it goes wrong after it was compared at generic poses."""
    robot: Any = rs.load("gough-stewart-b")
    poses = posed(robot, 5, 0.05)
    evaluate = compiled_stiffness.CompiledStiffness.evaluate

    def wrong(self: Any, pose: Any, **options: Any) -> Any:
        answer = evaluate(self, pose, **options)
        answer.values["K"][2] *= 1 + 1e-6
        return answer

    monkeypatch.setattr(compiled_stiffness.CompiledStiffness, "evaluate", wrong)
    found = rs.stiffness(robot, poses)
    assert found[1].details().legs
    with pytest.raises(rs.DisagreementError, match=r"by 1\.0e-06 for 'gough-stewart-b' at"):
        found[2].details()

    def other_status(self: Any, pose: Any, **options: Any) -> Any:
        answer = evaluate(self, pose, **options)
        codes = answer.status_codes | np.uint16(rs.Status.REDUNDANT_JOINTS)
        return replace(answer, status_codes=codes)

    monkeypatch.setattr(compiled_stiffness.CompiledStiffness, "evaluate", other_status)
    with pytest.raises(rs.DisagreementError, match="on the status, redundant-joints and ok"):
        rs.stiffness(robot, poses).details()


def test_a_robot_without_a_trusted_record_keeps_the_direct_form(
    recorded_at_once, asked_of_direct_form
):
    robot = thin_legs()
    rs.stiffness(robot)
    asked_of_direct_form.clear()
    found = rs.stiffness(robot)
    assert asked_of_direct_form == [1]
    assert found.status == direct_stiffness(robot).status


def test_a_leg_that_transmits_nothing_has_a_record(recorded_at_once):
    """Six passive freedoms leave no wrench: K is zero, of rank 0, by the record as well."""
    freedoms = (
        rs.universal([0, 1, 0], [0, 0, 1], rs.Passive(), name="u"),
        rs.prismatic([1, 0, 0], rs.Passive(), name="p"),
        rs.beam_link([0.4, 0, 0], STEEL, ROD),
        rs.spherical(rs.Passive(), name="s"),
    )
    leg = rs.Leg("leg", rs.Frame.identity(), rs.Chain(freedoms), rs.Frame.identity())
    robot = rs.Robot("loose", (leg,), home=shift_by(0.4, 0, 0))
    poses = np.array([[0.4, 0, 0, 0, 0, 0], [0.45, 0.02, 0.03, 0.1, 0, 0.2]])
    assert rs.compile(robot, backend=rs.Backend.ARRAYS).evaluate(poses).rank.tolist() == [0, 0]
    found = rs.stiffness(robot, poses)
    assert not found.K.any()
    assert not found.details().matrix.any()  # the direct form, which must agree


def test_a_structure_is_answered_by_its_record_where_it_stands(
    recorded_at_once, asked_of_direct_form
):
    beam = rs.beam_link([0, 0.1, 0.5], STEEL, ROD)
    feet = [shift_by(x, 0, 0) for x in (0, 1)]
    legs = tuple(rs.Leg(f"leaf {i}", foot, rs.Chain((beam,)), foot) for i, foot in enumerate(feet))
    robot = rs.Robot("stage", legs, home=shift_by(0, 0.1, 0.5), coordinates=())
    direct = direct_stiffness(robot)
    rs.stiffness(robot)
    asked_of_direct_form.clear()
    K = rs.stiffness(robot).K
    assert not asked_of_direct_form
    assert np.abs(K - direct.K).max() < 1e-10 * K.max()
    assert rs.stiffness(robot, [0, 0.1, 0.6, 0, 0, 0]).status == rs.Status.UNREACHABLE
