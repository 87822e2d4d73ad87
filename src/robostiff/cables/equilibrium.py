"""A platform in cables: tensions and slack where it is displaced, winches locked, and stability."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.cables.stiffness_matrix import PlacedCables
from robostiff.elastostatics import Tolerance


@dataclass(frozen=True)
class Hanging:
    """A platform in cables whose winches are locked, at some displacement from a first pose."""

    placed: PlacedCables  # at the first pose, a single one
    axial: np.ndarray  # (m,): stiffness of every cable [N/m]
    # (m,): length from exit point to attachment below which a cable is slack [m]
    slack_lengths: np.ndarray
    shift: np.ndarray  # (3,): displacement of the reference point [m]
    R: np.ndarray  # (3, 3): rotation since the first pose

    @classmethod
    def at_rest(cls, placed: PlacedCables, axial: np.ndarray, tensions: np.ndarray) -> Hanging:
        """The platform at the first pose, where the cables have given tensions (m,) [N]."""
        slack = placed.lengths - tensions / axial
        return cls(placed, axial, slack, np.zeros(3), np.eye(3))

    @cached_property
    def now(self) -> PlacedCables:
        """The cables at the present displacement."""
        origin = self.placed.reference_point
        return replace(
            self.placed,
            attachments=origin + self.shift + self.placed.arms @ self.R.T,
            reference_point=origin + self.shift,
            weight_point=origin + self.shift + self.R @ self.placed.weight_arm,
        )

    @cached_property
    def pulls(self) -> np.ndarray:
        """Stiffness times stretch (m,) [N]: the tension, or negative for a slack cable."""
        return self.axial * (self.now.lengths - self.slack_lengths)

    @cached_property
    def tensions(self) -> np.ndarray:
        """Tensions (m,) [N]; zero for slack cables."""
        return np.maximum(self.pulls, 0.0)


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
