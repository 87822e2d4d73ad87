"""Formulas of robots with parallel blocks: by hand, and exported against the numerical form."""

import numpy as np
import sympy as sp

import robostiff as rs
from robostiff.model import Chain, Leg, Robot, parallelogram, prismatic, revolute
from robostiff.spatial import Frame, Space

NOMINAL = {"k": 3e6, "l": 0.5, "w": 0.1}


def bars_that_only_stretch(k, length, width) -> Robot:
    """A planar parallelogram of two bars along x, each a spring of stiffness k."""
    z = [0, 0, 1]
    free, spring = rs.Passive(), rs.Actuated(k)
    bar = Chain(
        (
            revolute(z, free, name="near pin"),
            prismatic([1, 0, 0], spring, home=[length], name="bar"),
            revolute(z, free, name="far pin"),
        )
    )
    across = np.array([0, width, 0], dtype=object)
    still = Frame(np.eye(3, dtype=int), np.zeros(3, dtype=int))
    leg = Leg("leg", still, Chain((parallelogram(bar, across),)), still)
    home = Frame(np.eye(3, dtype=int), np.array([length, 0, 0], dtype=object))
    return Robot("parallelogram", (leg,), home=home, space=Space.PLANAR, nominal=NOMINAL)


def test_planar_parallelogram_by_hand():
    """Bars along x at y = +-w/2 feel dx -+ w/2 rz: K = diag(2 k, 0, k w^2/2)."""
    k, length, w = sp.symbols("k l w", positive=True)
    robot = bars_that_only_stretch(k, length, w)
    K = sp.Matrix(rs.derive(robot, form=rs.Closed()).K)
    assert sp.simplify(K - sp.diag(2 * k, 0, k * w**2 / 2)) == sp.zeros(3)
    numeric = rs.stiffness(robot.numeric)
    assert np.abs(numeric.K - np.diag([6e6, 0, 1.5e4])).max() < 1e-6
    assert int(numeric.rank) == 2
