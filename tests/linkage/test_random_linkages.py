"""Linkages at random and by hand, against wrenches in equilibrium and products of exponentials."""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import circle, material
from robostiff.linkage import Linkage, close
from robostiff.model import Actuated, Passive, beam_link, cylindrical, planar, revolute, spherical
from robostiff.spatial import Frame
from tests.campaign.moved_linkages import by_forces, moved_linkage, open_by
from tests.linkage.test_robots_and_networks import _closed, _frame


@pytest.mark.parametrize("first", [cylindrical, planar])
def test_a_slide_on_the_base_moves_an_axis_that_does_not_turn(first):
    """The loop ends at the base as well: neither its end nor the axis depends on coordinates."""
    rng = np.random.default_rng(5)
    frames = {"base": Frame.identity()} | {body: _frame(rng) for body in "abcd"}
    x, y, z = rng.normal(size=(3, 3))
    elements = {
        "first": ("base", "a", first(x, Passive())),
        "crank": ("a", "b", revolute(y, Actuated(1e5))),
        "bar": ("b", "c", beam_link(z, material("steel"), circle(0.03))),
        "ball": ("c", "d", spherical(Passive())),
        "last": ("d", "base", cylindrical(z, Passive())),
    }
    linkage = Linkage(
        "loop",
        tuple(
            _closed(n, a, b, frames, replace(e, name=n), rng) for n, (a, b, e) in elements.items()
        ),
        "base",
        "c",
        np.zeros(3),
    )
    found = close(linkage, {"crank": 0.05})
    assert found.is_closed
    assert open_by(linkage, found) < 1e-9
    answer, truth = rs.stiffness(linkage, {"crank": 0.05}), by_forces(linkage, found)
    assert truth is not None
    assert not truth.in_doubt
    assert answer.rank == truth.rank
    assert (truth.K is None) == bool(answer.status & rs.Status.RIGID_DIRECTION)
    if truth.K is not None:
        np.testing.assert_allclose(answer.matrix, truth.K, atol=1e-8 * np.abs(truth.K).max())


@pytest.mark.parametrize("number", [0, 1, 2, 3, 66])
def test_random_linkages_are_as_forces_say(number):
    """That of number 66 has a record, and a drive that follows."""
    assert not moved_linkage(np.random.default_rng([20261122, number]))


@pytest.mark.parametrize(
    ("away", "status"),
    [(1e-3, rs.Status.OK), (1e-5, rs.Status.OK), (1e-9, rs.Status.ILL_CONDITIONED)],
)
def test_loops_that_are_nearly_singular_leave_few_digits(away, status):
    """A flat pantograph: heights follow from its stroke by a square root, of half the digits."""
    lift = rs.load_linkage("double-pantograph")
    answer = rs.stiffness(lift, {"screw": 0.1 - away})
    assert answer.status == status
    # Beside the true stiffness, proportional to the stroke that is left, up to what remains of it.
    assert answer.matrix[2, 2] == pytest.approx(0.99e6 * away, rel=1e-2)
