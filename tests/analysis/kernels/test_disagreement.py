"""A record that differs from the wrench basis form is an error, wherever the record is used."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.analysis.questions import differences
from robostiff.cli.main import app
from robostiff.elastostatics import Details
from robostiff.errors import DisagreementError
from robostiff.recorded import RecordedRobot
from robostiff.recorded import robot as recorded_robot
from tests.generators.kernel_robots import thin_legs

ARRAYS = rs.Backend.ARRAYS


def wrong_entry(recorded: RecordedRobot) -> RecordedRobot:
    """One entry of K off by a millionth."""
    K = dict(recorded.K)
    place = next(iter(K))
    K[place] = K[place] * (1 + 1e-6)
    return replace(recorded, K=K)


def redundant_joint(recorded: RecordedRobot) -> RecordedRobot:
    """A joint that counts as redundant, and is not."""
    leg = recorded.legs[0]
    leg = replace(leg, redundant=(True, *leg.redundant[1:]))
    return replace(recorded, legs=(leg, *recorded.legs[1:]))


@pytest.fixture(params=["gough-stewart-b", "3-rps"])
def plant(request, monkeypatch) -> Callable[[Callable[[RecordedRobot], RecordedRobot]], str]:
    """Makes every record wrong in some way; returns a robot, closed in closed form or by steps."""

    def planted(wrong: Callable[[RecordedRobot], RecordedRobot]) -> str:
        right = recorded_robot.robot_stiffness
        monkeypatch.setattr(recorded_robot, "robot_stiffness", lambda *given: wrong(right(*given)))
        return request.param

    return planted


def test_compile_says_by_how_much_and_where(plant):
    name = plant(wrong_entry)
    with pytest.raises(DisagreementError) as caught:
        rs.compile(rs.load(name), backend=ARRAYS)
    assert 1e-7 < float(caught.value.distance) < 1e-5
    assert caught.value.where.startswith(f"'{name}' at [")
    assert "please report it" in str(caught.value)


def test_a_wrong_status_is_a_disagreement(plant):
    name = plant(redundant_joint)
    with pytest.raises(DisagreementError, match="on the status, redundant-joints and ok"):
        rs.compile(rs.load(name), backend=ARRAYS)


def test_parameters_are_named(monkeypatch):
    right = recorded_robot.robot_stiffness
    monkeypatch.setattr(recorded_robot, "robot_stiffness", lambda *a: wrong_entry(right(*a)))
    with pytest.raises(DisagreementError, match=r"\], R = 0\.\d+;"):
        rs.compile(rs.load("gough-stewart-b", symbols=("R",)), parameters=("R",), backend=ARRAYS)


def test_a_map_by_a_kernel_is_not_made_by_another_way(plant):
    name = plant(wrong_entry)
    robot = rs.load(name)
    coordinates = [c.value for c in robot.coordinates]
    poses = rs.RandomPoses(4, {coordinates[0]: (0.5, 0.51)})
    with pytest.raises(DisagreementError):
        rs.stiffness_map(robot, poses, method=rs.Compiled(ARRAYS))


def test_the_command_says_so(monkeypatch, tmp_path):
    """Of so many poses that a map chooses the kernel by itself."""
    right = recorded_robot.robot_stiffness
    monkeypatch.setattr(recorded_robot, "robot_stiffness", lambda *a: wrong_entry(right(*a)))
    where = str(tmp_path / "map.nc")
    axes = ("--x", "-10 mm, 10 mm, 250", "--y", "-10 mm, 10 mm, 200")
    outcome = CliRunner().invoke(app, ["map", "gough-stewart-b", *axes, "-o", where])
    assert outcome.exit_code == 1
    assert "one is wrong" in outcome.stderr
    assert "Traceback" not in outcome.stderr


def test_a_report_is_not_written_without_its_formula(monkeypatch, tmp_path):
    def disagreeing(*_, **__):
        raise DisagreementError("the formula and the wrench basis form", 0.1, "home")

    monkeypatch.setattr("robostiff.analytic.derive_robot", disagreeing)
    with pytest.raises(DisagreementError):
        rs.write_report(rs.load("gough-stewart-b", symbols=("R",)), tmp_path / "report.html")


def test_very_soft_legs_are_no_disagreement():
    """Wires bend ten million times as easily as they stretch: both ways keep their digits."""
    compiled, pose = rs.compile(thin_legs(), backend=ARRAYS), np.array([[0, 0, 0.6, 0, 0, 0.1]])
    assert compiled.verified
    K = rs.stiffness(thin_legs(), pose).K
    found = compiled.evaluate(pose)
    assert np.abs(found.values["K"] - K).max() <= 1e-9 * np.abs(K).max()
    assert found.status_codes[0] == 0


def test_differences_are_found_pose_by_pose_also_without_any_stiffness():
    robot = rs.load("gough-stewart-b")
    home = rs.find_posture(robot).pose
    careful = direct_stiffness(robot, np.tile(home, (3, 1)))
    direct = careful.details()
    K, none = careful.matrix, np.zeros(3, dtype=bool)

    def answer(K: np.ndarray, rank: np.ndarray = careful.rank) -> rs.CompiledAnswer:
        return rs.CompiledAnswer({"K": K}, careful.status_codes, rank, none)

    def compared(one: Details, other: rs.CompiledAnswer) -> list[tuple[int, float | str]]:
        return differences(one, other.status_codes, other.rank, other.matrix, free=1e-6)

    assert compared(direct, answer(K)) == []
    wrong = K.copy()
    wrong[0, 0, 0] *= 1 + 1e-8
    wrong[2, 4, 4] *= 1 + 1e-6
    found = compared(direct, answer(wrong, careful.rank - [0, 1, 0]))
    assert [pose for pose, _ in found] == [1, 2, 0]
    assert found[0][1] == "on the rank, 5 and 6,"
    assert [found[1][1], found[2][1]] == pytest.approx([1e-6, 1e-8], rel=1e-6)
    nothing = replace(direct, matrix=0 * K)
    assert compared(nothing, answer(0 * K)) == []
    found = compared(nothing, answer(wrong))
    assert [pose for pose, _ in found] == [0, 1, 2]
