"""Legs that close in closed form: as Newton's method does, both elbows, and at their limits."""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff import Elbow, InputError
from robostiff.kinematics import find_posture, place_chain
from robostiff.kinematics.closure import LegSolver, Post, Rod, Strut, leg_solvers
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Joint, PlacedFreedom
from robostiff.spatial import Frame
from tests.generators.elements import ROD, STEEL
from tests.generators.legs import (
    PLANAR,
    POSTS,
    RODS,
    SLIDING,
    STRUTS,
    LegCase,
    has_skewed_axes,
    near_home,
    platform_at,
    random_leg,
    six,
    with_elbow,
)

LENGTH = 1.0
#: A few of each kind; all with `make slow`.
SEEDS = [(0, 5), pytest.param([*range(1, 5), *range(6, 12)], marks=pytest.mark.slow)]
FEW_OR_MORE = ["few", "more"]
WITH_ELBOWS = (*RODS, *SLIDING, "RRR", "PRR")


def solved(solver: LegSolver, poses: np.ndarray) -> np.ndarray:
    """Leg coordinates at pose coordinates (N, 6)."""
    return solver.solve(poses, turn_by_vector(poses[:, 3:]))[0][0]


def gap(case: LegCase, q: np.ndarray, pose: np.ndarray) -> float:
    """How far leg coordinates are from a platform pose, metres and radians alike."""
    reached = platform_at(case.leg, q)
    R = turn_by_vector(pose[3:])
    turn = np.abs(reached.rotation.as_matrix() - R).max()
    return float(max(np.abs(reached.translation - pose[:3]).max(), turn))


def solver_of(case: LegCase) -> LegSolver:
    return leg_solvers([case.leg], case.home_pose, LENGTH)[0]


def reachable(case: LegCase, rng: np.random.Generator, size: float) -> np.ndarray:
    """Coordinates near home, the elbow as it is there."""
    while True:
        q = near_home(case, rng, size)
        if case.leg.name not in WITH_ELBOWS or is_plus(case, q) == is_plus(
            case, case.leg.chain.home
        ):
            return q


def is_plus(case: LegCase, q: np.ndarray) -> bool:
    """Side of the elbow by its description, from where things are in the world."""
    drive, A, B = drive_and_rod(case, q)
    if drive.is_translation:
        # the larger of two slides: the rod comes back against the slide
        return bool(drive.axis @ (A - B) > 0)
    return bool(drive.axis @ np.cross(B - drive.point, A - drive.point) > 0)


def drive_and_rod(case: LegCase, q: np.ndarray) -> tuple[PlacedFreedom, np.ndarray, np.ndarray]:
    """The joint of a leg that drives its rod, and both ends of the rod."""
    leg = case.leg
    placed = place_chain(leg.chain, q, leg.base.R, leg.base.p)
    freedoms = [e for e in placed.elements if isinstance(e, PlacedFreedom)]
    drive, *joints = freedoms[1:] if leg.name in SLIDING else freedoms
    return drive, joints[0].point, joints[-1].point


@pytest.mark.parametrize("kind", STRUTS + RODS + PLANAR + SLIDING + POSTS)
@pytest.mark.parametrize("seeds", SEEDS, ids=FEW_OR_MORE)
def test_recognised_closed_to_1e_12_and_as_newton_does(kind: str, seeds: list[int]):
    for seed in seeds:
        _is_recognised_closed_and_as_newton(kind, seed)


def _is_recognised_closed_and_as_newton(kind: str, seed: int):
    case = random_leg(kind, seed)
    solver = solver_of(case)
    form = Strut if kind in (*STRUTS, "RPR") else Post if kind in POSTS else Rod
    assert isinstance(solver.closed_form, form)
    assert (getattr(solver.closed_form, "across", None) is not None) is (kind in SLIDING)
    assert gap(case, solver.home, case.home_pose) <= 1e-12
    rng = np.random.default_rng(seed)
    poses = np.stack([case.pose_at(reachable(case, rng, 0.25)) for _ in range(8)])
    found = solved(solver, poses)
    assert found.shape == (8, case.leg.chain.size)
    for q, pose in zip(found, poses, strict=True):
        assert gap(case, q, pose) <= 1e-12
    posture = find_posture(case.robot, poses)
    assert posture.reached.all()
    assert posture.shift_gaps.max() <= 1e-12
    assert posture.turn_gaps.max() <= 1e-12
    q_true = reachable(case, rng, 0.15)
    pose = case.pose_at(q_true)
    for own, most in ((solver, 1e-12), (replace(solver, closed_form=None), 1e-10)):
        q = solved(own, pose[None])[0]
        assert gap(case, q, pose) <= most
        if kind not in ("SPS", "SPU", "PSU", "RSU"):  # there a rod or a ball may spin
            assert np.allclose(q, q_true, rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", WITH_ELBOWS)
@pytest.mark.parametrize("seeds", SEEDS, ids=FEW_OR_MORE)
def test_both_elbows(kind: str, seeds: list[int]):
    """The elbow given by its name is on the side that its description says."""
    for seed in seeds:
        _has_both_elbows(kind, seed)


def _has_both_elbows(kind: str, seed: int):
    case = random_leg(kind, seed)
    q, pose = case.leg.chain.home, case.home_pose
    sides = {}
    for elbow in (Elbow.PLUS, Elbow.MINUS):
        named = with_elbow(case, elbow)
        try:
            (solver,) = leg_solvers([named.leg], pose, LENGTH)
        except InputError:
            # joints that cannot take any direction, or not any rotation, suit one elbow only
            assert kind not in ("PSU", "RSU")
            assert kind not in ("PUS", "RUS") or has_skewed_axes(case)
            continue
        closed = solved(solver, pose[None])[0]
        assert gap(case, closed, pose) <= 1e-12
        sides[elbow] = closed
    assert sides
    by_home = solved(solver_of(case), pose[None])[0]
    assert np.isclose(by_home[0], q[0], rtol=0, atol=1e-9)
    for elbow, closed in sides.items():
        assert (elbow is Elbow.PLUS) == is_plus(case, closed)
    if len(sides) == 2:
        assert np.abs(sides[Elbow.PLUS] - sides[Elbow.MINUS]).max() > 1e-6


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
