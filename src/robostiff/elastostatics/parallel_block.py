"""A parallel block as an element of a chain: the compliance of least energy, and its freedoms.

Also what is found of a machine beside its stiffness: its legs, their blocks, and the posture.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.elastostatics.conjugate_wrenches import ConjugateWrenches, least_energy
from robostiff.elastostatics.leg import LegWrenches, leg_wrenches, loads_of_compliance
from robostiff.elastostatics.result import CartesianStiffness
from robostiff.elastostatics.status import PoseBatch
from robostiff.elastostatics.tolerance import Tolerance, scaling
from robostiff.frozen import field, frozen
from robostiff.spatial import Space
from robostiff.spatial.batch import Bool, Float

_ROUNDING = 4 * np.finfo(float).eps
_NOTHING = 1e-13  # of a unit load


@frozen
class BlockCompliance(PoseBatch):
    """A parallel block as an element of a chain, about a point and in world axes."""

    #: (..., p, n): a wrench F that the block transmits stores the energy ``|modes F|^2 / 2`` in it,
    #: in scaled coordinates; none where rigid branches carry it alone
    modes: Float[np.ndarray, "*batch p n"]
    length: np.ndarray  #: (...): characteristic length [m] of the scaling
    #: (..., n, w): wrenches on the body after it that leave all others in equilibrium, by which
    #: ranks are decided; scaled
    held: Float[np.ndarray, "*batch n w"]
    #: (..., n, m): orthonormal basis of the wrenches that it transmits, scaled; zero columns fill
    #: up
    W: Float[np.ndarray, "*batch n m"]
    #: (..., n, f): twists that meet no stiffness: its freedoms. Poses may have different numbers of
    #: them; zero columns fill up.
    J_q: Float[np.ndarray, "*batch n f"]
    present: Bool[np.ndarray, "*batch f"]  #: (..., f): which columns are freedoms
    #: (..., b, n, n): wrench that each branch carries, per wrench that the block carries
    shares: Float[np.ndarray, "*batch b n n"]
    #: (..., bodies n, bodies n): orthonormal motions of all bodies that meet no stiffness, scaled;
    #: other columns are zero
    mechanisms: Float[np.ndarray, "*batch k k"]
    #: (..., q): joints of the branches, one branch after the other, that add no freedom to those
    #: before
    redundant: Bool[np.ndarray, "*batch q"]
    doubtful: Bool[np.ndarray, "*batch"]  #: (...): where rounding blurs which directions are free
    inner: tuple[tuple[BlockCompliance, ...], ...] = ()  #: the parallel blocks of each branch

    @property
    def C(self) -> Float[np.ndarray, "*batch n n"]:
        """Compliance of the body after the block against the one before (..., n, n).

        For the wrenches that the block transmits; zero for the others.
        """
        s = scaling(self.length, Space.of_size(self.modes.shape[-1]))
        modes = self.modes / s[..., None, :]
        return np.swapaxes(modes, -1, -2) @ modes


def block_compliance(
    branches: Sequence[tuple[np.ndarray, np.ndarray]],
    length: Float[np.ndarray, "*batch"],
    tolerance: Tolerance,
) -> BlockCompliance:
    """Compliance and freedoms of branches in parallel, seen from the chain that holds them.

    The branches share a wrench of the block with the least energy, as the legs of a robot do
    (`least_energy`): the compliance is pinv(K) of the sum K of the branches' stiffnesses on
    range(K), but needs none of them, and rigid branches are legal. What no branch transmits are the
    freedoms of the block.

    Parameters
    ----------
    branches : sequence of (C, J_q)
        Compliance (..., n, n) and passive twists (..., n, q) of each branch, about one point.
    length : (...) array
        Characteristic length [m].
    tolerance : Tolerance

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
    legs = [
        leg_wrenches(J_q, loads_of_compliance(C, length), length, tolerance) for C, J_q in branches
    ]
    return block_of(legs, length, tolerance)


def block_of(
    branches: Sequence[LegWrenches],
    length: Float[np.ndarray, "*batch"],
    tolerance: Tolerance,
    ends: Sequence[tuple[int, int]] | None = None,
) -> BlockCompliance:
    """As `block_compliance`, from the wrenches of branches between any bodies.

    Wrenches of all branches are about one point in the same axes, so that a body is in equilibrium
    where they add up to its load. The least energy of all wrenches under a load on one body, the
    others free of loads, is its compliance.

    Parameters
    ----------
    branches : sequence of LegWrenches
        About one point.
    length : (...) array
        Characteristic length [m].
    tolerance : Tolerance
    ends : sequence of (int, int), optional
        The bodies from which and to which each branch leads: 0 is at rest, 1 the body that is
        loaded, others lie between. From 0 to 1 when left out.
    """
    ends = [(0, 1)] * len(branches) if ends is None else ends
    bodies = max(max(pair) for pair in ends)
    A = _on_bodies([branch.W for branch in branches], ends, bodies)
    n = A.shape[-2] // bodies
    s = scaling(length, Space.of_size(n))
    missing = max(0, A.shape[-2] - A.shape[-1])  # columns, which are zero
    padded = np.pad(A, [(0, 0)] * (A.ndim - 1) + [(0, missing)])
    U, values, _ = np.linalg.svd(padded, full_matrices=False)
    fixed = values > tolerance.independence
    doubtful = np.any(tolerance.leaves_in_doubt(values), axis=-1)
    for branch in branches:
        doubtful = doubtful | np.any(tolerance.leaves_in_doubt(branch.margins), axis=-1)
    wrenches = [branch.conjugate for branch in branches]
    unit, rigid = (
        _on_bodies([getattr(w, name) for w in wrenches], ends, bodies) for name in ("unit", "rigid")
    )
    compliance = np.concatenate([w.compliance for w in wrenches], axis=-1)
    rank = np.count_nonzero(fixed, axis=-1)
    shared = least_energy(unit, compliance, rigid, rank, tolerance)
    # Unit vectors carry no smaller parts than rounding: aligned blocks keep exact zeros.
    free = np.where(np.abs(U) <= _ROUNDING, 0.0, U) * ~fixed[..., None, :]
    mechanisms, loads, on_loaded = free, np.eye(n), A
    if bodies > 1:
        inverse = np.where(fixed, 1.0 / np.where(fixed, values, 1.0), 0.0)
        carried = U[..., :n, :] * inverse[..., None, :]
        # motions of the loaded body among those of all, and what it transmits without them
        U, values, _ = np.linalg.svd(free[..., :n, :], full_matrices=False)
        U, fixed = U[..., ::-1], values[..., ::-1] <= tolerance.independence
        doubtful = doubtful | np.any(tolerance.leaves_in_doubt(values), axis=-1)
        free, W = U * ~fixed[..., None, :], U * fixed[..., None, :]
        # of all wrenches with the others in equilibrium the largest that unit ones come to
        Y, sizes, _ = np.linalg.svd(np.swapaxes(W, -1, -2) @ carried, full_matrices=False)
        some = sizes > tolerance.independence
        on_loaded = W @ Y * np.where(some, 1.0 / np.where(some, sizes, 1.0), 0.0)[..., None, :]
        loads = np.eye(n) - free @ np.swapaxes(free, -1, -2)
    most = int(np.max(np.count_nonzero(~fixed, axis=-1), initial=0))
    few = int(np.min(np.count_nonzero(~fixed, axis=-1), initial=n))
    on_first, on_first_rigid, modes = (
        part[..., :n] @ loads for part in (shared.shares, shared.rigid_shares, shared.modes)
    )
    if bodies > 1:  # what is nothing beside a unit load is rounding
        modes = np.where(np.max(np.abs(on_first), axis=-1, keepdims=True) > _NOTHING, modes, 0.0)
    carried = ConjugateWrenches.carried(wrenches, on_first, on_first_rigid)
    margins = np.concatenate([branch.margins for branch in branches], axis=-1)
    return BlockCompliance(
        modes=modes,
        length=length,
        held=on_loaded,
        W=(U * fixed[..., None, :])[..., : n - few],
        # Twists in metres and radians again.
        J_q=free[..., n - most :] / s[..., :, None],
        present=~fixed[..., n - most :],
        shares=np.stack([one * s[..., :, None] / s[..., None, :] for one in carried], axis=-3),
        mechanisms=mechanisms,
        redundant=margins <= tolerance.independence,
        doubtful=doubtful | shared.doubtful | np.logical_or.reduce([w.doubtful for w in wrenches]),
    )


def _on_bodies(
    wrenches: Sequence[np.ndarray], ends: Sequence[tuple[int, int]], bodies: int
) -> np.ndarray:
    """Wrenches (..., n, m) of branches on all bodies but that at rest (..., bodies n, m)."""
    n = wrenches[0].shape[-2]
    if all(pair == (0, 1) for pair in ends):
        return np.concatenate(wrenches, axis=-1)
    placed = []
    for W, (a, b) in zip(wrenches, ends, strict=True):
        on_each = np.zeros((*W.shape[:-2], bodies + 1, n, W.shape[-1]))
        on_each[..., a, :, :] -= W
        on_each[..., b, :, :] += W
        placed.append(on_each[..., 1:, :, :].reshape(*W.shape[:-2], bodies * n, -1))
    return np.concatenate(placed, axis=-1)


@frozen(kw_only=True)
class Details(CartesianStiffness):
    """What the direct form finds at poses: K about `origin`, where ranks are decided, and legs."""

    #: (..., 3): where it was computed: the machine's own reference point in the world [m], or the
    #: middle of a machine that is far away from it
    origin: np.ndarray
    reference_point: np.ndarray  #: (..., 3): the machine's own, in the world [m]
    #: ``leg/joint`` of every passive freedom, the columns of ``redundant``
    passive_joint_names: tuple[str, ...]
    legs: tuple[CartesianStiffness, ...] = ()  #: each leg about `origin`; none of a network
    #: parallel blocks of each leg about `origin`, by which their branches share a wrench
    leg_blocks: tuple[tuple[BlockCompliance, ...], ...] = ()
    #: (..., b, n, n): on a flexible platform, what each leg carries of a wrench on the tool about
    #: `origin`, and then each part of the platform
    shares: np.ndarray | None = None
    #: (..., 6): x, y, z [m] and rotation vector [rad] of the platform; None for a snapshot
    pose: np.ndarray | None = None
    #: the posture: coordinates of the joints of each leg [m, rad], by its name
    joint_coordinates: Mapping[str, np.ndarray] = field(default_factory=dict)
    #: names of these coordinates, of robots of legs
    joint_names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def of(cls, whole: CartesianStiffness, **more: Any) -> Details:
        """A stiffness about an origin, with what else was found."""
        values = {one.name: getattr(whole, one.name) for one in fields(CartesianStiffness)}
        return cls(**{**values, **more})

    @cached_property
    def at_reference(self) -> np.ndarray:
        """K about the reference point (..., n, n), meaningful where there is one."""
        return self.moved(self.reference_point - self.origin)
