"""Stability: the energy of a loaded robot beside that of the unloaded one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from robostiff.statics.legs import LegGroup
from robostiff.statics.problem import EquilibriumProblem, Linearised

# Of the largest eigenvalue: below this there is no stiffness.
_NONE = 1e-10
# Of the largest curvature: what rounding leaves of none.
_ROUNDING = 1e-8
# Condition of a root of the elastic energy up to which it is positive definite beyond doubt.
_CLEARLY = 1e4
# Diagonal entry of a triangular factor, of the largest, above which closures are independent.
_INDEPENDENT = 1e-6


@dataclass(frozen=True)
class Margin:
    """How far the energy is from losing its minimum.

    Attributes
    ----------
    value : float
        Least ratio of the curvature of the energy under load to that of the elastic energy without
        load, over all motions that do not tear the robot apart: 1 without load, 0 at the critical
        load, negative beyond it. Where nothing elastic resists some motion, the sign alone has a
        meaning; 0 if nothing resists it under load, either.
    form : (k, k) array
        Its eigenvector of the least eigenvalue is that motion, in coordinates of its own.
    basis : (n, k) array
        Columns: motions that these are.
    """

    value: float
    form: np.ndarray
    basis: np.ndarray

    @property
    def mode(self) -> np.ndarray:
        """The motion that has it (n,)."""
        if not len(self.form):
            return np.zeros(len(self.basis))
        return self.basis @ np.linalg.eigh(self.form)[1][:, 0]

    def among(self, motions: np.ndarray) -> Margin:
        """The same in coordinates of which the columns of a matrix are its own."""
        return replace(self, basis=motions @ self.basis)


def margin(Q: np.ndarray, Q0: np.ndarray) -> Margin:
    """Least ratio of two quadratic forms (n, n), the second positive semidefinite.

    Examples
    --------
    >>> round(margin(np.diag([1.0, 6.0]), np.diag([2.0, 8.0])).value, 12)
    0.5
    """
    n = len(Q)
    if n == 0:
        return Margin(1.0, Q, Q)
    Q, Q0 = 0.5 * (Q + Q.T), 0.5 * (Q0 + Q0.T)
    w, V = np.linalg.eigh(Q0)
    held = w > _NONE * max(w[-1], 0.0)
    largest = max(float(np.max(np.abs(Q))), float(w[-1]))
    if not np.all(held):
        own = np.linalg.eigvalsh(Q)
        if not np.any(held) or own[0] < -_ROUNDING * largest:
            least = own[0] / largest if largest > 0 else 0.0
            return Margin(least if abs(least) > _ROUNDING else 0.0, Q, np.eye(n))
        free = V[:, ~held]
        along = free.T @ Q @ free
        if np.linalg.eigvalsh(along)[0] < _ROUNDING * largest:
            return Margin(0.0, along, free)
    T = V[:, held] / np.sqrt(w[held])
    form = T.T @ Q @ T
    return Margin(float(np.linalg.eigvalsh(form)[0]), form, T)


def _margins(Q: np.ndarray, Q0: np.ndarray) -> list[Margin]:
    """Of pairs of forms (N, n, n); at once where the second of all are clearly positive definite.

    With ``Q0 = L L^T`` the ratios are the eigenvalues of ``L^-1 Q L^-T``.
    """
    if Q.shape[-1] == 0:
        return [margin(q, q0) for q, q0 in zip(Q, Q0, strict=True)]
    try:
        L = np.linalg.cholesky(0.5 * (Q0 + np.swapaxes(Q0, -1, -2)))
        inverse = np.linalg.inv(L)
    except np.linalg.LinAlgError:
        return [margin(q, q0) for q, q0 in zip(Q, Q0, strict=True)]
    if not np.all(_norm(L) * _norm(inverse) < _CLEARLY):
        return [margin(q, q0) for q, q0 in zip(Q, Q0, strict=True)]
    form = inverse @ (0.5 * (Q + np.swapaxes(Q, -1, -2))) @ np.swapaxes(inverse, -1, -2)
    ratios = np.linalg.eigvalsh(form)[:, 0]
    parts = zip(ratios, form, inverse, strict=True)
    return [Margin(float(r), own, unit.T) for r, own, unit in parts]


def _norm(A: np.ndarray) -> np.ndarray:
    """Frobenius norms of matrices (N, n, n)."""
    return np.sqrt(np.sum(A * A, axis=(-1, -2)))


def platform_margin(problem: EquilibriumProblem, known: Linearised, unloaded: Linearised) -> Margin:
    """Of the platform, legs in equilibrium; its mode is a twist (r,)."""
    scale = np.outer(problem.scale, problem.scale)
    free = np.eye(problem.size) if known.held is None else known.held.free
    found = margin(free.T @ (known.K_total / scale) @ free, free.T @ (unloaded.K / scale) @ free)
    return found.among(free / problem.scale[:, None])


def leg_margins(problem: EquilibriumProblem, known: Linearised) -> dict[int, Margin]:
    """Of each leg with the platform held, by its index; modes are coordinates and bodies."""
    found = {}
    for group, eq in zip(problem.groups, known.equations, strict=True):
        m = group.free_size
        if m <= eq.A.shape[1] - m:
            continue  # the platform holds all coordinates
        own = margins_of(group, eq.A[:, :m, :m], eq.A[:, m:, :m])
        # legs that share springs have one margin, under the first of them
        found |= dict(zip(group.indices[: group.count], own, strict=True))
    # A margin of 0 is that of a joint that nothing holds, such as the spin of a rod.
    return {index: own for index, own in found.items() if own is not None and own.value != 0.0}


def margins_of(group: LegGroup, Q: np.ndarray, C: np.ndarray) -> list[Margin | None]:
    """Of legs built alike; None for one that the platform holds."""
    Q0 = group.unloaded_curvature
    stiff = np.diagonal(Q0, axis1=-2, axis2=-1)
    # Unit energy where there is any, unit motion elsewhere.
    scale = np.where(stiff > 0, 1.0 / np.sqrt(np.where(stiff > 0, stiff, 1.0)), 1.0)
    norms = np.linalg.norm(C * scale[:, None], axis=1)
    for own, elastic, passive, size in zip(
        scale, (stiff > 0) & (norms > 0), (stiff == 0) & (norms > 0), norms, strict=True
    ):
        if np.any(elastic):
            own[passive] = np.median(size[elastic]) / size[passive]
    columns = C * scale[:, None]
    rows = np.linalg.norm(columns, axis=2)
    columns = columns / np.where(rows > 0, rows, 1.0)[..., None]
    found: list[Margin | None] = [None] * len(Q)
    for legs, motions in _left_by(columns):
        N = motions * scale[legs, :, None]
        across = np.swapaxes(N, -1, -2)
        pairs = across @ Q[legs] @ N, across @ Q0[legs] @ N
        for leg, own, least in zip(legs, N, _margins(*pairs), strict=True):
            found[leg] = least.among(own)
    return found


def _left_by(C: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Legs and motions (legs, m, k), orthonormal, on which closures (N, c, m) of one rank vanish.

    None where they leave no motion.
    """
    count, m = C.shape[1:]
    if count < m:
        V, R = np.linalg.qr(np.swapaxes(C, -1, -2), mode="complete")
        size = np.abs(np.diagonal(R, axis1=-2, axis2=-1))
        if np.all(size > _INDEPENDENT * size.max(axis=-1, initial=0.0, keepdims=True)):
            yield np.arange(len(C)), V[..., count:]
            return
    _, values, Vt = np.linalg.svd(C)
    ranks = np.sum(values > _NONE * values[:, :1], axis=1)
    for rank in np.unique(ranks[ranks < m]):
        legs = np.flatnonzero(ranks == rank)
        yield legs, np.swapaxes(Vt[legs, rank:], -1, -2)
