"""Condition numbers of K with rotations multiplied by a length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robostiff.analysis.indices.metric import index_length, length_factors
from robostiff.analysis.indices.stiffness_parts import stiffness_parts
from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import Status


@dataclass(frozen=True)
class ConditionNumber:
    """Condition numbers of K: 1 where it is the same in all directions, otherwise larger.

    Attributes
    ----------
    two_norm : float or None
        Largest over smallest eigenvalue of the scaled K; None where K is singular.
    frobenius : float or None
        ``|K|_F |C|_F / n`` of the scaled matrices.
    length : float
        The characteristic length [m].
    status : Status
    """

    about: ClassVar[str] = "of K with rotations measured in lengths"
    unit: ClassVar[str] = "1"
    two_norm: float | None
    frobenius: float | None
    length: float
    status: Status

    @property
    def isotropy(self) -> float:
        """One over the condition number of the two-norm: 1 at best, 0 where K is singular."""
        return 0.0 if self.two_norm is None else 1 / self.two_norm


def condition_number(result: RobotStiffness, *, length: float | None = None) -> ConditionNumber:
    """Condition numbers of S^-1 K S^-1, S = diag(1, 1, 1, L, L, L), in two norms.

    The two-norm looks at the extremes alone, Frobenius' at all directions and is smooth where
    eigenvalues cross, which optimisers like. Both depend on the length and on the reference point.

    Parameters
    ----------
    result : RobotStiffness
        Of a single pose.
    length : float, optional
        L [m]; the robot's own at the pose when left out.

    Raises
    ------
    InputError
        For a batch, or a length that is not positive.
    NoAnswerError
        For a pose without a matrix.

    References
    ----------
    G. Carbone, M. Ceccarelli: Comparison of indices for stiffness performance evaluation. Frontiers
    of Mechanical Engineering in China 5(3), 2010.

    Examples
    --------
    >>> import robostiff as rs
    >>> found = condition_number(rs.stiffness(rs.load("gough-stewart-b")), length=0.2)
    >>> round(found.two_norm, 2), round(found.frobenius, 2)
    (7.71, 3.32)
    """
    parts = stiffness_parts(result)
    L = index_length(result, length)
    if parts.C is None:
        return ConditionNumber(None, None, L, parts.status)
    s = length_factors(result, L)
    scale = np.outer(s, s)
    K, C = parts.K / scale, parts.C * scale
    values = np.linalg.eigvalsh(K)
    two_norm = float(values[-1] * np.linalg.eigvalsh(C)[-1])
    frobenius = float(np.linalg.norm(K) * np.linalg.norm(C) / len(K))
    return ConditionNumber(two_norm, frobenius, L, parts.status)
