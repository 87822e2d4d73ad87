"""Stiffness of forces and of moments along their own directions, the rest held or free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from robostiff.analysis.indices.stiffness_parts import EigenPart, stiffness_parts
from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import Status


@dataclass(frozen=True)
class StationaryStiffness:
    """Stiffnesses of forces and of moments, ascending, with their directions as rows."""

    units: ClassVar[tuple[str, str]] = ("N/m", "N m/rad")

    translational: np.ndarray
    translational_directions: np.ndarray
    rotational: np.ndarray
    rotational_directions: np.ndarray
    status: Status

    @classmethod
    def of(cls, forces: EigenPart, moments: EigenPart, status: Status) -> Self:
        """Those of two symmetric matrices."""
        own = (forces.values, forces.directions, moments.values, moments.directions)
        return cls(*own, status)


@dataclass(frozen=True)
class PrincipalStiffnesses(StationaryStiffness):
    """Eigenvalues of K_tt and of K_rr, ascending, with their directions as rows.

    Attributes
    ----------
    translational : (d,) array
        Force per displacement with the rotations held [N/m]; independent of the reference point.
    translational_directions : (d, d) array
    rotational : (r,) array
        Moment per rotation with the reference point held [N m/rad].
    rotational_directions : (r, r) array
        In the plane the one rotation is about z, and the row is ``[1]``.
    status : Status
    """

    about: ClassVar[str] = "the other displacements and rotations held"


def principal_stiffness(result: RobotStiffness) -> PrincipalStiffnesses:
    """Eigenvalues of the diagonal blocks of K: ``K_tt u = k u`` and ``K_rr u = k u``.

    They are the stiffnesses for a task that guides the platform: of a machine that
    presses without letting it turn. What holds the rest is not counted, so they are upper bounds;
    `collinear_stiffness` is that of a platform that is free to deflect. ``K_tt`` is the same
    about every point, ``K_rr`` is not.

    Parameters
    ----------
    result : RobotStiffness
        Of a single pose.

    Returns
    -------
    PrincipalStiffnesses
        Zeros, exactly, along free motions.

    Raises
    ------
    InputError, NoAnswerError
        For a batch; for a pose without a matrix.

    References
    ----------
    C. Gosselin: Stiffness mapping for parallel manipulators. IEEE Transactions on Robotics and
    Automation 6(3), 1990.

    Examples
    --------
    >>> import robostiff as rs
    >>> found = principal_stiffness(rs.stiffness(rs.load("gough-stewart-b")))
    >>> (found.translational / 1e6).round(1)
    array([ 68.7,  68.7, 462.7])
    """
    parts = stiffness_parts(result)
    return PrincipalStiffnesses.of(
        parts.forces_rotations_held, parts.moments_translations_held, parts.status
    )


@dataclass(frozen=True)
class CollinearStiffness(StationaryStiffness):
    """Stationary stiffness of forces through the reference point, and of moments, ascending.

    Attributes
    ----------
    translational : (d,) array
        Force per displacement along the force, the platform free to turn [N/m].
    translational_directions : (d, d) array
        Unit vectors, rows.
    rotational : (r,) array
        Moment per rotation about the moment, the platform free to shift [N m/rad]; independent of
        the reference point.
    rotational_directions : (r, r) array
    status : Status
    """

    about: ClassVar[str] = "the other displacements and rotations free"

    @property
    def smallest(self) -> float:
        """The least collinear stiffness of a force [N/m]."""
        return float(self.translational[0])


def collinear_stiffness(result: RobotStiffness) -> CollinearStiffness:
    """Stiffness along forces whose displacement is parallel to them, ``C_tt u = (1 / k) u``.

    A force along such a u moves the reference point along u, while the platform turns as it likes;
    1 / (u^T C_tt u) is stationary there, so that the smallest value is the least stiffness against
    any force, the reciprocal of the worst deflection. The same for moments and rotations, with
    ``C_rr``. Where K is singular, ``(C_tt)^-1`` is ``K_tt - K_tr K_rr^-1 K_rt``, and exactly zero
    along forces that drive a free motion.

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
    The name is that of V. Portman: Stiffness evaluation of machines and robots: minimum collinear
    stiffness value approach. Journal of Mechanisms and Robotics 3(1), 011015, 2011. The definition
    is the one written above.

    Examples
    --------
    >>> import robostiff as rs
    >>> free = collinear_stiffness(rs.stiffness(rs.load("hexapod")))
    >>> (free.translational / 1e6).round(1)
    array([ 17.9,  17.9, 321.8])
    """
    parts = stiffness_parts(result)
    return CollinearStiffness.of(
        parts.forces_rotations_free, parts.moments_translations_free, parts.status
    )


@dataclass(frozen=True)
class Anisotropy:
    """Largest over smallest principal compliance, of forces and of moments.

    Attributes
    ----------
    translational : float or None
        1 where a unit force displaces alike in every direction; None where some force meets no
        stiffness.
    rotational : float or None
        In the plane, with one rotation alone, 1.
    status : Status
    """

    about: ClassVar[str] = "largest over smallest principal compliance"
    unit: ClassVar[str] = "1"
    translational: float | None
    rotational: float | None
    status: Status


def anisotropy(result: RobotStiffness) -> Anisotropy:
    """Ratio of the largest to the smallest eigenvalue of C_tt, and of C_rr.

    Both are numbers without units, and need no characteristic length.

    Parameters
    ----------
    result : RobotStiffness
        Of a single pose.

    Raises
    ------
    InputError, NoAnswerError
        For a batch; for a pose without a matrix.

    Examples
    --------
    >>> import robostiff as rs
    >>> round(anisotropy(rs.stiffness(rs.load("hexapod"))).translational, 2)
    18.0
    """
    parts = stiffness_parts(result)
    return Anisotropy(
        _ratio(parts.forces_rotations_free), _ratio(parts.moments_translations_free), parts.status
    )


def _ratio(part: EigenPart) -> float | None:
    return float(part.values[-1] / part.values[0]) if part.values[0] > 0 else None
