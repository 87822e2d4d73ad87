"""Virtual work of unit loads: the elastic energy under a load of given size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robostiff.analysis.indices.metric import index_length, length_factors
from robostiff.analysis.indices.stiffness_parts import eigenparts, stiffness_parts
from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import Status


@dataclass(frozen=True)
class VirtualWork:
    """Work of loads of unit size, ``|f|^2 + |m|^2 / L^2 = (1 N)^2``.

    Attributes
    ----------
    worst : float or None
        Largest work over all such loads [J/N^2]; None where some load drives a free motion, or no
        digit of the compliance holds.
    mean : float or None
        Mean over all directions [J/N^2].
    worst_wrench : (n,) array or None
        The load that does most: a force [N] and a moment [N m] about the reference point.
    length : float
        The characteristic length [m].
    status : Status
    """

    about: ClassVar[str] = "1/2 F^T C F over loads of unit size"
    unit: ClassVar[str] = "J/N^2"
    worst: float | None
    mean: float | None
    worst_wrench: np.ndarray | None
    length: float
    status: Status


def virtual_work(result: RobotStiffness, *, length: float | None = None) -> VirtualWork:
    """Work ``1/2 F^T C F`` that unit loads do: the worst, and the mean over all directions.

    Work has one unit, whatever forces and moments have; the length only says which moments count as
    much as a force of 1 N. The mean is tr(S C S) / 2n, S = diag(1, 1, 1, L, L, L). The work of a
    particular load is the energy of `deflection`.

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
    The idea to rate stiffness by virtual work: S. Yan, S. Ong, A. Nee: Stiffness analysis of
    parallelogram-type parallel manipulators using a strain energy method. Robotics and
    Computer-Integrated Manufacturing, 2016. The definition is the one written above.

    Examples
    --------
    >>> import robostiff as rs
    >>> found = virtual_work(rs.stiffness(rs.load("hexapod")), length=0.2)
    >>> found.mean < found.worst
    True
    """
    parts = stiffness_parts(result)
    L = index_length(result, length)
    if parts.C is None:
        unbalanced = parts.rank < parts.space.size
        status = parts.status | Status.UNBALANCED if unbalanced else parts.status
        return VirtualWork(None, None, None, L, status)
    s = length_factors(result, L)
    scaled = eigenparts(parts.C * np.outer(s, s), parts.space.size)
    return VirtualWork(
        worst=float(scaled.values[-1] / 2),
        mean=float(np.mean(scaled.values) / 2),
        worst_wrench=s * scaled.directions[-1],
        length=L,
        status=parts.status,
    )
