"""Figures of results: principal axes and ellipsoids, and lines of screws."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from robostiff.analysis import CableStiffness, Stiffness
from robostiff.elastostatics import scaling
from robostiff.errors import NoAnswerError
from robostiff.spatial import Screw

AnyStiffness = Stiffness | CableStiffness

_SMALL = 1e-7  # as for descriptions of free motions: a smaller part of a twist is zero


class Quality(Enum):
    """The quantity of an ellipsoid.

    ``COMPLIANCE``
        Displacement under a unit force in every direction; the platform is free to turn.
    ``STIFFNESS``
        Force that a unit displacement in every direction needs; the platform is held from turning.
    ``ROTATIONAL_COMPLIANCE``, ``ROTATIONAL_STIFFNESS``
        The same of rotations and moments: free to shift, held from shifting.
    """

    COMPLIANCE = "translational compliance"
    STIFFNESS = "translational stiffness"
    ROTATIONAL_COMPLIANCE = "rotational compliance"
    ROTATIONAL_STIFFNESS = "rotational stiffness"

    @property
    def is_compliance(self) -> bool:
        """Whether large semi-axes are soft directions."""
        return self in {Quality.COMPLIANCE, Quality.ROTATIONAL_COMPLIANCE}

    @property
    def is_rotational(self) -> bool:
        """Whether it is about rotations and moments."""
        return self in {Quality.ROTATIONAL_COMPLIANCE, Quality.ROTATIONAL_STIFFNESS}

    @property
    def unit(self) -> str:
        """Unit of the semi-axes."""
        if self.is_rotational:
            return "rad/(N m)" if self.is_compliance else "N m/rad"
        return "m/N" if self.is_compliance else "N/m"


@dataclass(frozen=True)
class PrincipalAxes:
    """Semi-axes of an ellipsoid, the image of the unit sphere."""

    directions: np.ndarray  # (d, 3): unit vectors, rows
    # (d,): ascending; inf for the compliance of a free direction, 0 for its stiffness
    lengths: np.ndarray

    @property
    def is_free(self) -> np.ndarray:
        """Axes along which motion is free (d,): unlimited compliance, or zero stiffness."""
        return np.isinf(self.lengths) | (self.lengths == 0)


def principal_axes(result: AnyStiffness, quality: Quality) -> PrincipalAxes:
    """Principal axes of one block of the stiffness or the compliance at a single pose.

    Where free motions F t = 0 remain, the compliance is that of the wrenches which do no work on
    them; along the directions that the free motions cover it has no limit.

    Examples
    --------
    >>> import robostiff as rs
    >>> result = rs.stiffness(rs.load("gough-stewart-a"))
    >>> principal_axes(result, Quality.COMPLIANCE).is_free
    array([False,  True,  True])
    """
    space = result.space
    own = np.array([(row >= 3) == quality.is_rotational for row in space.rows])
    axes = np.eye(3)[[row % 3 for row in np.array(space.rows)[own]]]
    twists = _free_twists(result)
    if quality.is_compliance:
        # directions in which free motions move these coordinates
        _, values, every = np.linalg.svd(twists[:, own], full_matrices=False)
        free, matrix, at_free = every[values > _SMALL], _held_compliance(result), np.inf
    else:
        # those of free motions that move no others
        U, values, _ = np.linalg.svd(twists[:, ~own])
        moved = int(np.count_nonzero(values > _SMALL))
        free = np.linalg.qr((U.T @ twists)[moved:, own].T)[0].T
        matrix, at_free = result.K, 0.0
    block = matrix[np.ix_(own, own)]
    others = np.linalg.svd(free)[2][len(free) :] if len(free) else np.eye(len(block))
    values, vectors = np.linalg.eigh(others @ block @ others.T)
    lengths = np.concatenate([np.maximum(values, 0.0), np.full(len(free), at_free)])
    directions = np.concatenate([vectors.T @ others, free])
    order = np.argsort(lengths, kind="stable")
    return PrincipalAxes((directions @ axes)[order], lengths[order])


def _free_twists(result: AnyStiffness) -> np.ndarray:
    """Orthonormal free twists (k, n) about the reference point, rotations times length."""
    twists = np.array([motion.twist for motion in result.free_motions])
    if not len(twists):
        return np.zeros((0, result.space.size))
    return np.linalg.qr((twists * _scaling(result)).T)[0].T


def _held_compliance(result: AnyStiffness) -> np.ndarray:
    """Compliance on the wrenches that do no work on the free motions."""
    C = result.compliance
    if C is not None:
        return C
    if isinstance(result, CableStiffness):
        if result.unstable_motions:
            raise NoAnswerError(f"no compliance of {result.name!r}: the platform does not stay")
    elif not result.details().invertible:
        return result.required_compliance()  # raises with the reason if there is none
    free, s = _free_twists(result), _scaling(result)
    held = np.linalg.svd(free)[2][len(free) :].T
    K = result.K / np.outer(s, s)
    return held @ np.linalg.solve(held.T @ K @ held, held.T) / np.outer(s, s)


def _scaling(result: AnyStiffness) -> np.ndarray:
    return scaling(np.asarray(length_of(result)), result.space)


def length_of(result: AnyStiffness) -> float:
    """The length by which rotations are compared with displacements [m]."""
    if isinstance(result, CableStiffness):
        return float(result.placed.characteristic_length)
    return float(result.length)


_TURN = 1.75 * np.pi
_TURNS_OF_A_SCREW = 2.0
_RADIUS = 0.3  # of half the axis
_STEPS = 96


@dataclass(frozen=True)
class ScrewLine:
    """Lines that show a motion."""

    axis: np.ndarray  # (2, 3): ends of the axis, or of the way of a translation
    # (n, 3): of a point that turns (an arc) or turns and advances (a helix with the pitch of the
    # screw); no points for a translation
    way: np.ndarray


def screw_line(screw: Screw, near: np.ndarray, half_length: float) -> ScrewLine:
    """Lines that show a screw near a point (3,), with an axis of a half length [m].

    A translation is drawn at the point, an axis where it passes nearest. A helix turns no further
    than its axis is long.

    Examples
    --------
    >>> turn = Screw(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), 0.0)
    >>> screw_line(turn, np.zeros(3), 0.5).axis.tolist()
    [[1.0, 0.0, -0.5], [1.0, 0.0, 0.5]]
    """
    e = screw.axis
    if screw.point is None:
        axis = near + half_length * np.array([-e, e])
        return ScrewLine(axis, np.zeros((0, 3)))
    centre = screw.point + e * (e @ (near - screw.point))
    pitch = screw.pitch or 0.0
    turned = _TURN if pitch == 0 else 2 * np.pi * _TURNS_OF_A_SCREW
    if abs(pitch) * turned > 2 * half_length:
        turned = 2 * half_length / abs(pitch)
    angle = np.linspace(-turned / 2, turned / 2, _STEPS)[:, None]
    across = np.eye(3)[np.argmin(np.abs(e))]
    first = across - e * (e @ across)
    first = first / np.linalg.norm(first)
    radius = _RADIUS * half_length
    around = radius * (np.cos(angle) * first + np.sin(angle) * np.cross(e, first))
    way = centre + around + pitch * angle * e
    return ScrewLine(centre + half_length * np.array([-e, e]), way)
