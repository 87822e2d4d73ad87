"""Loads along motions that no stiffness meets: the first step follows the pull."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.elastostatics import Status
from robostiff.model import ForceLaw
from robostiff.statics import equilibrium


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
