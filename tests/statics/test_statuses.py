"""Outcomes that are no plain answer."""

from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.model import PlacedLeg, Snapshot
from robostiff.spatial import Space
from robostiff.statics.equations import equilibrium_path
from tests.statics.robots_under_load import column, joint, loaded

PAGE = (Path(__file__).parents[2] / "docs/under-load.md").read_text()


OF_OTHERS = rs.Status.FORM_DOES_NOT_HOLD | rs.Status.UNBALANCED
OF_CABLES = rs.Status.UNTENSIONED | rs.Status.INFEASIBLE | rs.Status.SLACK


@pytest.mark.parametrize("status", [s for s in rs.Status if not s & (OF_OTHERS | OF_CABLES)])
def test_every_status_has_advice_and_is_on_the_page(status: rs.Status):
    assert len(status.advice) == 1
    bad = "yes" if status.is_bad else "no"
    assert f"| `{status.name}` | {bad} |" in PAGE


def test_a_load_on_a_free_motion_finds_no_rest():
    """A moment turns a hinge that nothing holds."""
    answer = loaded(rs.load("planar-link"), wrench=[0, 0, 5])
    assert str(answer.status) == "free-motions+no-equilibrium"
    assert not answer.stable
    with pytest.raises(rs.NoAnswerError, match="no equilibrium was found"):
        _ = answer.displacement


def test_a_platform_that_nothing_can_move_is_rigid():
    tip = np.array([0.5, 0, 0])
    elements = (joint("hinge", [0, 0, 0], [0, 0, 1], "R", 50.0),)
    robot = Snapshot("lever", (PlacedLeg("lever", elements, tip),), tip, Space.PLANAR)
    answer = loaded(robot, wrench=[0, -1, 0])
    assert str(answer.status) == "rigid-direction"
    found = rs.critical_load(robot, wrench=[0, -1, 0], up_to=5.0)
    assert not found.is_found
    with pytest.raises(rs.NoAnswerError, match="infinite"):
        _ = found.factor


def test_pull_has_no_critical_load():
    found = rs.critical_load(column(40.0, 1e7, 0.3, 1e7), wrench=[0, 1, 0], up_to=500.0)
    assert not found.is_found
    assert found.status == 0
    assert found.searched_to == 500.0


def test_a_search_that_ends_early_says_how_far_it_came(monkeypatch):
    robot, load = rs.load("3-rpr"), [-100.0, 0.0, 0.0]
    whole = rs.critical_load(robot, wrench=load)
    assert (whole.is_found, whole.searched_to, whole.status.is_bad) == (False, 1000.0, False)
    assert rs.equilibrium(robot, wrench=[1000 * x for x in load]).stable
    monkeypatch.setattr(equilibrium_path, "_LONGEST", 20)
    found = rs.critical_load(robot, wrench=load)
    assert not found.is_found
    assert rs.Status.NO_EQUILIBRIUM in found.status
    assert 1 < found.searched_to < 1000
    nearer = rs.critical_load(robot, wrench=load, up_to=1)
    assert (nearer.is_found, nearer.searched_to, nearer.status.is_bad) == (False, 1.0, False)


def test_joints_that_are_redundant_without_load_alone():
    """A body between two hinges on one axis hangs below it under any weight."""
    z, tip = [0, 0, 1], np.array([1.0, 0, 0])
    idle = (
        joint("a", [0, 0, 0], z),
        joint("b", [0, 0, 0], z),
        joint("strut", [0, 0, 0], [1, 0, 0], "P", 1e6),
        joint("end", tip, z),
    )
    held = (
        joint("x", tip, [1, 0, 0], "P", 1e5),
        joint("y", tip, [0, 1, 0], "P", 1e5),
        joint("turn", tip, z, "R", 1e3),
    )
    legs = (PlacedLeg("idle", idle, tip), PlacedLeg("held", held, tip))
    robot = Snapshot("robot", legs, tip, Space.PLANAR)
    weight = rs.DeadForce([0, -5.0, 0], [0.1, -0.1, 0])
    answer = loaded(robot, loads={"idle/a": weight})
    assert str(answer.status) == "redundant-joints"
    turned = next(float(part.motion[0]) for part in answer.parts if part.part == "a")
    assert np.isclose(turned, -np.pi / 4)
    assert np.allclose(answer.displacement, 0, atol=1e-12)
    assert str(loaded(robot, wrench=[5.0, 2, 1]).status) == "redundant-joints"
