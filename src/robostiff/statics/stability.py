"""Stability: the energy of a loaded robot beside that of the unloaded one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.statics.legs import LegGroup
from robostiff.statics.problem import EquilibriumProblem, Linearised

# Of the largest eigenvalue: below this there is no stiffness.
_NONE = 1e-10
# Of the largest curvature: what rounding leaves of none.
_ROUNDING = 1e-8


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
    mode : (n,) array
        The motion that has it.
    """

    value: float
    mode: np.ndarray


def margin(Q: np.ndarray, Q0: np.ndarray) -> Margin:
    """Least ratio of two quadratic forms (n, n), the second positive semidefinite.

    Examples
    --------
    >>> round(margin(np.diag([1.0, 6.0]), np.diag([2.0, 8.0])).value, 12)
    0.5
    """
    n = len(Q)
    if n == 0:
        return Margin(1.0, np.zeros(0))
    Q, Q0 = 0.5 * (Q + Q.T), 0.5 * (Q0 + Q0.T)
    w, V = np.linalg.eigh(Q0)
    held = w > _NONE * max(w[-1], 0.0)
    largest = max(float(np.max(np.abs(Q))), float(w[-1]))
    if not np.all(held):
        own, vectors = np.linalg.eigh(Q)
        if not np.any(held) or own[0] < -_ROUNDING * largest:
            least = own[0] / largest if largest > 0 else 0.0
            return Margin(least if abs(least) > _ROUNDING else 0.0, vectors[:, 0])
        free = V[:, ~held]
        along = np.linalg.eigvalsh(free.T @ Q @ free)
        if along[0] < _ROUNDING * largest:
            return Margin(0.0, free[:, 0])
    T = V[:, held] / np.sqrt(w[held])
    ratios, vectors = np.linalg.eigh(T.T @ Q @ T)
    return Margin(float(ratios[0]), T @ vectors[:, 0])


def _margins(Q: np.ndarray, Q0: np.ndarray) -> list[Margin]:
    """Of pairs of forms (N, n, n); at once where the second of all are positive definite."""
    if Q.shape[-1] == 0:
        return [margin(q, q0) for q, q0 in zip(Q, Q0, strict=True)]
    w, V = np.linalg.eigh(0.5 * (Q0 + np.swapaxes(Q0, -1, -2)))
    if not np.all(w > _NONE * np.maximum(w[:, -1:], 0.0)):
        return [margin(q, q0) for q, q0 in zip(Q, Q0, strict=True)]
    T = V / np.sqrt(w)[:, None]
    form = 0.5 * (Q + np.swapaxes(Q, -1, -2))
    ratios, vectors = np.linalg.eigh(np.swapaxes(T, -1, -2) @ form @ T)
    modes = (T @ vectors[..., :1])[..., 0]
    return [Margin(float(r), mode) for r, mode in zip(ratios[:, 0], modes, strict=True)]


def platform_margin(problem: EquilibriumProblem, known: Linearised, unloaded: Linearised) -> Margin:
    """Of the platform, legs in equilibrium; its mode is a twist (r,)."""
    scale = np.outer(problem.scale, problem.scale)
    free = np.eye(problem.size) if known.held is None else known.held.free
    found = margin(free.T @ (known.K_total / scale) @ free, free.T @ (unloaded.K / scale) @ free)
    return Margin(found.value, free @ found.mode / problem.scale)


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
    _, values, Vt = np.linalg.svd(columns)
    ranks = np.sum(values > _NONE * values[:, :1], axis=1)
    found: list[Margin | None] = [None] * len(Q)
    for rank in np.unique(ranks):
        if rank == Q.shape[1]:
            continue
        legs = np.flatnonzero(ranks == rank)
        N = np.swapaxes(Vt[legs, rank:], -1, -2) * scale[legs, :, None]
        across = np.swapaxes(N, -1, -2)
        pairs = across @ Q[legs] @ N, across @ Q0[legs] @ N
        for leg, own, least in zip(legs, N, _margins(*pairs), strict=True):
            found[leg] = Margin(least.value, own @ least.mode)
    return found
