"""What a parallel block is inside a chain: the compliance of its least energy, and its freedoms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from robostiff.elastostatics.block_diagonal import block_diagonal
from robostiff.elastostatics.tolerance import Tolerance, scaling
from robostiff.elastostatics.transmitted_wrenches import unit_twists_and_wrenches
from robostiff.spatial import Space

_ROUNDING = 4 * np.finfo(float).eps
# Energies of unit ways within this part of one another are compared as they are.
_ALIKE = 1e-6


@dataclass(frozen=True)
class BlockCompliance:
    """A parallel block as an element of a chain, about a point and in world axes.

    Attributes
    ----------
    C : (..., n, n) array
        Compliance of the body after the block against the one before, for the wrenches that the
        block transmits; zero for the others.
    J_q : (..., n, f) array
        Twists that meet no stiffness: its freedoms. Poses may have different numbers of them; zero
        columns fill up.
    present : (..., f) array of bool
        Which columns are freedoms.
    shares : (..., b, n, n) array
        Wrench that each branch carries, per wrench that the block carries.
    redundant : (..., q) array of bool
        Joints of the branches, one branch after the other, that add no freedom to those before.
    doubtful : (...) array of bool
        Where rounding blurs which directions are free.
    """

    C: Float[np.ndarray, "*batch n n"]
    J_q: Float[np.ndarray, "*batch n f"]
    present: Bool[np.ndarray, "*batch f"]
    shares: Float[np.ndarray, "*batch b n n"]
    redundant: Bool[np.ndarray, "*batch q"]
    doubtful: Bool[np.ndarray, "*batch"]


def block_compliance(
    branches: Sequence[tuple[np.ndarray, np.ndarray]],
    length: Float[np.ndarray, "*batch"],
    tolerance: Tolerance,
    present: Sequence[np.ndarray | None] | None = None,
) -> BlockCompliance:
    """Compliance and freedoms of branches in parallel, seen from the chain that holds them.

    The branches transmit wrenches W_i x_i with the energy x_i^T (W_i^T C_i W_i) x_i / 2 each. Under
    a wrench F of the block they share it so that the whole energy is least (Castigliano)::

        x^T D x -> min,  A x = F,  A = [W_1 ... W_b],  D = diag(W_i^T C_i W_i)

    Its value F^T C F / 2 gives C, which is pinv(K) of the sum K of the branches' stiffnesses on
    range(K), but needs none of them: rigid branches are legal. What no x can carry, null(A^T), are
    the freedoms of the block.

    Parameters
    ----------
    branches : sequence of (C, J_q)
        Compliance (..., n, n) and passive twists (..., n, q) of each branch, about one point.
    length : (...) array
        Characteristic length [m].
    tolerance : Tolerance
    present : sequence of (..., q) arrays of bool, or None
        Which columns of each J_q are there at all; None for all.

    Returns
    -------
    BlockCompliance

    Examples
    --------
    Two rods side by side that pull along x, 1 m apart, each with a compliance of 2 m/N:

    >>> pull = np.diag([2.0, 0, 0, 0, 0, 0])
    >>> J = np.eye(6)[:, 1:]  # all other motions are free
    >>> apart = np.eye(6)
    >>> apart[0, 5] = -1.0  # turns about z move the second rod, at y = 1
    >>> other = np.linalg.inv(apart) @ pull @ np.linalg.inv(apart).T
    >>> block = block_compliance(
    ...     [(pull, J), (other, np.linalg.inv(apart) @ J)], np.array(1.0), Tolerance()
    ... )
    >>> round(float(block.C[0, 0]), 9), block.J_q.shape
    (2.0, (6, 4))
    """
    n = branches[0][0].shape[-1]
    s = scaling(length, Space.of_size(n))
    parts, energies, redundant = [], [], []
    doubtful = np.zeros(length.shape, dtype=bool)
    for i, (C, J_q) in enumerate(branches):
        there = None if present is None else present[i]
        _, W, margins = unit_twists_and_wrenches(J_q * s[..., :, None], tolerance, there)
        parts.append(W)
        energies.append(np.swapaxes(W, -1, -2) @ (C * s[..., :, None] * s[..., None, :]) @ W)
        redundant.append(margins <= tolerance.independence)
        doubtful = doubtful | np.any(tolerance.leaves_in_doubt(margins), axis=-1)
    A, D = np.concatenate(parts, axis=-1), block_diagonal(energies)
    U, values, Vt = np.linalg.svd(_padded(A))
    held = values > tolerance.independence
    doubtful = doubtful | np.any(tolerance.leaves_in_doubt(values), axis=-1)
    S = _evening(D)
    if S is None:
        carried, indefinite = _least_energy(U, values, Vt, held, D, tolerance)
    else:  # branches of very different softness: energies of alike size are compared
        evened = np.linalg.svd(_padded(A * S[..., None, :]))
        D_evened = D * S[..., :, None] * S[..., None, :]
        carried, indefinite = _least_energy(*evened, held, D_evened, tolerance)
        carried = carried * S[..., :, None]
    doubtful = doubtful | indefinite
    C = np.swapaxes(carried, -1, -2) @ D @ carried
    # Unit vectors carry no smaller parts than rounding: aligned blocks keep exact zeros.
    free = np.where(np.abs(U) <= _ROUNDING, 0.0, U) * ~held[..., None, :]
    most = int(np.max(np.count_nonzero(~held, axis=-1), initial=0))
    free, there = free[..., n - most :], ~held[..., n - most :]
    shares, start = [], 0
    for W in parts:
        stop = start + W.shape[-1]
        shares.append(W @ carried[..., start:stop, :] * s[..., :, None] / s[..., None, :])
        start = stop
    return BlockCompliance(
        C=C / (s[..., :, None] * s[..., None, :]),
        # Twists in metres and radians again.
        J_q=free / s[..., :, None],
        present=there,
        shares=np.stack(shares, axis=-3),
        redundant=np.concatenate(redundant, axis=-1),
        doubtful=doubtful,
    )


def _padded(A: np.ndarray) -> np.ndarray:
    """The matrix with as many columns as rows at least: missing ones are zero."""
    n, m = A.shape[-2:]
    if m >= n:
        return A
    return np.concatenate([A, np.zeros((*A.shape[:-1], n - m))], axis=-1)


def _evening(D: np.ndarray) -> np.ndarray | None:
    """Factors (..., m) that give all ways energies of alike size; None where they have them."""
    energy = np.einsum("...mm->...m", D)
    largest = np.max(energy, axis=-1, keepdims=True, initial=0.0)
    elastic = energy > 0
    if not np.any(elastic & (energy < _ALIKE * largest)):
        return None
    return np.where(elastic, np.sqrt(largest / np.where(elastic, energy, 1.0)), 1.0)


def _least_energy(
    U: np.ndarray,
    values: np.ndarray,
    Vt: np.ndarray,
    held: np.ndarray,
    D: np.ndarray,
    tolerance: Tolerance,
) -> tuple[np.ndarray, np.ndarray]:
    """What the branches carry per wrench of the block, x = B F (..., m, n), and where in doubt.

    U, values and Vt are those of A. Stresses without energy are those that rigid branches give one
    another: however large they are, the energy is the same, and the least are taken.
    """
    n, m = U.shape[-1], D.shape[-1]
    held = np.arange(n) < np.count_nonzero(held, axis=-1)[..., None]
    inverse = np.where(held, 1.0 / np.where(held, values, 1.0), 0.0)
    B = np.swapaxes(Vt[..., :n, :m], -1, -2) @ (inverse[..., None] * np.swapaxes(U, -1, -2))
    if m <= 1:
        return B, np.zeros(values.shape[:-1], dtype=bool)
    # Stresses within the block, A N = 0, which the wrench leaves open: rows of Vt without a value.
    idle = np.ones(Vt.shape[:-1], dtype=bool)
    idle[..., :n] = ~held
    N = np.swapaxes(Vt[..., :m] * idle[..., None], -1, -2)
    energy, modes = np.linalg.eigh(np.swapaxes(N, -1, -2) @ D @ N)
    part = energy / np.maximum(np.trace(D, axis1=-2, axis2=-1), np.finfo(float).tiny)[..., None]
    elastic = part > tolerance.rigidity
    doubtful = np.any(elastic & (part <= tolerance.near_rigidity), axis=-1)
    inverse = np.where(elastic, 1.0 / np.where(elastic, energy, 1.0), 0.0)
    modes = N @ modes
    pull = np.swapaxes(modes, -1, -2) @ (D @ B)
    return B - modes @ (inverse[..., None] * pull), doubtful
