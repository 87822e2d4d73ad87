"""Chains of a group of legs whose elements are alike, computed together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robostiff.statics.chain import BodyLoad, FiniteChain, stacked_loads
from robostiff.statics.element import Placement
from robostiff.statics.leg_state import LegState
from robostiff.statics.moving_chain import MovingChains

if TYPE_CHECKING:
    from robostiff.statics.legs import LegGroup


@dataclass(frozen=True)
class ChainFamily:
    """Chains of the legs of a group whose elements are alike, computed together.

    Attributes
    ----------
    members : tuple of int
        Which chains; rows of the arrays are those of the first, then of the next.
    arrays : MovingChains
    bodies : tuple of int
        At their starts; none where they start at the base.
    held : tuple of (int, int, int)
        Row, place among the anchors of its chain, and place among the loads, of every anchor.
    end_points : (N, 3) array
        Of the bodies at their ends, at the unloaded posture [m].
    """

    members: tuple[int, ...]
    arrays: MovingChains
    bodies: tuple[int, ...]
    end_points: np.ndarray
    held: tuple[tuple[int, int, int], ...] = ()

    @staticmethod
    def of(group: LegGroup, members: Sequence[int]) -> ChainFamily:
        """Some chains of a group."""
        chains, counts = [group.chains[i] for i in members], [group.count] * len(members)
        first = chains[0]
        elements = FiniteChain.stacked(chains, counts).elements
        loads = list(stacked_loads([chain.loads for chain in chains], counts))
        held = []
        for row, chain in enumerate(chains):
            for place, anchor in enumerate(chain.anchors):
                held.append((row, place, len(loads)))
                points = np.tile(anchor.point, (sum(counts), 1))
                loads.append(BodyLoad(anchor.after, points, np.zeros(points.shape)))
        bodies = tuple(chain.start for chain in chains if chain.start is not None)
        rows = () if first.start is None else group.rows
        return ChainFamily(
            tuple(members),
            MovingChains(elements, loads, sum(counts), rows),
            bodies,
            np.concatenate([group.end_point(i) for i in members]),
            tuple(held),
        )

    def pulls(self, of_chains: Sequence[np.ndarray]) -> np.ndarray | None:
        """Forces (N, L, 3) at the points of its loads, from those on the anchors of each chain."""
        if not self.held:
            return None
        found = np.zeros(self.arrays.load_force.shape)
        for row, place, load in self.held:
            found[row, load] = of_chains[self.members[row]][place]
        return found

    def split(self, count: int) -> list[tuple[int, slice]]:
        """Each chain with its rows."""
        return [(i, slice(k * count, (k + 1) * count)) for k, i in enumerate(self.members)]

    def coordinates(self, state: LegState) -> np.ndarray:
        """Of all its chains (N, n)."""
        return np.concatenate([state.x[i] for i in self.members])

    def centres(self, state: LegState) -> np.ndarray | None:
        """Where the points of the bodies at the starts are (N, 3) [m]."""
        return np.concatenate([state.bodies[b].p for b in self.bodies]) if self.bodies else None

    def starts(self, group: LegGroup, state: LegState) -> Placement | None:
        """Of the bodies at the starts; None for the base."""
        if not self.bodies:
            return None
        own = [state.bodies[b].placement(group.points[b]) for b in self.bodies]
        return Placement(np.concatenate([e.R for e in own]), np.concatenate([e.t for e in own]))
