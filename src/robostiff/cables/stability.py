"""Rank and stability of cable robots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.elastostatics import Tolerance

_ROUNDING = 1e-12


@dataclass(frozen=True)
class Stability:
    """Rank and stability at one pose; columns are displacements in scaled coordinates.

    Attributes
    ----------
    held : int
        Directions in which cables stretch: the rank of the structure matrix.
    rank : int
        Of the stiffness matrix.
    free : (n, f) array
        Motions without stiffness.
    unstable : (n, u) array
        Motions that grow by themselves.
    doubtful : bool
        Whether a decision was close.
    """

    held: int
    rank: int
    free: np.ndarray
    unstable: np.ndarray
    doubtful: bool


def stability(W: np.ndarray, K: np.ndarray, size: float, tolerance: Tolerance) -> Stability:
    """Rank and stability of K at one pose.

    Tension is a thousandth or less of what stretching resists, so a single scale would take its
    part for rounding. The displacements are split: those in which cables stretch are decided by the
    geometry of unit wrenches, as everywhere; in the others the stiffness left after the first have
    condensed, ``K_nn - K_nh K_hh^-1 K_hn``, is compared with that of the tensions.

    Parameters
    ----------
    W : (n, m) array
        Structure matrix of the cables that count, moments divided by a characteristic length.
    K : (n, n) array
        Stiffness matrix, scaled alike [N/m].
    size : float
        Of the stiffness that tension and weight give [N/m].
    tolerance : Tolerance

    Examples
    --------
    >>> pendulum = stability(np.array([[0.0], [1.0]]), np.diag([50.0, 1e6]), 50.0, Tolerance())
    >>> pendulum.held, pendulum.rank
    (1, 2)
    """
    n = len(K)
    U, values, _ = np.linalg.svd(W)
    r = int(np.count_nonzero(values > tolerance.independence))
    doubtful = bool(np.any(tolerance.leaves_in_doubt(values)))
    H, N = U[:, :r], U[:, r:]
    held, directions = np.linalg.eigh(H.T @ K @ H)
    largest = np.abs(held).max(initial=0.0)
    doubtful |= bool(np.any(np.abs(held) <= tolerance.near_rigidity * largest))
    unstable = [H @ directions[:, held < -_ROUNDING * largest]]
    if r == n:
        return Stability(r, n, np.zeros((n, 0)), unstable[0], doubtful)
    follow = np.zeros((r, n - r))
    if r and not np.any(held == 0):
        follow = -directions @ ((directions.T @ (H.T @ K @ N)) / held[:, None])
    left = N.T @ K @ (N + H @ follow)
    own, turned = np.linalg.eigh(0.5 * (left + left.T))
    motions = (N + H @ follow) @ turned
    # Rounding of the large elastic entries reaches the small ones.
    floor = max(tolerance.independence * size, 1e-15 * largest)
    lost = np.abs(own) <= floor
    unstable.append(motions[:, (own < 0) & ~lost])
    near = ~lost & (np.abs(own) <= max(tolerance.near_independence * size, 1e-13 * largest))
    return Stability(
        held=r,
        rank=n - int(np.count_nonzero(lost)),
        free=motions[:, lost],
        unstable=np.concatenate(unstable, axis=-1),
        doubtful=bool(doubtful or near.any()),
    )
