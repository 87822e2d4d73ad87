"""Large batches of equilibria: by a record of the robot, and as each one by itself."""

import pickle
import sys
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from tests.statics.robots_under_load import same_as_each

COUNT = 1000
ROWS = (0, 1, 17, 998, 999)
equilibrium: Any = rs.equilibrium


def check(many: rs.Equilibrium, alone: list[rs.Equilibrium]) -> None:
    same_as_each(many[list(ROWS)], alone, 1e-12, atol=1e-15)
    for k, one in zip(ROWS, alone, strict=True):
        assert not one.has_answer or np.allclose(many.pose[k], one.pose, rtol=0, atol=1e-12)


def test_many_poses_are_as_each_by_itself():
    """One of them beyond its critical load, and one out of reach."""
    robot, given = rs.load("gough-stewart-b"), {"loads": {"platform": rs.Mass(2e3)}}
    random = np.random.default_rng(4)
    poses = rs.find_posture(robot).pose[0] + 0.02 * random.uniform(-1, 1, (COUNT, 6))
    wrenches = 1e5 * random.uniform(-1, 1, (COUNT, 6))
    wrenches[1], poses[17, 2] = [0, 0, -9e7, 0, 0, 0], 30.0
    many = equilibrium(robot, poses, wrenches, **given)
    assert many.known  # by the record
    check(many, [equilibrium(robot, poses[k], wrenches[k], **given) for k in ROWS])
    assert many[1].critical_factor < 1
    assert not many.answered[17]
    with pytest.raises(rs.NoAnswerError, match="no equilibrium"):
        _ = many[17].pose
    assert len(many[:3]) == 3


@pytest.mark.parametrize("name", ["two-link-arm", "3-puu"])
def test_many_wrenches_at_one_pose_are_as_each_by_itself(name: str):
    robot = rs.load(name)
    wrenches = np.linspace(-1, 1, COUNT)[:, None] * np.array([30.0, -20.0, 1.0, 0, 0, 0])
    wrenches = wrenches[:, : robot.space.size]
    many = equilibrium(robot, None, wrenches)
    assert many.known
    check(many, [equilibrium(robot, None, wrenches[k]) for k in ROWS])


def test_no_pose_is_an_empty_batch(monkeypatch: pytest.MonkeyPatch):
    robot, none = rs.load("3-rpr"), np.empty((0, 3))
    for known in (False, True):
        found = equilibrium(robot, none, [1, 0, 0]), equilibrium(robot, None, none)
        assert [(one.K.shape, one.margin.shape) for one in found] == [((0, 3, 3), (0,))] * 2
        assert bool(found[1].known) is known
        monkeypatch.setattr(sys.modules["robostiff.statics.equilibrium"], "WORTH_COMPILING", 0)
    assert repr(rs.modes(robot, none, masses={"platform": rs.Mass(1.0)})).count(" 0 ") == 2
    assert rs.compensate(robot, none, [1, 0, 0]).commanded.shape == (0, 6)


@pytest.mark.parametrize(
    ("name", "kinds", "rows"),
    [
        ("3-puu", [np.asarray], [[0, 0, 0.6, 0.3, 0, 0], [0.01, 0, 0.6, 0, 0, 0]]),
        ("two-link-arm", [rs.ActuatorCoordinates], [[0.3, 0.4], [0.2, 0.5]]),
        ("six-joint-arm", [np.asarray], [[1.8, 0, 0.6, 0.3, 0, 0], [0.5, 0.1, 0.6, 0.3, 0, 0]]),
        (
            "gough-stewart-b",
            [
                lambda p: rs.ActuatorCoordinates(np.tile(p, 2)),
                lambda p: rs.ToolPose(np.multiply(p, [0, 0, 1]), [0, 0, 1]),
            ],
            [[0.8, 0.8, 0.8], [0.8, 0.81, 0.8]],
        ),
    ],
)
def test_a_record_answers_poses_of_every_kind_and_none_out_of_reach(
    name: str, kinds: list[Any], rows: list[list[float]], monkeypatch: pytest.MonkeyPatch
):
    robot, other = rs.load(name), rs.load(name)
    wrench = [0.0, -100.0, *[0.0] * (robot.space.size - 2)]
    each = [[equilibrium(other, kind(row), wrench) for row in rows] for kind in kinds]
    monkeypatch.setattr(sys.modules["robostiff.statics.equilibrium"], "WORTH_COMPILING", 1)
    for kind, alone in zip(kinds, each, strict=True):
        found = equilibrium(robot, kind(rows[0]), wrench), *equilibrium(robot, kind(rows), wrench)
        for one, direct in zip(found, (alone[0], *alone), strict=True):
            assert (one.status, one.has_answer) == (direct.status, direct.has_answer)
            if one.has_answer:
                for name in ("displacement", "pose"):
                    known, wanted = getattr(one, name), getattr(direct, name)
                    np.testing.assert_allclose(known, wanted, rtol=1e-7, atol=1e-12)


def test_laws_of_force_are_computed_one_by_one(monkeypatch: pytest.MonkeyPatch):
    for count in ("WORTH_COMPILING", "WORTH_READING"):
        monkeypatch.setattr(sys.modules["robostiff.statics.equilibrium"], count, 5)
    robot = rs.load("two-link-arm")
    drive = equilibrium(robot).parts[0]
    law = rs.ForceLaw([[-1, -1e4], [0, 0], [1, 2e4]])
    many = equilibrium(robot, None, np.zeros((5, 6)), laws={f"{drive.leg}/{drive.part}": law})
    assert not many.known
    assert many.stable.all()


@pytest.mark.parametrize("name", ["hexapod", "cable-4-planar"])
def test_a_robot_is_sent_without_its_last_posture(name: str):
    robot = rs.load(name)
    answer = equilibrium(robot, wrench=[100.0] + [0.0] * (robot.space.size - 1))
    sent = pickle.dumps(robot)
    again = pickle.loads(sent)  # noqa: S301
    assert any(own.startswith("_last") for own in vars(robot))
    assert not any(own.startswith("_") for own in vars(again))
    assert len(sent) < 1.5 * len(pickle.dumps(rs.load(name)))
    other = equilibrium(again, wrench=answer.wrench)
    np.testing.assert_array_equal(other.displacement, answer.displacement)
