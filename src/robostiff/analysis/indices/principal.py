"""Principal stiffnesses: eigenvalues of the diagonal blocks of K, everything else held."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robostiff.analysis.indices.stiffness_parts import stiffness_parts
from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import Status


@dataclass(frozen=True)
class PrincipalStiffnesses:
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
    units: ClassVar[tuple[str, str]] = ("N/m", "N m/rad")
    translational: np.ndarray
    translational_directions: np.ndarray
    rotational: np.ndarray
    rotational_directions: np.ndarray
    status: Status


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
    forces, moments = parts.forces_rotations_held, parts.moments_translations_held
    return PrincipalStiffnesses(
        forces.values, forces.directions, moments.values, moments.directions, parts.status
    )
