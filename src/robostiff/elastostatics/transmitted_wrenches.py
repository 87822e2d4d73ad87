"""The wrenches that a chain of passive joints can transmit: a basis W of null(J_q^T)."""

from __future__ import annotations

import numpy as np

from robostiff.elastostatics.tolerance import Tolerance
from robostiff.spatial.shapes import Bool, Float

_ROUNDING = 4 * np.finfo(float).eps


def transmitted_wrenches(
    J_q: Float[np.ndarray, "*batch n q"], independence: float = 1e-9
) -> tuple[Float[np.ndarray, "*batch n m"], Bool[np.ndarray, "*batch q"]]:
    """Orthonormal wrenches W with W^T J_q = 0, and the joints that add no freedom.

    The dual of the recursion (15): all wrenches are transmitted to begin with, and each passive
    joint in turn removes the one that would drive it, by a Householder reflection of the columns of
    W: the rank of K drops by one a joint, eq. (16). A joint that no transmitted wrench drives is
    redundant and removes nothing.

    Parameters
    ----------
    J_q : (..., n, q) array
        Twists of the passive joints, scaled by a characteristic length.
    independence : float
        A joint is redundant when its unit twist lies nearer than this to the span of those before.

    Returns
    -------
    W : (..., n, m) array
        Orthonormal columns. Poses of a batch may transmit different numbers of wrenches; m is the
        largest, and zero columns fill the rest.
    redundant : (..., q) array of bool

    Examples
    --------
    A hinge about z transmits everything but the moment about z:

    >>> W, redundant = transmitted_wrenches(np.array([[0.0], [0.0], [1.0]]))
    >>> np.abs(W[2]).max(), redundant
    (np.float64(0.0), array([False]))
    """
    W, margins = wrenches_and_margins(J_q, independence)
    return W, margins <= independence


def unit_twists_and_wrenches(
    J_scaled: Float[np.ndarray, "*batch n q"],
    tolerance: Tolerance,
    present: Bool[np.ndarray, "*batch q"] | None = None,
) -> tuple[
    Float[np.ndarray, "*batch n q"], Float[np.ndarray, "*batch n m"], Float[np.ndarray, "*batch q"]
]:
    """Scaled twists of unit size, and the result of `wrenches_and_margins` for them.

    `present` marks the columns that exist: poses may differ in their number, and zero columns,
    whose margin is 1, fill up.
    """
    size = np.sqrt(np.einsum("...nq,...nq->...q", J_scaled, J_scaled))
    unit = J_scaled / np.where(size > 0, size, 1.0)[..., None, :]
    W, margins = wrenches_and_margins(unit, tolerance.independence)
    return unit, W, margins if present is None else np.where(present, margins, 1.0)


def wrenches_and_margins(
    J_q: Float[np.ndarray, "*batch n q"], independence: float
) -> tuple[Float[np.ndarray, "*batch n m"], Float[np.ndarray, "*batch q"]]:
    """Transmitted wrenches, and how far each unit twist lies from the span of those before it.

    As `transmitted_wrenches`, but with the distances (..., q) that decide redundancy; they are
    those of unit twists, so 1 is a joint that owes nothing to the others.
    """
    n, joints = J_q.shape[-2:]
    W = np.broadcast_to(np.eye(n), (*J_q.shape[:-2], n, n))
    margins = np.zeros((*J_q.shape[:-2], joints))
    for i in range(joints):
        column = J_q[..., i]
        drive = np.einsum("...nm,...n->...m", W, column)
        size = np.sqrt(np.einsum("...m,...m->...", drive, drive))
        whole = np.sqrt(np.einsum("...n,...n->...", column, column))
        margins[..., i] = size / np.where(whole > 0, whole, 1.0)
        lost = margins[..., i] <= independence
        if not np.any(lost):
            W = _without(W, drive, size)
        elif not np.all(lost):  # poses that decide differently, each group on its own
            several, margins = np.zeros((*lost.shape, n, n)), np.zeros((*lost.shape, joints))
            for group in (lost, ~lost):
                own, margins[group] = wrenches_and_margins(J_q[group], independence)
                several[group, :, : own.shape[-1]] = own
            return several, margins
    # Unit vectors carry no smaller parts than these: an axis-aligned chain keeps its exact zeros.
    return np.where(np.abs(W) <= _ROUNDING, 0.0, W), margins


def _without(W: np.ndarray, drive: np.ndarray, size: np.ndarray | np.floating) -> np.ndarray:
    """Reflect the columns so that the first alone drives the joint, and drop it."""
    first = drive[..., 0]
    leading = first + np.copysign(size, first)
    towards = np.einsum("...nm,...m->...n", W, drive) + W[..., 0] * (leading - first)[..., None]
    towards = towards / (size * np.abs(leading))[..., None]
    return W[..., 1:] - towards[..., :, None] * drive[..., None, 1:]
