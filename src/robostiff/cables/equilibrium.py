"""Rank and stability of a platform in cables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.elastostatics import Tolerance

_ROUNDING = 1e-12


@dataclass(frozen=True)
class Stability:
    """Rank and stability at N poses.

    Attributes
    ----------
    held : (N,) array of int
        Directions in which cables stretch: the rank of the structure matrix.
    rank : (N,) array of int
        Of the stiffness matrix.
    motions : (N, n, n) array
        Columns are displacements in scaled coordinates that do not work on each other's forces.
    free, unstable : (N, n) arrays of bool
        Which of the motions meet no stiffness, and which grow by themselves.
    doubtful : (N,) array of bool
        Whether a decision was close.
    """

    held: np.ndarray
    rank: np.ndarray
    motions: np.ndarray
    free: np.ndarray
    unstable: np.ndarray
    doubtful: np.ndarray


def stability(W: np.ndarray, K: np.ndarray, size: np.ndarray, tolerance: Tolerance) -> Stability:
    """Rank and stability of K at N poses.

    Tension is a thousandth or less of what stretching resists, so a single scale would take its
    part for rounding. The displacements are split: those in which cables stretch are decided by the
    geometry of unit wrenches, as everywhere; in the others the stiffness left after the first have
    condensed, ``K_nn - K_nh K_hh^-1 K_hn``, is compared with that of the tensions.

    Parameters
    ----------
    W : (N, n, m) array
        Structure matrix, moments divided by a characteristic length; zero for slack cables.
    K : (N, n, n) array
        Stiffness matrix, scaled alike [N/m].
    size : (N,) array
        Of the stiffness that tension and weight give [N/m].
    tolerance : Tolerance

    Examples
    --------
    >>> W, K = np.array([[[0.0], [1.0]]]), np.diag([50.0, 1e6])[None]
    >>> pendulum = stability(W, K, np.array([50.0]), Tolerance())
    >>> pendulum.held, pendulum.rank
    (array([1]), array([2]))
    """
    U, values, _ = np.linalg.svd(W)
    held = np.count_nonzero(values > tolerance.independence, axis=-1)
    doubtful = np.any(tolerance.leaves_in_doubt(values), axis=-1)
    free, unstable = np.zeros((2, *K.shape[:-1]), dtype=bool)
    motions = np.empty_like(K)
    for r in np.unique(held):
        rows = held == r
        H, N, K_r = U[rows, :, :r], U[rows, :, r:], K[rows]
        H_T = np.swapaxes(H, -1, -2)
        own, directions = np.linalg.eigh(H_T @ K_r @ H)
        largest = np.abs(own).max(axis=-1, initial=0.0)[:, None]
        doubtful[rows] |= np.any(np.abs(own) <= tolerance.near_rigidity * largest, axis=-1)
        H = H @ directions
        motions[rows, :, :r], unstable[rows, :r] = H, own < -_ROUNDING * largest
        regular = np.all(own != 0, axis=-1)[:, None]
        pushed = np.swapaxes(H, -1, -2) @ K_r @ N
        divisor = np.where(regular, own, 1.0)[:, :, None]
        M = N - H @ np.where(regular[:, :, None], pushed / divisor, 0.0)
        left = np.swapaxes(N, -1, -2) @ K_r @ M
        own, turned = np.linalg.eigh(0.5 * (left + np.swapaxes(left, -1, -2)))
        # Rounding of the large elastic entries reaches the small ones.
        near = np.maximum(tolerance.near_independence * size[rows, None], 1e-13 * largest)
        floor = np.maximum(tolerance.independence * size[rows, None], 1e-15 * largest)
        lost = np.abs(own) <= floor
        motions[rows, :, r:] = M @ turned
        free[rows, r:], unstable[rows, r:] = lost, (own < 0) & ~lost
        doubtful[rows] |= np.any(~lost & (np.abs(own) <= near), axis=-1)
    rank = K.shape[-1] - np.count_nonzero(free, axis=-1)
    return Stability(held, rank, motions, free, unstable, doubtful)
