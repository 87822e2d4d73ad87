"""Eigenvalues of K with rotations multiplied by a length, or in a metric, and what follows."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.free_motion import FreeMotion
from robostiff.analysis.indices.stiffness_parts import eigenparts, stiffness_parts
from robostiff.analysis.result import Stiffness
from robostiff.elastostatics import Status, scaling
from robostiff.errors import InputError
from robostiff.frozen import frozen
from robostiff.spatial import as_float, as_floats, screw_of_twist

_SHORTEST = 1e-30  # [m]; the largest number there may be is its inverse


def index_length(result: Stiffness, length: float | None) -> float:
    """The characteristic length [m]: the one given, or the robot's own at its pose."""
    if length is None:
        return float(result.length)
    expected = f"a length above 0, from {_SHORTEST:.0e} m"
    L = as_float("characteristic length", length, expected, "m")
    if L < _SHORTEST:
        raise InputError("characteristic length", got=length, expected=expected)
    return L


def checked_metric(metric: ArrayLike, size: int) -> np.ndarray:
    """A symmetric positive definite matrix (n, n) that measures twists."""
    expected = f"a symmetric positive definite matrix {size} x {size}, in units 1, m, m^2"
    M = as_floats("metric", metric, expected, shape=(size, size))
    sizes = np.sqrt(np.maximum(np.diag(M), 0.0))
    if np.any(np.abs(M - M.T) > 1e-12 * np.outer(sizes, sizes)):
        raise InputError("metric", got=metric, expected=expected, hint="make it symmetric")
    symmetric = 0.5 * (M + M.T)
    if np.any(sizes == 0) or np.linalg.eigvalsh(symmetric / np.outer(sizes, sizes))[0] < 1e-12:
        raise InputError(
            "metric", got=metric, expected=expected, hint="write diag(1, 1, 1, L^2, L^2, L^2)"
        )
    return symmetric


@frozen
class Eigenstiffness:
    """Eigenvalues of K in a metric, and the motions that they belong to.

    Attributes
    ----------
    values : (n,) array
        Ascending [N/m]; exactly zero for free motions.
    twists : (n, n) array
        Rows; of unit size in the metric, and conjugate to one another in it and in K.
    motions : tuple of FreeMotion
        The same in words; those with a value of zero are free.
    length : float or None
        The characteristic length [m]; None where a metric was given.
    status : Status
    """

    about: ClassVar[str] = "K x = k M x, with rotations measured in lengths"
    unit: ClassVar[str] = "N/m"
    values: np.ndarray
    twists: np.ndarray
    motions: tuple[FreeMotion, ...]
    length: float | None
    status: Status


def eigenstiffness(
    result: Stiffness, *, length: float | None = None, metric: ArrayLike | None = None
) -> Eigenstiffness:
    """Eigenvalues k of ``K x = k M x``, M = diag(1, 1, 1, L^2, L^2, L^2) unless another is given.

    The eigenvalues of K itself depend on units: its entries have four units, and metres rank its
    directions otherwise than millimetres do. With M they are stiffnesses [N/m], but they depend on
    M and on the reference point. A metric with a meaning is the inertia of what the platform
    carries over its mass: then k m is the square of a natural frequency, whatever the point.

    Parameters
    ----------
    result : Stiffness
    length : float, optional
        The characteristic length L [m]; the robot's own at the pose when left out.
    metric : (n, n) array-like, optional
        M in place of a length, about the reference point, in world axes.

    Raises
    ------
    InputError
        For both a length and a metric, or ones that do not measure.

    References
    ----------
    Length: O. Ma, J. Angeles: Optimum architecture design of platform manipulators. ICAR 1991.
    Normalisation by an eigenvalue problem that the inertia of the system itself provides:
    J. Kövecses, S. Ebrahimi: Parameter analysis and normalization for the dynamics and design of
    multibody systems. Journal of Computational and Nonlinear Dynamics 4, 2009.

    Examples
    --------
    >>> import robostiff as rs
    >>> found = eigenstiffness(rs.stiffness(rs.load("gough-stewart-b")), length=0.2)
    >>> (found.values / 1e6).round(1)
    array([ 67.6,  67.6, 305. , 462.7, 521.5, 521.5])
    """
    parts = stiffness_parts(result)
    n = parts.space.size
    if metric is not None and length is not None:
        raise InputError("length and metric", expected="one of them")
    if metric is None:
        L = index_length(result, length)
        inverse_root = np.diag(1 / scaling(np.array(L), parts.space))
    else:
        L = None
        inverse_root = np.linalg.inv(np.linalg.cholesky(checked_metric(metric, n)))
    eigen = eigenparts(inverse_root @ parts.K @ inverse_root.T, parts.rank)
    twists = eigen.directions @ inverse_root
    own = result.reference_point, float(result.length)
    screws = (screw_of_twist(twist, *own) for twist in parts.space.spatial(twists))
    motions = tuple(map(FreeMotion, twists, screws))
    return Eigenstiffness(eigen.values, twists, motions, L, parts.status)


@frozen
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


def condition_number(result: Stiffness, *, length: float | None = None) -> ConditionNumber:
    """Condition numbers of S^-1 K S^-1, S = diag(1, 1, 1, L, L, L), in two norms.

    The two-norm looks at the extremes alone, Frobenius' at all directions and is smooth where
    eigenvalues cross, which optimisers like. Both depend on the length and on the reference point.

    Parameters
    ----------
    result : Stiffness
    length : float, optional
        L [m]; the robot's own at the pose when left out.

    Raises
    ------
    InputError
        For a length that is not positive.

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
    s = scaling(np.array(L), parts.space)
    scale = np.outer(s, s)
    K, C = parts.K / scale, parts.C * scale
    values = np.linalg.eigvalsh(K)
    two_norm = float(values[-1] * np.linalg.eigvalsh(C)[-1])
    frobenius = float(np.linalg.norm(K) * np.linalg.norm(C) / len(K))
    return ConditionNumber(two_norm, frobenius, L, parts.status)


@frozen
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


def virtual_work(result: Stiffness, *, length: float | None = None) -> VirtualWork:
    """Work ``1/2 F^T C F`` that unit loads do: the worst, and the mean over all directions.

    Work has one unit, whatever forces and moments have; the length only says which moments count as
    much as a force of 1 N. The mean is tr(S C S) / 2n, S = diag(1, 1, 1, L, L, L). The work of a
    particular load is the energy of `deflection`.

    Parameters
    ----------
    result : Stiffness
    length : float, optional
        L [m]; the robot's own at the pose when left out.

    Raises
    ------
    InputError
        For a length that is not positive.

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
    s = scaling(np.array(L), parts.space)
    scaled = eigenparts(parts.C * np.outer(s, s), parts.space.size)
    return VirtualWork(
        worst=float(scaled.values[-1] / 2),
        mean=float(np.mean(scaled.values) / 2),
        worst_wrench=s * scaled.directions[-1],
        length=L,
        status=parts.status,
    )
