"""Equilibria at many poses: as each by itself, and as maps."""

import json
import pickle
import sys
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.maps.variables import status_words
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


ALL = [
    rs.Quantity.STIFFNESS,
    rs.Quantity.PRINCIPAL_STIFFNESS,
    rs.Quantity.WORST_DEFLECTION,
    rs.Quantity.DEFLECTION,
]
WRENCH = np.array([0, 0, -7.2e7, 1e5, 0, 2e5])


def test_every_pose_has_its_equilibrium_and_its_status():
    robot = rs.load("gough-stewart-b")
    grid = rs.Grid(x=rs.Axis(0, 0, 1), factor=rs.Axis(0, 1.2, 3))
    found = rs.stiffness_map(robot, grid, ALL, wrench=WRENCH, method=rs.UnderLoad())
    home = rs.find_posture(robot).pose[0]
    words = set()
    for x in found.x.values:
        for factor in found.factor.values:
            one = equilibrium(robot, home + x * np.eye(6)[0], factor * WRENCH)
            here = found.sel(x=x, factor=factor)
            words.add(status_words(int(here.status)))
            assert status_words(int(here.status)) == str(one.status)
            if not one.has_answer:
                assert np.isnan(here.K).all()
                assert int(here["rank"]) == -1
                continue
            assert np.allclose(here.K, one.K, rtol=1e-12, atol=1e-9 * np.abs(one.K).max())
            moved = np.concatenate([here.displacement, here.rotation])
            assert np.allclose(moved, one.displacement, rtol=1e-6, atol=1e-12)
            block = np.linalg.eigvalsh(one.K_sym[:3, :3])
            assert np.allclose(here.translational_stiffness, block, rtol=1e-6)
            worst = np.linalg.norm(np.linalg.inv(one.K_total)[:3, :3], 2)
            assert float(here.worst_deflection) == pytest.approx(worst, rel=1e-6)
    assert "ok" in words
    assert any("beyond-critical-load" in own for own in words)
    assert sum(json.loads(found.attrs["statuses"]).values()) == 3


def test_a_kernel_gives_the_same_map_and_recomputes_what_is_near_the_critical_load():
    robot = rs.load("gough-stewart-b")
    random = np.random.default_rng(4)
    rows = np.column_stack([random.uniform(-0.05, 0.05, 6), -7e7 * np.linspace(0.1, 0.95, 6)])
    poses = rs.PoseList(["x", "Fz"], rows)
    by = rs.Compiled(rs.Backend.ARRAYS)
    fast, slow = (
        rs.stiffness_map(robot, poses, ALL, method=rs.UnderLoad(by=own))
        for own in (by, rs.Batched())
    )
    assert 0 < fast.attrs["poses_guarded"] < 6
    assert np.array_equal(fast.status, slow.status)
    for name in ("K", "translational_stiffness", "worst_deflection", "displacement"):
        size = float(np.nanmax(np.abs(slow[name])))
        assert np.allclose(fast[name], slow[name], rtol=2e-6, atol=1e-10 * size, equal_nan=True)


def test_a_kernel_has_the_weights_and_the_preloads_of_a_map():
    arm = rs.load("six-joint-arm")
    joints = [joint.name for joint, _ in arm.legs[0].chain.moving]
    home = np.array(arm.legs[0].chain.home)
    shifts = 0.2 * np.random.default_rng(6).uniform(-1, 1, (3, len(joints)))
    poses = rs.PoseList([*joints, "factor"], np.column_stack([home + shifts, [0.0, 0.5, 1.0]]))
    loads, preload = {"platform": rs.Mass(6.0, [0.3, 0.2, 0.9])}, {"arm/joint2": 25.0}
    wrench = np.array([40.0, 0, -100, 0, 3, 0])
    fast, slow = (
        rs.stiffness_map(
            arm, poses, ALL, wrench=wrench, method=rs.UnderLoad(loads, "-z", preload, by=own)
        )
        for own in (rs.Compiled(rs.Backend.ARRAYS), rs.Batched())
    )
    assert fast.attrs["poses_guarded"] == 0
    assert "compiled" in fast.attrs["method"]
    for name in ("K", "translational_stiffness", "worst_deflection", "displacement"):
        size = float(np.abs(slow[name]).max())
        assert np.allclose(fast[name], slow[name], rtol=2e-6, atol=1e-10 * size)
    q = rs.JointCoordinates((home + shifts)[1])
    one = equilibrium(arm, q, 0.5 * wrench, loads=loads, gravity="-z", preload=preload)
    assert np.allclose(slow.displacement[1], one.displacement[:3], rtol=1e-6, atol=1e-15)
