"""Compliance and passive twists of the legs, with parallel blocks as elements."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robostiff.elastostatics import BlockCompliance, LegWrenches, Tolerance, leg_wrenches, scaling
from robostiff.elastostatics.leg import felt_by_modes
from robostiff.elastostatics.parallel_block import block_of
from robostiff.errors import InputError
from robostiff.kinematics import felt_by_springs, leg_compliance, passive_jacobian
from robostiff.model import PlacedBlock, PlacedLeg
from robostiff.spatial import Space
from robostiff.spatial.batch import empty_batch

_IN, _OUT = list(Space.PLANAR.rows), [2, 3, 4]


def check_passive_in_plane(J_q: np.ndarray, names: tuple[str, ...]) -> None:
    """Raise unless every passive joint turns about z or slides across it.

    Raises
    ------
    InputError
        Naming the joint.
    """
    out = np.linalg.norm(J_q[..., _OUT, :], axis=-2) > 1e-9 * np.linalg.norm(J_q, axis=-2)
    if np.any(out):
        name = names[int(np.argwhere(out)[0][-1])]
        raise InputError(
            f"passive joint {name!r} of a planar robot",
            got="an axis that leads out of the x-y plane",
            expected="a rotation about z or a slide across z",
            hint="leave out 'planar: true' to compute in space",
        )


def check_compliance_in_plane(C: np.ndarray, leg: str) -> None:
    """Raise unless loads in the plane deflect the leg in the plane alone.

    Raises
    ------
    InputError
        Naming the leg.
    """
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", C), 0.0))
    coupling = np.abs(C[..., _IN, :][..., :, _OUT])
    allowed = 1e-9 * size[..., _IN, None] * size[..., None, _OUT]
    if np.any(coupling > allowed):
        raise InputError(
            f"leg {leg!r} of a planar robot",
            got="a compliance that couples motions in the plane with motions out of it",
            expected="elastic parts whose principal axes lie along and across the plane",
            hint="leave out 'planar: true' to compute in space",
        )


@dataclass(frozen=True)
class LegMatrices:
    """Matrices of a leg for the forms of K_C, about one point in world axes.

    Attributes
    ----------
    placed : PlacedLeg
    at : (..., 3) array
        The point [m].
    space : Space
    length : (...) array
        Characteristic length [m].
    J_q : (..., n, q) array
        Twists of the passive joints, then of the freedoms of parallel blocks.
    names : tuple of str
        Of the columns of J_q.
    present : (..., q) array of bool or None
        Which columns are there; None for all.
    blocks : tuple of SolvedBlock
        Its parallel blocks.
    """

    placed: PlacedLeg
    at: np.ndarray
    space: Space
    length: np.ndarray
    J_q: np.ndarray
    names: tuple[str, ...]
    present: np.ndarray | None = None
    blocks: tuple[SolvedBlock, ...] = ()

    @cached_property
    def C(self) -> np.ndarray:
        """Compliance with the passive joints held (..., n, n)."""
        C = leg_compliance(self.placed.without_blocks, self.at)
        if self.space is Space.PLANAR:
            rows = list(self.space.rows)
            C = C[..., rows, :][..., :, rows]
        return C + np.sum([block.whole.C for block in self.blocks], axis=0)

    def wrenches(self, length: np.ndarray, tolerance: Tolerance) -> LegWrenches:
        """Transmitted wrenches and their energy, in coordinates scaled by a length [m]."""

        def felt(W: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return self.felt(W, length)

        return leg_wrenches(self.J_q, felt, length, tolerance, self.present)

    def felt(self, W: np.ndarray, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What its springs and blocks feel of scaled wrenches W, as `felt_by_springs`."""
        wrenches = empty_batch(W.shape[:-2], (6, W.shape[-1]))
        wrenches[...] = 0.0
        wrenches[..., list(self.space.rows), :] = W * scaling(length, self.space)[..., None]
        rows, sizes = felt_by_springs(self.placed.without_blocks, self.at, wrenches, length)
        if not self.blocks:
            return rows, sizes
        of_blocks = [felt_by_modes(block.whole.modes)(W) for block in self.blocks]
        return (
            np.concatenate([rows, *(own for own, _ in of_blocks)], axis=-2),
            np.concatenate([sizes, *(size for _, size in of_blocks)], axis=-1),
        )

    @property
    def reported_names(self) -> tuple[str, ...]:
        """What is reported where it is redundant: joints, blocks, and what is inside those."""
        joints = self.names[: self._joints]
        blocks = tuple(block.placed.name for block in self.blocks)
        return (*joints, *blocks, *(name for block in self.blocks for name in block.reported_names))

    def reported(self, redundant: np.ndarray) -> np.ndarray:
        """Which of these are redundant (..., r), from the columns of J_q that are.

        A block is where any of its freedoms is: how many it has may change from pose to pose.
        """
        start = self._joints
        parts = [redundant[..., :start]]
        for block in self.blocks:
            stop = start + block.whole.J_q.shape[-1]
            parts.append(np.any(redundant[..., start:stop], axis=-1, keepdims=True))
            start = stop
        return np.concatenate([*parts, *(block.reported for block in self.blocks)], axis=-1)

    @property
    def _joints(self) -> int:
        """Number of its columns that are joints, not freedoms of blocks."""
        return len(self.names) - sum(block.whole.J_q.shape[-1] for block in self.blocks)

    @property
    def doubtful(self) -> np.ndarray:
        """Where rounding blurs which motions a block leaves free (...)."""
        doubt = np.zeros(self.J_q.shape[:-2], dtype=bool)
        for block in self.blocks:
            doubt = doubt | block.doubtful
        return doubt


@dataclass(frozen=True)
class SolvedBlock:
    """A parallel block with the matrices of its branches.

    Attributes
    ----------
    placed : PlacedBlock
    whole : BlockCompliance
    branches : tuple of LegMatrices
    """

    placed: PlacedBlock
    whole: BlockCompliance
    branches: tuple[LegMatrices, ...]

    @property
    def reported_names(self) -> tuple[str, ...]:
        """What is reported where it is redundant, branch by branch."""
        return tuple(name for branch in self.branches for name in branch.reported_names)

    @property
    def reported(self) -> np.ndarray:
        """Which of these are redundant (..., r)."""
        parts, start = [], 0
        for branch in self.branches:
            stop = start + branch.J_q.shape[-1]
            parts.append(branch.reported(self.whole.redundant[..., start:stop]))
            start = stop
        return np.concatenate(parts, axis=-1)

    @property
    def doubtful(self) -> np.ndarray:
        """Where rounding blurs which motions are free, here or further inside (...)."""
        return np.logical_or.reduce([self.whole.doubtful, *(b.doubtful for b in self.branches)])


def leg_matrices(
    leg: PlacedLeg, at: np.ndarray, space: Space, length: np.ndarray, tolerance: Tolerance
) -> LegMatrices:
    """Compliance and passive twists of a leg about the point `at`.

    Parameters
    ----------
    leg : PlacedLeg
    at : (..., 3) array
        Point whose twist is given [m].
    space : Space
        Its rows alone are kept.
    length : (...) array
        Characteristic length [m], by which blocks decide what is free.
    tolerance : Tolerance

    Raises
    ------
    InputError
        When a leg of a planar robot leaves the plane.
    """
    J_q, names = passive_jacobian(leg.without_blocks, at)
    if space is Space.PLANAR:
        check_passive_in_plane(J_q, names)
        check_compliance_in_plane(leg_compliance(leg.without_blocks, at), leg.name)
        J_q = J_q[..., list(space.rows), :]
    if not leg.blocks:
        return LegMatrices(leg, at, space, length, J_q, names)
    blocks = tuple(_block(block, at, space, length, tolerance) for block in leg.blocks)
    columns, there = [J_q], [np.ones((*J_q.shape[:-2], len(names)), dtype=bool)]
    for block in blocks:
        columns.append(block.whole.J_q)
        there.append(block.whole.present)
        names += tuple(f"{block.placed.name}.free[{i}]" for i in range(there[-1].shape[-1]))
    present = np.concatenate(there, axis=-1)
    J_q = np.concatenate(columns, axis=-1)
    there_all = None if np.all(present) else present
    return LegMatrices(leg, at, space, length, J_q, names, there_all, blocks)


def _block(
    block: PlacedBlock, at: np.ndarray, space: Space, length: np.ndarray, tolerance: Tolerance
) -> SolvedBlock:
    branches = tuple(leg_matrices(leg, at, space, length, tolerance) for leg in block.branches)
    whole = block_of([branch.wrenches(length, tolerance) for branch in branches], length, tolerance)
    return SolvedBlock(block, whole, branches)
