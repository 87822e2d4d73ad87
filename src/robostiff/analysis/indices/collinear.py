"""Collinear stiffness values: loads that move the platform along themselves, the rest free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robostiff.analysis.indices.stiffness_parts import stiffness_parts
from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import Status


@dataclass(frozen=True)
class CollinearStiffness:
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
    units: ClassVar[tuple[str, str]] = ("N/m", "N m/rad")
    translational: np.ndarray
    translational_directions: np.ndarray
    rotational: np.ndarray
    rotational_directions: np.ndarray
    status: Status

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
    forces, moments = parts.forces_rotations_free, parts.moments_translations_free
    return CollinearStiffness(
        forces.values, forces.directions, moments.values, moments.directions, parts.status
    )
