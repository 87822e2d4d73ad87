"""A post of a universal joint and a slide, as that of a Tricept: a point decides the rotation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robostiff.kinematics.closure.body import tidied, tidied_point
from robostiff.kinematics.closure.leg_solver import LegSolver
from robostiff.kinematics.closure.skeleton import Cluster, Slide, skeleton_of
from robostiff.kinematics.formula import PlacedFormula, place_leg_at_joints
from robostiff.kinematics.frames import place_chain
from robostiff.model import Coordinate, Leg, Robot
from robostiff.record import square_root
from robostiff.record.functions import angle_of
from robostiff.spatial import cross

_SMALL = 1e-9  # cosine of perpendicular axes; part of a length
_POINT = (Coordinate.X, Coordinate.Y, Coordinate.Z)


def guiding_post(robot: Robot, solvers: Sequence[LegSolver]) -> int | None:
    """Number of the post of a robot that is posed by its point alone; None where it has none."""
    if robot.coordinates != _POINT:
        return None
    return next((i for i, own in enumerate(solvers) if _is_post(own.leg)), None)


def place_guiding_post(leg: Leg, p: np.ndarray, solver: LegSolver) -> PlacedFormula:
    """Record a post that brings the origin of the platform to p (3,), in the branch of home.

    From the centre of the joint, of axes a and b, its slide runs along a unit vector u to p; before
    the joint turns about a, along ``w a + v m`` with w = a.u and m = a x b.
    """
    C, a, b, e, arm = _at_zero(leg)
    _, a_, b_, e_, arm_ = map(np.asarray, _at_zero(solver.leg))
    m, m_, n, n_ = tidied(cross(a, b)), cross(a_, b_), tidied(cross(b, e)), cross(b_, e_)
    turn, way = solver.home[1], np.sign(arm_ @ e_ + solver.home[2])
    side = way * np.sign(np.cos(turn) * (m_ @ e_) + np.sin(turn) * (m_ @ n_))
    d = tidied(leg.base.R).T @ (p - tidied_point(leg.base.p)) - C
    L = square_root(d @ d) * int(way)
    across = square_root((d @ b) * (d @ b) + (d @ m) * (d @ m)) * int(side)
    w, v = (d @ a) / L, across / L
    sine, cosine = w * (a @ n) + v * (m @ n), w * (a @ e) + v * (m @ e)
    q = [
        angle_of(-(d @ b) / across, (d @ m) / across, float(solver.home[0])),
        angle_of(sine, cosine, float(turn)),
        L - arm @ e,
    ]
    return place_leg_at_joints(leg, np.array(q, dtype=object))


def _is_post(leg: Leg) -> bool:
    """Whether its slide points from the centre of a universal joint to the platform's origin."""
    if leg.chain.has_blocks or leg.chain.size != 3:
        return False
    match skeleton_of(leg.chain).parts:
        case (Cluster(axes=(_, _), is_ball=False), Slide()):
            _, a, b, e, arm = map(np.asarray, _at_zero(leg))
            beside = np.linalg.norm(cross(arm, e)) / (np.linalg.norm(arm) or 1.0)
            return bool(max(abs(a @ b), abs(b @ e), beside) <= _SMALL)
        case _:
            return False


def _at_zero(leg: Leg) -> tuple[Any, ...]:
    """Centre and axes of the joint, direction of the slide, and from the centre to the platform.

    In the leg's base frame, its coordinates zero.
    """
    zero = place_chain(leg.chain, leg.chain.zero, np.eye(3, dtype=int), np.zeros(3, dtype=int))
    first, second, slide = zero.freedoms
    R = zero.R @ leg.attachment.R.T
    arm = zero.p - R @ leg.attachment.p - first.point
    axes = (tidied(x.axis) for x in (first, second, slide))
    return tidied_point(first.point), *axes, tidied_point(arm)
