"""Eigenwrenches, eigentwists and compliant axes: the structure of K that no point can change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robostiff.analysis.indices.stiffness_parts import StiffnessParts, stiffness_parts
from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import Status
from robostiff.spatial import Screw, screw_of_twist

_SMALL = 1e-7


@dataclass(frozen=True)
class Eigenwrench:
    """A wrench that displaces the platform parallel to its force, without turning it.

    Attributes
    ----------
    stiffness : float
        Force per displacement [N/m]; zero along a free translation.
    direction : (3,) array
        Unit vector of force and displacement.
    screw : Screw or None
        Line and pitch [m] of the wrench; a pitch of zero is a pure force. None where the
        translation is free.
    """

    stiffness: float
    direction: np.ndarray
    screw: Screw | None


@dataclass(frozen=True)
class Eigentwist:
    """A twist whose rotation is parallel to the pure couple that causes it.

    Attributes
    ----------
    stiffness : float
        Couple per rotation [N m/rad]; zero where the platform turns freely.
    direction : (3,) array
        Unit vector of couple and rotation.
    screw : Screw
        Line and pitch [m/rad] of the twist; a pitch of zero is a pure rotation. With free
        translations it is the one that has no part of them.
    """

    stiffness: float
    direction: np.ndarray
    screw: Screw


@dataclass(frozen=True)
class CompliantAxis:
    """A line along which a force only displaces, and about which a couple only turns.

    Attributes
    ----------
    direction, point : (3,) array
    translational : float
        [N/m].
    rotational : float
        [N m/rad].
    """

    direction: np.ndarray
    point: np.ndarray
    translational: float
    rotational: float


@dataclass(frozen=True)
class Eigenscrews:
    """Eigenwrenches and eigentwists, those of least stiffness first, and compliant axes.

    Attributes
    ----------
    wrenches : tuple of Eigenwrench
        Three, or two in the plane.
    twists : tuple of Eigentwist
        Three, or one in the plane.
    compliant_axes : tuple of CompliantAxis
        Lines that are both the axis of an eigenwrench and of an eigentwist, both without pitch.
    status : Status
    """

    about: ClassVar[str] = "independent of the reference point, and of any characteristic length"
    units: ClassVar[tuple[str, str]] = ("N/m", "N m/rad")
    wrenches: tuple[Eigenwrench, ...]
    twists: tuple[Eigentwist, ...]
    compliant_axes: tuple[CompliantAxis, ...]
    status: Status


def eigenscrews(result: RobotStiffness) -> Eigenscrews:
    """Eigenwrenches ``K (u, 0) = k_f (u, m)`` and eigentwists ``K (d, w) = k_r (0, w)``.

    The stiffnesses k_f are the eigenvalues of K_tt, the k_r the reciprocals of those of C_rr. Lines
    and pitches belong to the machine: no choice of point or length enters. Together they are all of
    K: ``K = sum k_f (u, m)(u, m)^T + sum k_r (0, w)(0, w)^T``. Where K is singular, what is left is
    given: k_r are then the eigenvalues of ``K_rr - K_rt K_tt^-1 K_tr`` over the held directions.

    Where two stiffnesses are equal, their screws are one choice of many.

    Parameters
    ----------
    result : RobotStiffness
        Of a single pose.

    Raises
    ------
    InputError, NoAnswerError
        For a batch; for a pose without a matrix.

    References
    ----------
    T. Patterson, H. Lipkin: Structure of robot compliance. Journal of Mechanical Design 115(3),
    576-580, 1993. The same: A classification of robot compliance. Ibid., 581-584.

    Examples
    --------
    >>> import robostiff as rs
    >>> found = eigenscrews(rs.stiffness(rs.load("gough-stewart-b")))
    >>> [round(float(twist.stiffness)) for twist in found.twists]
    [12198795, 20545339, 20545339]
    """
    stiffness_parts(result)
    parts = stiffness_parts(result.about(result.origin))
    wrenches, twists = _wrenches(parts), _twists(parts)
    length = float(result.about_reference.length)
    return Eigenscrews(wrenches, twists, _compliant_axes(wrenches, twists, length), parts.status)


def _wrenches(parts: StiffnessParts) -> tuple[Eigenwrench, ...]:
    d = parts.space.translations
    forces = parts.forces_rotations_held
    found = []
    for k, u in zip(forces.values, forces.directions, strict=True):
        screw = None
        if k > 0:
            # A wrench is a twist with its halves exchanged: moment for displacement.
            screw = _screw(parts, u, parts.K[d:, :d] @ u / k)
        found.append(Eigenwrench(float(k), _spatial_shift(u), screw))
    return tuple(found)


def _twists(parts: StiffnessParts) -> tuple[Eigentwist, ...]:
    d = parts.space.translations
    forces, moments = parts.forces_rotations_held, parts.moments_translations_free
    found = []
    for k, w in zip(moments.values, moments.directions, strict=True):
        shift = -forces.solve((parts.K[:d, d:] @ w)[:, None])[:, 0]
        twist = np.concatenate([_spatial_shift(shift), _spatial_turn(w)])
        length = float(parts.result.about_reference.length)
        screw = screw_of_twist(twist, parts.result.reference_point, length, _SMALL)
        found.append(Eigentwist(float(k), _spatial_turn(w), screw))
    return tuple(found)


def _screw(parts: StiffnessParts, u: np.ndarray, m: np.ndarray) -> Screw:
    result = parts.result
    halves = np.concatenate([_spatial_turn(m), _spatial_shift(u)])
    length = float(result.about_reference.length)
    return screw_of_twist(halves, result.reference_point, length, _SMALL)


def _spatial_shift(u: np.ndarray) -> np.ndarray:
    return u if len(u) == 3 else np.append(u, 0.0)


def _spatial_turn(w: np.ndarray) -> np.ndarray:
    return w if len(w) == 3 else np.array([0.0, 0.0, w[0]])


def _compliant_axes(
    wrenches: tuple[Eigenwrench, ...], twists: tuple[Eigentwist, ...], length: float
) -> tuple[CompliantAxis, ...]:
    return tuple(
        CompliantAxis(twist.direction, twist.screw.point, wrench.stiffness, twist.stiffness)
        for wrench in wrenches
        for twist in twists
        if wrench.screw is not None
        and twist.screw.point is not None
        and twist.stiffness > 0
        and _same_line(wrench.screw, twist.screw, length)
    )


def _same_line(one: Screw, other: Screw, length: float) -> bool:
    if not (one.is_rotation and other.is_rotation) or one.point is None or other.point is None:
        return False
    parallel = np.linalg.norm(np.cross(one.axis, other.axis)) < _SMALL
    apart = np.linalg.norm(np.cross(other.point - one.point, one.axis))
    return bool(parallel and apart < _SMALL * length)
