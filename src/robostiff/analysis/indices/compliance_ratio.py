"""Ratio of the compliances in different directions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robostiff.analysis.indices.stiffness_parts import EigenPart, stiffness_parts
from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import Status


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
