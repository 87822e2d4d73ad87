"""Compliance and passive twists of a leg, its parallel blocks in place of what they hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.analysis.planar import check_compliance_in_plane, check_passive_in_plane
from robostiff.elastostatics import BlockCompliance, Tolerance, block_compliance
from robostiff.kinematics import leg_compliance, passive_jacobian
from robostiff.model import PlacedBlock, PlacedLeg
from robostiff.spatial import Space


@dataclass(frozen=True)
class LegMatrices:
    """What a form of K_C needs to know of a leg, about one point in world axes.

    Attributes
    ----------
    C : (..., n, n) array
        Compliance with the passive joints held.
    J_q : (..., n, q) array
        Twists of the passive joints, then of the freedoms of parallel blocks.
    names : tuple of str
        Of the columns of J_q.
    present : (..., q) array of bool or None
        Which columns are there; None for all.
    blocks : tuple of SolvedBlock
        Its parallel blocks.
    """

    C: np.ndarray
    J_q: np.ndarray
    names: tuple[str, ...]
    present: np.ndarray | None = None
    blocks: tuple[SolvedBlock, ...] = ()

    @property
    def told_names(self) -> tuple[str, ...]:
        """What may be redundant: its joints, its blocks, and whatever is inside those."""
        joints = self.names[: self._joints]
        blocks = tuple(block.placed.name for block in self.blocks)
        return (*joints, *blocks, *(name for block in self.blocks for name in block.told_names))

    def told(self, redundant: np.ndarray) -> np.ndarray:
        """Which of these are redundant (..., r), from the columns of J_q that are.

        A block is where any of its freedoms is: how many it has may change from pose to pose.
        """
        start = self._joints
        parts = [redundant[..., :start]]
        for block in self.blocks:
            stop = start + block.whole.J_q.shape[-1]
            parts.append(np.any(redundant[..., start:stop], axis=-1, keepdims=True))
            start = stop
        return np.concatenate([*parts, *(block.told for block in self.blocks)], axis=-1)

    @property
    def _joints(self) -> int:
        """How many of its columns are joints, and not freedoms of blocks."""
        return len(self.names) - sum(block.whole.J_q.shape[-1] for block in self.blocks)

    @property
    def doubtful(self) -> np.ndarray:
        """Where rounding blurs which motions a block leaves free (...)."""
        doubt = np.zeros(self.C.shape[:-2], dtype=bool)
        for block in self.blocks:
            doubt = doubt | block.doubtful
        return doubt


@dataclass(frozen=True)
class SolvedBlock:
    """A parallel block, and what its branches are.

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
    def told_names(self) -> tuple[str, ...]:
        """What may be redundant inside, branch by branch."""
        return tuple(name for branch in self.branches for name in branch.told_names)

    @property
    def told(self) -> np.ndarray:
        """Which of these are redundant (..., r)."""
        parts, start = [], 0
        for branch in self.branches:
            stop = start + branch.J_q.shape[-1]
            parts.append(branch.told(self.whole.redundant[..., start:stop]))
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
        Point whose twist is told [m].
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
    C = leg_compliance(leg.without_blocks, at)
    if space is Space.PLANAR:
        rows = list(space.rows)
        check_passive_in_plane(J_q, names)
        check_compliance_in_plane(C, leg.name)
        J_q, C = J_q[..., rows, :], C[..., rows, :][..., :, rows]
    own = LegMatrices(C, J_q, names)
    if not leg.blocks:
        return own
    blocks = tuple(_block(block, at, space, length, tolerance) for block in leg.blocks)
    columns, there = [J_q], [np.ones((*J_q.shape[:-2], len(names)), dtype=bool)]
    for block in blocks:
        C = C + block.whole.C
        columns.append(block.whole.J_q)
        there.append(block.whole.present)
        names += tuple(f"{block.placed.name}.free[{i}]" for i in range(there[-1].shape[-1]))
    present = np.concatenate(there, axis=-1)
    return LegMatrices(
        C,
        np.concatenate(columns, axis=-1),
        names,
        None if np.all(present) else present,
        blocks,
    )


def _block(
    block: PlacedBlock, at: np.ndarray, space: Space, length: np.ndarray, tolerance: Tolerance
) -> SolvedBlock:
    branches = tuple(leg_matrices(leg, at, space, length, tolerance) for leg in block.branches)
    whole = block_compliance(
        [(branch.C, branch.J_q) for branch in branches],
        length,
        tolerance,
        [branch.present for branch in branches],
    )
    return SolvedBlock(block, whole, branches)
