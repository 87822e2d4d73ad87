"""The system over leg wrenches, from which compliance and the loads of the legs follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.elastostatics.conjugate_wrenches import alike, eliminated
from robostiff.elastostatics.tolerance import Tolerance
from robostiff.spatial.batch import transposed
from robostiff.spatial.shapes import Bool, Float


@dataclass(frozen=True)
class LeastEnergy:
    """Shares of wrenches in parallel in a load, in scaled coordinates.

    Attributes
    ----------
    shares : (..., m, n) array
        Size of each elastic unit wrench, per load.
    rigid_shares : (..., k, n) array
        Size of each rigid one. Where rigid wrenches balance one another, the least.
    modes : (..., m, n) array
        What each elastic wrench feels of a load: a load F stores the energy ``|modes F|^2 / 2``.
        Loads that rigid wrenches carry alone store none.
    doubtful : (...) array of bool
        Where rounding leaves fewer than nine digits.
    """

    shares: Float[np.ndarray, "*batch m n"]
    rigid_shares: Float[np.ndarray, "*batch k n"]
    modes: Float[np.ndarray, "*batch m n"]
    doubtful: Bool[np.ndarray, "*batch"]

    @property
    def compliance(self) -> Float[np.ndarray, "*batch n n"]:
        """Twists for loads that are carried, ``t = C F``; zero for the others."""
        C = transposed(self.modes) @ self.modes
        return 0.5 * (C + transposed(C))


def least_energy(
    unit: Float[np.ndarray, "*batch n m"],
    compliance: Float[np.ndarray, "*batch m"],
    rigid: Float[np.ndarray, "*batch n k"],
    rank: np.ndarray,
    tolerance: Tolerance,
) -> LeastEnergy:
    """The sizes f, z of wrenches in parallel that carry a load with the least energy (Castigliano).

    They solve::

        sum of c_j f_j^2 / 2 -> min,  U f + H z = F

    with unit wrenches U that meet the compliances c and wrenches H that meet none. The multiplier
    is the twist t = C F. H takes all that it can; the rest goes to U, in equilibrium by one
    solution, and without energy to lose by what stresses of the legs against each other can take
    over. All ranks are of unit wrenches.

    Parameters
    ----------
    unit : (..., n, m) array
        Of all legs beside one another, as in `ConjugateWrenches`.
    compliance : (..., m) array
    rigid : (..., n, k) array
    rank : (...) array of int
        How many of all wrenches are independent.
    tolerance : Tolerance

    Examples
    --------
    Two springs along x, and a rigid rod along y:

    >>> unit, rigid = np.array([[1.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]])
    >>> found = least_energy(unit, np.array([1.0, 3.0]), rigid, np.array(2), Tolerance())
    >>> found.compliance.round(12), found.shares[:, 0].round(12)
    (array([[0.75, 0.  ],
           [0.  , 0.  ]]), array([0.75, 0.25]))
    """
    n, m = unit.shape[-2:]
    k, batch = rigid.shape[-1], unit.shape[:-2]
    elastic, stiff = compliance > 0, np.any(rigid != 0, axis=-2)
    by_rigid = np.zeros(batch, dtype=int)
    if np.any(stiff):
        values = np.linalg.svd(rigid, compute_uv=False)
        by_rigid = np.count_nonzero(values > tolerance.independence, axis=-1)
    shares, modes = np.zeros((*batch, m, n)), np.zeros((*batch, m, n))
    rigid_shares, doubtful = np.zeros((*batch, k, n)), np.zeros(batch, dtype=bool)
    ranks = np.stack([by_rigid, np.broadcast_to(rank, batch)], axis=-1)
    for group, decision in alike(np.concatenate([elastic, stiff, ranks], axis=-1)):
        own, of_rigid = np.flatnonzero(decision[:m]), np.flatnonzero(decision[m : m + k])
        found = _shared(
            unit[group][..., own],
            compliance[group][..., own],
            rigid[group][..., of_rigid],
            int(decision[-2]),
            int(decision[-1]),
        )
        shares[group], modes[group] = _in_rows(found.shares, own, m), _in_rows(found.modes, own, m)
        rigid_shares[group] = _in_rows(found.rigid_shares, of_rigid, k)
        doubtful[group] = found.doubtful
    return LeastEnergy(shares, rigid_shares, modes, doubtful)


def _shared(U: np.ndarray, c: np.ndarray, H: np.ndarray, by_rigid: int, rank: int) -> LeastEnergy:
    """As `least_energy`, for poses at which as many wrenches are independent."""
    n = U.shape[-2]
    Q, to_rigid = np.eye(n), np.zeros((*H.shape[:-2], 0, n))
    if H.shape[-1]:
        V, values, Zt = np.linalg.svd(H)
        inverse = 1.0 / values[..., :by_rigid, None]
        to_rigid = transposed(Zt[..., :by_rigid, :]) @ (inverse * transposed(V[..., :, :by_rigid]))
        Q = V[..., :, by_rigid:]
    by_elastic = rank - by_rigid
    A, values, Bt = np.linalg.svd(transposed(Q) @ U)
    A = A[..., :, :by_elastic]
    # What carries each of the directions A with the least wrenches, and stresses that carry none.
    carried = transposed(Bt[..., :by_elastic, :]) / values[..., None, :by_elastic]
    idle = transposed(Bt[..., by_elastic:, :])
    both = np.concatenate([idle, carried], axis=-1)
    root = np.sqrt(c)
    row = np.sqrt(np.einsum("...mk,...mk->...m", both, both))
    _, carried, blurred = eliminated(root[..., None] * both, both, root * row, idle.shape[-1])
    directions = transposed(Q @ A)
    shares = carried @ directions
    rigid_shares = to_rigid @ (np.eye(n) - U @ shares) if H.shape[-1] else to_rigid
    return LeastEnergy(shares, rigid_shares, root[..., None] * shares, blurred)


def _in_rows(values: np.ndarray, rows: np.ndarray, count: int) -> np.ndarray:
    if len(rows) == count:
        return values
    placed = np.zeros((*values.shape[:-2], count, values.shape[-1]))
    placed[..., rows, :] = values
    return placed
