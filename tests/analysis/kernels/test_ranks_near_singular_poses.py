"""Ranks of records near singular poses, decided by the wrenches of the legs."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.model import Robot

SPREADS = (0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3, 1e-2, 1e-1)
EACH = 20


def poses(robot: Robot) -> np.ndarray:
    """Around the singular home of case A of the paper, nearer and farther."""
    assert robot.home is not None
    home = np.array([*robot.home.p, 0.0, 0.0, 0.0])
    random = np.random.default_rng(1)
    return np.concatenate([home + size * random.uniform(-1, 1, (EACH, 6)) for size in SPREADS])


@pytest.mark.parametrize("name", ["gough-stewart-a", "gough-stewart-a-beams"])
def test_rank_and_status_are_those_of_the_wrench_basis_form(name: str):
    robot = rs.load(name)
    assert isinstance(robot, Robot)
    at = poses(robot)
    compiled = rs.compile(robot, backend=rs.Backend.ARRAYS)
    answer, careful = compiled.evaluate(at, again=False), direct_stiffness(robot, at)
    own = ~answer.guarded
    assert np.all(careful.rank[:EACH] == 3)
    np.testing.assert_array_equal(np.unique(answer.rank[own]), [3, 5])
    np.testing.assert_array_equal(answer.rank[own], careful.rank[own])
    np.testing.assert_array_equal(answer.status_codes[own], careful.status_codes[own])
    K, expected = answer.values["K"], careful.details().matrix
    np.testing.assert_allclose(K[own], expected[own], atol=1e-14 * np.max(expected))
    share = answer.guarded.reshape(len(SPREADS), EACH).mean(axis=1)
    assert np.all(share[[6, 7]] == 0)
    assert share[5] < 0.5
    # At home all is clear; so near to it that wrenches differ by 1e-9, rounding would show.
    assert np.all(share[:4] == [0, 1, 1, 1])
    # What the tolerances leave in doubt is left to the wrench basis form.
    ill = (careful.status_codes & int(rs.Status.ILL_CONDITIONED)) != 0
    assert ill.sum() > EACH
    assert np.all(answer.guarded[ill])


def test_kernels_of_more_than_K_leave_these_poses_to_the_wrench_basis_form():
    """Some outputs divide by the pivots of K, and lose the digits that these have lost."""
    robot = rs.load("gough-stewart-a")
    assert isinstance(robot, Robot)
    outputs = [rs.StiffnessMatrix(), rs.PrincipalStiffness()]
    assert rs.compile(robot, outputs, backend=rs.Backend.ARRAYS).ranks is None
    again = pickle.loads(pickle.dumps(rs.compile(robot, backend=rs.Backend.ARRAYS)))  # noqa: S301
    at = poses(robot)[-EACH:]
    assert not np.any(again.evaluate(at, again=False).guarded)


def test_a_far_reference_point_is_left_to_the_wrench_basis_form():
    """It decides ranks amid the legs, where levers are short."""
    robot = rs.load("gough-stewart-a")
    assert isinstance(robot, Robot)
    far = rs.compile(replace(robot, reference_point=(50.0, 0, 0)), backend=rs.Backend.ARRAYS)
    assert far.ranks is None
