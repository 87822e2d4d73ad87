"""What the page on the Orthoglide and the 3-PUU of its bars says."""

from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import material, tube
from robostiff.kinematics import PostureFinder
from robostiff.model import Robot
from tests.cases.metric import distance

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MODEL = EXAMPLES / "orthoglide-3-puu.yaml"
STEEL, BAR = material("steel"), tube(0.016, 0.012)
LENGTH, BETWEEN, DRIVE = 0.6, 0.1, 1.5e7
S = np.linspace(-0.12, 0.24, 10)
DIAGONAL = np.outer(S, [1, 1, 1])


def both(parameters=None):
    """K along the diagonal of the Orthoglide and of the 3-PUU."""
    robots = rs.load("orthoglide", parameters), rs.load(MODEL, parameters)
    return [rs.stiffness(robot, DIAGONAL).K for robot in robots]


def test_closed_forms_at_the_centre():
    torsion = 2 * STEEL.G * BAR.J / LENGTH
    pulled = STEEL.E * BAR.A * BETWEEN**2 / (2 * LENGTH)
    sheared = 6 * STEEL.E * BAR.Iy * BETWEEN**2 / LENGTH**3
    along = 1 / (1 / DRIVE + LENGTH / (2 * STEEL.E * BAR.A))
    turning = pulled + torsion + sheared, torsion
    for name, K_rr in zip(("orthoglide", MODEL), turning, strict=True):
        K = rs.stiffness(rs.load(name)).K
        assert distance(K, np.diag([along] * 3 + [K_rr] * 3)) < 1e-10
    assert turning[0] / turning[1] == pytest.approx(131.1, abs=0.05)
    nearly = 4 * (1 + STEEL.poisson_ratio) * BETWEEN**2 / (0.016**2 + 0.012**2)
    assert nearly == pytest.approx(turning[0] / turning[1], rel=0.01)


def test_translation_blocks_are_the_same_sum_over_the_bars():
    robot = rs.load(MODEL)
    assert isinstance(robot, Robot)
    finder = PostureFinder(robot)
    snapshot = finder.find(DIAGONAL).snapshot
    with_loops, without = both()
    for i in range(len(S)):
        K_tt = np.zeros((3, 3))
        for leg, e in zip(snapshot.one(i).legs, np.eye(3), strict=True):
            near, far = (list(leg.freedoms)[place].point for place in (1, 3))
            u = (far - near) / LENGTH
            K_tt += np.outer(u, u) / ((u @ e) ** 2 / DRIVE + LENGTH / (2 * STEEL.E * BAR.A))
        for K in (with_loops[i], without[i]):
            np.testing.assert_allclose(K[:3, :3], K_tt, atol=1e-8 * K_tt.max())


def test_legs_that_end_at_the_tool_make_both_alike_against_forces():
    one, other = (np.linalg.inv(K)[:, :3, :3] for K in both({"r": "0"}))
    np.testing.assert_allclose(other, one, atol=1e-8 * np.abs(one).max())
