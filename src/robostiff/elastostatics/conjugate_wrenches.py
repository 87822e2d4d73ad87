"""Wrenches of a leg, conjugate in its energy, and the system over those of all legs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from robostiff.elastostatics.status import PoseBatch
from robostiff.elastostatics.tolerance import Tolerance, smallest_singular_value
from robostiff.frozen import frozen
from robostiff.spatial.batch import Bool, Float, product, transpose

# Rounding grows by this much before an answer is no longer certain to nine digits.
_FEW_DIGITS = 1e6


@frozen
class ConjugateWrenches(PoseBatch):
    """Wrenches that a leg transmits, in scaled coordinates."""

    #: (..., n, m): unit wrenches, each of which meets compliance by itself: they share no energy.
    #: Zero columns fill up.
    unit: Float[np.ndarray, "*batch n m"]
    #: (..., m): compliance under each of them: f of it store the energy ``compliance f^2 / 2``
    compliance: Float[np.ndarray, "*batch m"]
    #: (..., n, k): orthonormal wrenches that meet no elastic part, zero columns elsewhere
    rigid: Float[np.ndarray, "*batch n k"]
    #: (...): where rounding blurs what meets a spring, or leaves fewer than nine digits
    doubtful: Bool[np.ndarray, "*batch"]

    @property
    def stiffness(self) -> Float[np.ndarray, "*batch n n"]:
        """``K = sum of u u^T / c``, of the elastic wrenches alone (..., n, n)."""
        elastic = self.compliance > 0
        k = np.where(elastic, 1.0 / np.where(elastic, self.compliance, 1.0), 0.0)
        K = product(self.unit * k[..., None, :], transpose(self.unit))
        return 0.5 * (K + transpose(K))

    @property
    def count(self) -> np.ndarray:
        """How many there are, elastic and rigid (...)."""
        rigid = np.count_nonzero(np.any(self.rigid != 0, axis=-2), axis=-1)
        return np.count_nonzero(self.compliance, axis=-1) + rigid

    @classmethod
    def none(cls, n: int) -> ConjugateWrenches:
        """None at all, at a single pose, of n entries each."""
        return cls(np.zeros((n, 0)), np.zeros(0), np.zeros((n, 0)), np.array(False))

    @staticmethod
    def beside(parts: Sequence[ConjugateWrenches]) -> ConjugateWrenches:
        """Wrenches of several legs at the same poses."""
        return ConjugateWrenches(
            np.concatenate([part.unit for part in parts], axis=-1),
            np.concatenate([part.compliance for part in parts], axis=-1),
            np.concatenate([part.rigid for part in parts], axis=-1),
            np.logical_or.reduce([part.doubtful for part in parts]),
        )

    @staticmethod
    def carried(
        parts: Sequence[ConjugateWrenches], sizes: np.ndarray, rigid_sizes: np.ndarray
    ) -> list[np.ndarray]:
        """Wrenches (..., n, k) of each leg, from the sizes (..., m, k) of those of all legs."""
        found, start, first = [], 0, 0
        for leg in parts:
            stop, last = start + leg.unit.shape[-1], first + leg.rigid.shape[-1]
            elastic = leg.unit @ sizes[..., start:stop, :]
            found.append(elastic + leg.rigid @ rigid_sizes[..., first:last, :])
            start, first = stop, last
        return found


def conjugate_wrenches(
    W: Float[np.ndarray, "*batch n m"],
    rows: Float[np.ndarray, "*batch p m"],
    sizes: Float[np.ndarray, "*batch p"],
    tolerance: Tolerance,
) -> ConjugateWrenches:
    """Wrenches of a leg that share no energy, from what each of its springs feels of them.

    The energy of W f is ``sum over the springs of (size row . f)^2 / 2``. Geometry, the rows alone,
    decides which wrenches meet no spring; a soft spring counts like a stiff one. The others are
    made conjugate one by one, those that store most first, spring by spring: a stiff spring keeps
    its digits beside a soft one, which it loses once their compliances are added up.

    Parameters
    ----------
    W : (..., n, m) array
        Orthonormal transmitted wrenches, scaled; zero columns come last.
    rows : (..., p, m) array
        Part of each wrench that each spring feels along its own unit twist.
    sizes : (..., p) array
        Root of the compliance of each spring along this twist; 0 for none.
    tolerance : Tolerance

    Examples
    --------
    Two springs that differ by 10^16 in a chain; they pull along x and across it:

    >>> rows, sizes = np.array([[1.0, 0.0], [0.6, 0.8]]), np.array([1e-4, 1e4])
    >>> found = conjugate_wrenches(np.eye(2), rows, sizes, Tolerance())
    >>> found.stiffness
    array([[ 1.000e+08, -7.500e+07],
           [-7.500e+07,  5.625e+07]])
    """
    n, m = W.shape[-2:]
    batch = np.broadcast_shapes(W.shape[:-2], rows.shape[:-2], sizes.shape[:-1])
    transmitted = np.broadcast_to(np.count_nonzero(np.any(W != 0, axis=-2), axis=-1), batch)
    elastic, doubtful = _elastic_rank(rows * (sizes > 0)[..., None], batch, tolerance)
    if m == 0 or (np.all(elastic == m)):
        unit, compliance, _, blurred = _conjugate(W, rows, sizes, m)
        return ConjugateWrenches(unit, compliance, np.zeros((*batch, n, 0)), doubtful | blurred)
    unit, rigid = np.zeros((*batch, n, m)), np.zeros((*batch, n, m))
    compliance = np.zeros((*batch, m))
    W, rows = np.broadcast_to(W, (*batch, n, m)), np.broadcast_to(rows, (*batch, *rows.shape[-2:]))
    sizes = np.broadcast_to(sizes, (*batch, sizes.shape[-1]))
    for group, (count, rank) in alike(np.stack([transmitted, elastic], axis=-1)):
        W_own, R_own, s_own = W[group][..., :count], rows[group][..., :count], sizes[group]
        if rank < count:
            Y = transpose(np.linalg.svd(R_own * (s_own > 0)[..., None])[2])
            W_own, R_own = W_own @ Y, R_own @ Y
        unit[group, :, :rank], compliance[group, :rank], rest, blurred = _conjugate(
            W_own, R_own, s_own, rank
        )
        if rank < count:
            rigid[group, :, : count - rank] = np.linalg.qr(rest)[0]
        doubtful[group] |= blurred
    return ConjugateWrenches(unit, compliance, rigid, doubtful)


def alike(decisions: np.ndarray) -> Iterator[tuple[Any, np.ndarray]]:
    """Groups of poses with the same decisions, as an index, and the decisions, arrays of int."""
    rows = decisions.reshape(-1, decisions.shape[-1])
    if len(rows) and np.all(rows == rows[0]):
        yield Ellipsis, rows[0]
        return
    for decision in np.unique(rows, axis=0):
        yield np.all(decisions == decision, axis=-1), decision


def eliminate(
    G: np.ndarray, X: np.ndarray, sizes: np.ndarray, pivots: int
) -> tuple[list[tuple[np.ndarray, np.ndarray]], np.ndarray, np.ndarray]:
    """Columns (G, X) freed one by one of the first `pivots`, those with the most energy first.

    G holds what the springs feel, a row each, X the wrenches themselves. Gram and Schmidt with
    pivots are stable row by row, whatever the sizes of the rows.

    Returns
    -------
    found : list of (x, energy)
        Each pivot (..., k), and the sum of the squares of its column of G (...).
    rest : (..., k, m - pivots) array
        X of the others, which are left without what they share with the pivots.
    blurred : (...) array of bool
        Where rounding of the rows reaches the tenth digit.
    """
    found = []
    blurred = np.zeros(np.broadcast_shapes(G.shape[:-2], sizes.shape[:-1]), dtype=bool)
    for count in range(pivots, 0, -1):
        energies = np.einsum("...pm,...pm->...m", G[..., :count], G[..., :count])
        place = np.argmax(energies, axis=-1)
        if count > 1 and np.any(place != 0):
            chosen = np.arange(count) == place[..., None]
            G, X = _swap(G, chosen, count), _swap(X, chosen, count)
        g, x = G[..., 0], X[..., 0]
        energy = np.max(energies, axis=-1)
        safe = np.where(energy > 0, energy, 1.0)
        part = np.einsum("...p,...pm->...m", g, G[..., 1:]) / safe[..., None]
        G = G[..., 1:] - g[..., :, None] * part[..., None, :]
        X = X[..., 1:] - x[..., :, None] * part[..., None, :]
        reach = np.sqrt(np.einsum("...k,...k->...", x, x))
        largest = np.max(np.abs(g) * sizes, axis=-1, initial=0.0)
        blurred = blurred | (largest * reach > _FEW_DIGITS * energy)
        found.append((x, energy))
    return found, X, blurred


def _swap(A: np.ndarray, chosen: np.ndarray, count: int) -> np.ndarray:
    """The chosen column first, and the first in its place."""
    first, pivots = A[..., 0], A[..., :count]
    column = np.einsum("...pm,...m->...p", pivots, chosen.astype(float))
    swapped = np.where(chosen[..., None, :], first[..., None], pivots)
    return np.concatenate([column[..., None], swapped[..., 1:], A[..., count:]], axis=-1)


def _conjugate(
    W: np.ndarray, rows: np.ndarray, sizes: np.ndarray, elastic: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The first wrenches made conjugate, their compliances, and the others without energy shared.

    The others feel springs by less than decides. Of a spring that is much softer than the rest
    that is still a load, were it not taken out of them.
    """
    found, rest, blurred = eliminate(rows * sizes[..., None], W, sizes, elastic)
    if not found:
        return W[..., :0], np.zeros((*blurred.shape, 0)), rest, blurred
    unit = np.stack([x for x, _ in found], axis=-1)
    square = np.einsum("...nm,...nm->...m", unit, unit)
    energies = np.stack([energy for _, energy in found], axis=-1)
    return unit / np.sqrt(square)[..., None, :], energies / square, rest, blurred


def _elastic_rank(
    rows: np.ndarray, batch: tuple[int, ...], tolerance: Tolerance
) -> tuple[np.ndarray, np.ndarray]:
    """How many independent wrenches meet a spring (...), and where this is in doubt."""
    p, m = rows.shape[-2:]
    rank, doubtful = np.full(batch, m), np.zeros(batch, dtype=bool)
    if m == 0:
        return rank, doubtful
    margin = np.broadcast_to(smallest_singular_value(transpose(rows)), batch)
    doubtful |= tolerance.leaves_in_doubt(margin)
    lost = margin <= tolerance.independence
    if np.any(lost):
        values = np.linalg.svd(np.broadcast_to(rows, (*batch, p, m))[lost], compute_uv=False)
        rank[lost] = np.count_nonzero(values > tolerance.independence, axis=-1)
        doubtful[lost] = np.any(tolerance.leaves_in_doubt(values), axis=-1)
    return rank, doubtful


@frozen
class LeastEnergy:
    """Shares of wrenches in parallel in a load, in scaled coordinates."""

    #: (..., m, n): size of each elastic unit wrench, per load
    shares: Float[np.ndarray, "*batch m n"]
    #: (..., k, n): size of each rigid one. Where rigid wrenches balance one another, the least.
    rigid_shares: Float[np.ndarray, "*batch k n"]
    #: (..., m, n): what each elastic wrench feels of a load: a load F stores the energy ``|modes
    #: F|^2 / 2``. Loads that rigid wrenches carry alone store none.
    modes: Float[np.ndarray, "*batch m n"]
    doubtful: Bool[np.ndarray, "*batch"]  #: (...): where rounding leaves fewer than nine digits

    @property
    def compliance(self) -> Float[np.ndarray, "*batch n n"]:
        """Twists for loads that are carried, ``t = C F``; zero for the others."""
        C = transpose(self.modes) @ self.modes
        return 0.5 * (C + transpose(C))


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
        of_elastic, of_rigid = np.flatnonzero(decision[:m]), np.flatnonzero(decision[m : m + k])
        U, c = unit[group][..., of_elastic], compliance[group][..., of_elastic]
        H, counts = rigid[group][..., of_rigid], decision[-2:].tolist()
        found = _least_energy_of_rank(U, c, H, *counts)
        shares[group] = _in_rows(found.shares, of_elastic, m)
        modes[group] = _in_rows(found.modes, of_elastic, m)
        rigid_shares[group] = _in_rows(found.rigid_shares, of_rigid, k)
        doubtful[group] = found.doubtful
    return LeastEnergy(shares, rigid_shares, modes, doubtful)


def _least_energy_of_rank(
    U: np.ndarray, c: np.ndarray, H: np.ndarray, by_rigid: int, rank: int
) -> LeastEnergy:
    """As `least_energy`, for poses at which as many wrenches are independent."""
    n = U.shape[-2]
    Q, to_rigid = np.eye(n), np.zeros((*H.shape[:-2], 0, n))
    if H.shape[-1]:
        V, values, Zt = np.linalg.svd(H)
        inverse = 1.0 / values[..., :by_rigid, None]
        to_rigid = transpose(Zt[..., :by_rigid, :]) @ (inverse * transpose(V[..., :, :by_rigid]))
        Q = V[..., :, by_rigid:]
    by_elastic = rank - by_rigid
    A, values, Bt = np.linalg.svd(transpose(Q) @ U)
    A = A[..., :, :by_elastic]
    # What carries each of the directions A with the least wrenches, and stresses that carry none.
    carried = transpose(Bt[..., :by_elastic, :]) / values[..., None, :by_elastic]
    idle = transpose(Bt[..., by_elastic:, :])
    both = np.concatenate([idle, carried], axis=-1)
    root = np.sqrt(c)
    row = np.sqrt(np.einsum("...mk,...mk->...m", both, both))
    _, carried, blurred = eliminate(root[..., None] * both, both, root * row, idle.shape[-1])
    directions = transpose(Q @ A)
    shares = carried @ directions
    rigid_shares = to_rigid @ (np.eye(n) - U @ shares) if H.shape[-1] else to_rigid
    return LeastEnergy(shares, rigid_shares, root[..., None] * shares, blurred)


def _in_rows(values: np.ndarray, rows: np.ndarray, count: int) -> np.ndarray:
    if len(rows) == count:
        return values
    placed = np.zeros((*values.shape[:-2], count, values.shape[-1]))
    placed[..., rows, :] = values
    return placed
