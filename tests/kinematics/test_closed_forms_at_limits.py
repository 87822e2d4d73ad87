"""Closed forms where directions fall together: postures stay finite, and close where they can."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.kinematics import place_chain
from robostiff.kinematics.closure import leg_solvers
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Joint
from robostiff.spatial import Frame
from tests.generators.elements import ROD, STEEL
from tests.generators.legs import platform_at, six

X, Y, Z = np.eye(3)
FREE, DRIVE = rs.Passive(), rs.Actuated(1e7)
AT_ORIGIN = Frame(np.eye(3), np.zeros(3))
BALL, CROSS, CROSS_AT_ROD = rs.spherical(FREE), rs.universal(X, Y, FREE), rs.universal(Z, Y, FREE)


def gaps(chain: rs.Chain, poses: np.ndarray) -> np.ndarray:
    """How far the end of a leg is from poses (N, 6), metres and radians alike."""
    leg = rs.Leg("leg", AT_ORIGIN, chain, AT_ORIGIN)
    (solver,) = leg_solvers([leg], six(platform_at(leg, chain.home)), 1.0)
    assert solver.closed_form is not None
    R = turn_by_vector(poses[:, 3:])
    (q,), *_ = solver.solve(poses, R)
    assert np.isfinite(q).all()
    placed = place_chain(chain, q, np.eye(3), np.zeros(3))
    turned = np.abs(placed.R - R).max(axis=(1, 2))
    return np.maximum(np.abs(placed.p - poses[:, :3]).max(axis=1), turned)


def strut(first: Joint, last: Joint) -> rs.Chain:
    """A strut along z, 1 m long at home."""
    return rs.Chain(
        (first, rs.prismatic(Z, DRIVE, home=[1.0]), rs.beam_link(0.2 * Z, STEEL, ROD), last)
    )


def poses_at(ends: list, turn: tuple[float, float, float] = (0.1, -0.2, 0.3)) -> np.ndarray:
    return np.array([(*end, *turn) for end in ends])


@pytest.mark.parametrize(("first", "last"), [(CROSS, BALL), (BALL, BALL)])
def test_a_strut_along_the_first_axis_of_its_joint_or_turned_over_closes(first: Joint, last: Joint):
    ends = [X, -X, 0.7 * X + 1e-3 * Y, -Z, -Z + 1e-9 * X, -Z + 1e-4 * Y, X - Z]
    assert gaps(strut(first, last), poses_at(ends)).max() <= 1e-11


def test_a_strut_without_length_is_finite():
    for first in (CROSS, BALL):
        assert gaps(strut(first, BALL), np.zeros((1, 6)))[0] <= 1e-12


def test_a_rod_about_the_axis_of_its_crank_is_finite():
    """The crank may be anywhere: it closes wherever it is, the rod as long as the arm."""
    arm, rod = rs.beam_link(0.5 * X, STEEL, ROD), rs.beam_link(0.5 * Z, STEEL, ROD)
    chain = rs.Chain((rs.revolute(Z, DRIVE), arm, BALL, rod, BALL))
    assert gaps(chain, np.zeros((1, 6)))[0] <= 1e-12


@pytest.mark.parametrize("direction", [X, Y, (0.6, 0.0, 0.8), (-0.6, 0.8, 0.0)])
def test_out_of_reach_a_rod_ends_where_it_comes_nearest(direction: np.ndarray):
    """On a slide along z the rod lies across; its end is nearer to the goal than any other."""
    rod = rs.beam_link(0.5 * X, STEEL, ROD)
    chain = rs.Chain((rs.prismatic(Z, DRIVE), CROSS_AT_ROD, rod, BALL))
    far = np.asarray(direction) * 2.0
    lacking = np.hypot(far[0], far[1]) - 0.5
    leg = rs.Leg("leg", AT_ORIGIN, chain, AT_ORIGIN)
    (solver,) = leg_solvers([leg], six(platform_at(leg, chain.home)), 1.0)
    (q,), *_ = solver.solve(poses_at([far]), turn_by_vector(poses_at([far])[:, 3:]))
    placed = place_chain(chain, q, np.eye(3), np.zeros(3))
    assert np.linalg.norm(placed.p[0] - far) == pytest.approx(lacking, abs=1e-12)
