"""Outcomes under load that are no plain answer, and motions that no stiffness meets."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.elastostatics import Status
from robostiff.model import ForceLaw, PlacedLeg, Snapshot
from robostiff.spatial import Space
from robostiff.statics import equilibrium
from robostiff.statics.equations import equilibrium_path
from tests.statics.robots_under_load import column, joint, loaded


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


@pytest.mark.parametrize("name", ["gough-stewart-a", "gough-stewart-a-beams"])
@pytest.mark.parametrize("along", [0, 1, 3, 4])
def test_a_load_at_a_singular_home_comes_to_rest_in_few_steps(name, along):
    """In balance: the work of the load on a small motion is the change of the energy."""
    robot = rs.load(name)
    wrench = np.zeros(6)
    wrench[along] = 100.0
    found = equilibrium(robot, wrench=wrench)
    assert found.status is Status.OK
    assert found.found is not None
    assert found.found.steps <= 10
    if along < 3:
        more, less = (equilibrium(robot, wrench=s * wrench) for s in (1.001, 0.999))
        work = wrench @ (more.displacement - less.displacement)
        assert more.energy - less.energy == pytest.approx(work, rel=1e-4)


@pytest.mark.parametrize("pull", [1000.0, -1000.0])
def test_what_nothing_holds_has_no_critical_load(pull):
    """Neither in tension nor in compression: without any load it is not stable, either."""
    found = rs.critical_load(rs.load("planar-link"), wrench=[pull, 0, 0])
    assert found.status is Status.FREE_MOTIONS
    assert not found.is_found
    with pytest.raises(rs.NoAnswerError, match="move without meeting stiffness"):
        found.factor  # noqa: B018


def test_what_spins_up_to_a_stop_is_followed():
    """The joint is free up to 2 rad: ten steps that are alike, and then the stop holds it."""
    link = rs.load("planar-link")
    (joint,) = (
        f"{leg.name}/{e.name}"
        for leg in rs.find_posture(link).snapshot.one(0).legs
        for e in leg.freedoms
        if e.is_passive
    )
    stop = ForceLaw([[-3, -1e3], [-2, 0], [0, 0], [2, 0], [3, 1e3]])
    found = equilibrium(link, wrench=[0, 0, 1.0], laws={joint: stop})
    assert found.status is Status.OK
    assert 2.0 < found.displacement[2] < 2.1


def test_rounding_of_a_load_drives_nothing():
    link = rs.load("planar-link")
    plain, rounded = (equilibrium(link, wrench=[100.0, 0, m]) for m in (0.0, 1e-13))
    assert rounded.status == plain.status
    assert np.allclose(rounded.displacement, plain.displacement, rtol=0, atol=1e-12)
