"""The worst deflection: the largest displacement that a unit force can cause, and which does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robostiff.analysis.indices.stiffness_parts import Part, stiffness_parts
from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import Status


@dataclass(frozen=True)
class WorstDeflection:
    """Largest displacement per unit force, largest rotation per unit moment, and their directions.

    Attributes
    ----------
    translational : float or None
        Displacement of the reference point per force through it [m/N]; None where some force
        meets no stiffness.
    translational_direction : (d,) array
        Of that force and of the displacement; of a force that meets none where there is one.
    rotational : float or None
        Rotation per moment [rad/(N m)]; None where some moment meets no stiffness.
    rotational_direction : (r,) array
    status : Status
        ``UNBALANCED`` as well where one of them is None because of a free motion.
    """

    about: ClassVar[str] = "over all directions of a unit force, and of a unit moment"
    units: ClassVar[tuple[str, str]] = ("m/N", "rad/(N m)")
    translational: float | None
    translational_direction: np.ndarray
    rotational: float | None
    rotational_direction: np.ndarray
    status: Status


def worst_deflection(result: RobotStiffness) -> WorstDeflection:
    """Largest eigenvalues of C_tt and C_rr: the most that unit vectors u make of ``|C_tt u|``.

    The force acts through the reference point and the platform may turn; displacement and force
    are parallel at the worst, so that this is one over the least collinear stiffness.

    Parameters
    ----------
    result : RobotStiffness
        Of a single pose; maps have `Quantity.WORST_DEFLECTION`.

    Raises
    ------
    InputError, NoAnswerError
        For a batch; for a pose without a matrix.

    Examples
    --------
    >>> import robostiff as rs
    >>> worst = worst_deflection(rs.stiffness(rs.load("hexapod")))
    >>> print(f"{1e6 * worst.translational:.4f} um/N")
    0.0559 um/N
    >>> print(worst_deflection(rs.stiffness(rs.load("gough-stewart-a"))).translational)
    None
    """
    parts = stiffness_parts(result)
    forces, moments = parts.forces_rotations_free, parts.moments_translations_free
    translational, rotational = _largest(forces), _largest(moments)
    status = parts.status
    if parts.rank < parts.space.size and (translational is None or rotational is None):
        status |= Status.UNBALANCED
    return WorstDeflection(
        translational, forces.directions[0], rotational, moments.directions[0], status
    )


def _largest(part: Part) -> float | None:
    return float(1 / part.values[0]) if part.values[0] > 0 else None
