"""Stiffness of a robot frozen at a pose: its legs one by one, and their sum."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robostiff.analysis.leg_matrices import LegMatrices, leg_matrices
from robostiff.elastostatics import (
    CartesianStiffness,
    Form,
    Status,
    Tolerance,
    WrenchBasis,
    aggregate,
    matrix_length,
    solve_chain,
    solved_leg,
)
from robostiff.model import Snapshot

_DEFAULT_METHOD = WrenchBasis()
# Part of a coordinate that is lost when points are computed in several ways.
_ROUNDING = 1e-12
# A reference point further from the robot than this many of its lengths is moved to at the end.
_FAR = 10.0


@dataclass(frozen=True)
class SnapshotStiffness:
    """Stiffness of every leg of a snapshot and of the whole, about one point of its platform.

    Attributes
    ----------
    whole : CartesianStiffness
    legs : tuple of CartesianStiffness
    passive_joint_names : tuple of str
        ``leg/joint`` of every column of `whole.redundant`.
    compliance : (..., n, n) array or None
        Of a single leg without passive joints, which needs no inverse.
    origin : (..., 3) array
        The point about which they are [m].
    """

    whole: CartesianStiffness
    legs: tuple[CartesianStiffness, ...]
    passive_joint_names: tuple[str, ...]
    compliance: np.ndarray | None
    origin: np.ndarray


def solve_snapshot(snapshot: Snapshot, method: Form, tolerance: Tolerance) -> SnapshotStiffness:
    """Stiffness of the legs of a snapshot and of the whole."""
    length = snapshot.characteristic_length
    # Lever arms that are small beside the lengths of the parts are rounding: all is in one point.
    length = np.where(length > tolerance.independence * _length_of_parts(snapshot), length, 0.0)
    origin = _origin(snapshot, length)
    problems = _legs(snapshot, origin, np.where(length > 0, length, 1.0), tolerance)
    if not np.all(length > 0):  # all in one point: a length from the springs
        of_springs = np.max([matrix_length(own.C, own.J_q) for own in problems], axis=0)
        # Lever arms between points that are one are rounding of their coordinates.
        arms = _ROUNDING * np.max(np.abs(snapshot.centre), axis=-1)
        of_springs = np.where(of_springs > arms, of_springs, 1.0)
        length = np.where(length > 0, length, of_springs)
        problems = _legs(snapshot, origin, length, tolerance)
    names = [
        f"{leg.name}/{name}"
        for leg, own in zip(snapshot.legs, problems, strict=True)
        for name in own.reported_names
    ]
    legs = tuple(_solved(own, method, length, tolerance) for own in problems)
    alone = len(legs) == 1 and problems[0].J_q.shape[-1] == 0
    whole, C = aggregate(legs), problems[0].C if alone else None
    if snapshot.platform is not None:
        from robostiff.analysis.flexible_platform import legs_on_platform

        of_legs = [own.C for own in problems]
        whole, legs, C, more = legs_on_platform(snapshot.platform, legs, of_legs, C, origin, method)
        names += more
    return SnapshotStiffness(
        whole=whole,
        legs=legs,
        passive_joint_names=tuple(names),
        compliance=C,
        origin=origin,
    )


def _solved(
    leg: LegMatrices, method: Form, length: np.ndarray, tolerance: Tolerance
) -> CartesianStiffness:
    """Stiffness of a leg, with the status of its blocks."""
    if method == _DEFAULT_METHOD:
        solved = solved_leg(leg.wrenches(length, tolerance), length, tolerance)
    else:
        solved = solve_chain(leg.C, leg.J_q, method, length, tolerance, leg.present)
    if not leg.blocks:
        return solved
    redundant = leg.reported(solved.redundant)
    status = (
        solved.status_codes
        | np.any(redundant, axis=-1) * np.uint8(Status.REDUNDANT_JOINTS)
        | leg.doubtful * np.uint8(Status.ILL_CONDITIONED)
    )
    return replace(solved, redundant=redundant, status_codes=np.asarray(status, dtype=np.uint8))


def _origin(snapshot: Snapshot, length: np.ndarray) -> np.ndarray:
    """Where to compute: at the reference point, or amid the legs where that is far away.

    From a robot that is all in one point every other is far away.
    """
    reference, centre = snapshot.reference_point, snapshot.centre
    far = np.linalg.norm(reference - centre, axis=-1) > _FAR * length
    return np.where(far[..., None], centre, reference) if np.any(far) else reference


def _length_of_parts(snapshot: Snapshot) -> np.ndarray:
    """Largest length that a spring has by itself, sqrt(tr C_tt / tr C_rr) (...) [m]; 0 for none."""
    longest = np.zeros(snapshot.reference_point.shape[:-1])
    for leg in snapshot.legs:
        for spring in leg.springs:
            d = np.einsum("...ii->...i", spring.elasticity.compliance)
            shift, turn = np.sum(d[..., :3], axis=-1), np.sum(d[..., 3:], axis=-1)
            both = (shift > 0) & (turn > 0)
            own = np.sqrt(np.where(both, shift, 0.0) / np.where(both, turn, 1.0))
            longest = np.maximum(longest, own)
    return longest


def _legs(
    snapshot: Snapshot, origin: np.ndarray, length: np.ndarray, tolerance: Tolerance
) -> list[LegMatrices]:
    return [leg_matrices(leg, origin, snapshot.space, length, tolerance) for leg in snapshot.legs]
