"""All chains of a group of legs, their elements side by side: computed together."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from robostiff.statics.chain import BodyLoad, stacked_loads
from robostiff.statics.element import FiniteJoint, Placement
from robostiff.statics.leg_state import LegState, MovingBody
from robostiff.statics.moving_chain import MovingChains

if TYPE_CHECKING:
    from robostiff.statics.legs import LegGroup


@dataclass(frozen=True)
class ChainFamily:
    """The chains of a group in slots: in each of them a chain has an element of its kind, or none.

    Rows of arrays are the legs of the first chain, then those of the next.

    Attributes
    ----------
    arrays : MovingChains
    slots : tuple of arrays of int
        Of the elements of every chain.
    columns : tuple of arrays of int
        Of the unknowns that move every chain: of the body at its start, where that moves, its own.
    taken : (rows, n) array of int
        Where each coordinate stands among those of the state, one after the other, and a zero.
    starts, ends : (chains,) arrays of int
        Bodies at their ends: 0 for the base, -1 for the platform, 1 for the first body between.
    end_points : (rows, 3) array
        Of the bodies at their ends, at the unloaded posture [m].
    held : tuple of (int, int, int)
        Chain, place among its anchors, and place among the loads, of every anchor.
    """

    arrays: MovingChains
    slots: tuple[np.ndarray, ...]
    columns: tuple[np.ndarray, ...]
    taken: np.ndarray
    starts: np.ndarray
    ends: np.ndarray
    end_points: np.ndarray
    held: tuple[tuple[int, int, int], ...]

    @staticmethod
    def of(group: LegGroup) -> ChainFamily:
        """The chains of a group."""
        chains, N = group.chains, group.count
        kinds = [tuple(map(_kind, chain.elements)) for chain in chains]
        common: tuple[str, ...] = ()
        for own in sorted(dict.fromkeys(kinds), key=len, reverse=True):
            common = _merged(common, own)
        slots = tuple(np.array(_places(own, common), dtype=int) for own in kinds)
        sizes = np.ones(len(common), dtype=int)
        for chain, own in zip(chains, slots, strict=True):
            sizes[own] = np.maximum(sizes[own], [e.size for e in chain.elements])
        starts = np.array([0 if c.start is None else c.start + 1 for c in chains], dtype=int)
        rows = group.rows if np.any(starts) else ()
        first = len(rows) + np.cumsum([0, *sizes])
        columns = tuple(
            np.concatenate(
                [
                    np.arange(len(rows) if start else 0),
                    *(f + np.arange(e.size) for f, e in zip(first[own], c.elements, strict=True)),
                ]
            ).astype(int)
            for start, own, c in zip(starts, slots, chains, strict=True)
        )
        ends = np.cumsum([0, *(N * chain.size for chain in chains)])
        taken = np.full((N * len(chains), int(sizes.sum())), ends[-1])
        for i, (chain, own) in enumerate(zip(chains, columns, strict=True)):
            there = own[len(own) - chain.size :] - len(rows)
            here = ends[i] + np.arange(N * chain.size).reshape(N, chain.size)
            taken[i * N : (i + 1) * N, there] = here
        loads = [_in_slots(chain.loads, own) for chain, own in zip(chains, slots, strict=True)]
        stacked = list(stacked_loads(loads, [N] * len(chains)))
        held = []
        for c, (chain, own) in enumerate(zip(chains, slots, strict=True)):
            for place, anchor in enumerate(_in_slots(chain.anchors, own)):
                held.append((c, place, len(stacked)))
                points = np.tile(anchor.point, (N * len(chains), 1))
                stacked.append(BodyLoad(anchor.after, points, np.zeros(points.shape)))
        placed = [chain.elements for chain in chains]
        return ChainFamily(
            MovingChains(common, sizes, placed, slots, stacked, N, rows, np.repeat(starts > 0, N)),
            slots,
            columns,
            taken,
            starts,
            np.array([-1 if c.end is None else c.end + 1 for c in chains], dtype=int),
            np.concatenate([group.end_point(i) for i in range(len(chains))]),
            tuple(held),
        )

    def pulls(self, of_chains: Sequence[np.ndarray]) -> np.ndarray | None:
        """Forces (rows, L, 3) at the points of its loads, from those on the anchors of chains."""
        if not self.held:
            return None
        found = np.zeros(self.arrays.load_force.shape)
        for chain, place, load in self.held:
            found[chain, load] = of_chains[chain][place]
        return found

    def rows(self, chain: int) -> slice:
        """Of a chain."""
        N = len(self.taken) // len(self.slots)
        return slice(chain * N, (chain + 1) * N)

    def coordinates(self, state: LegState) -> np.ndarray:
        """Of all chains, 0 where a chain has no element in a slot (rows, n)."""
        flat = np.concatenate([*(x.ravel() for x in state.x), np.zeros(1)])
        return flat[self.taken]

    def placements(self, group: LegGroup, state: LegState) -> Placement | None:
        """Of the bodies at the starts; None where all of them are the base."""
        if not self.arrays.body_rows:
            return None
        placed = [body.placement(own) for body, own in zip(state.bodies, group.points, strict=True)]
        N = group.count
        R = np.stack([np.broadcast_to(np.eye(3), (N, 3, 3)), *(own.R for own in placed)])
        t = np.stack([np.zeros((N, 3)), *(own.t for own in placed)])
        return Placement(R[self.starts].reshape(-1, 3, 3), t[self.starts].reshape(-1, 3))

    def centres(self, state: LegState) -> np.ndarray | None:
        """Points of the bodies at the starts (rows, 3) [m]."""
        if not self.arrays.body_rows:
            return None
        p = np.stack([np.zeros(state.bodies[0].p.shape), *(body.p for body in state.bodies)])
        return p[self.starts].reshape(-1, 3)

    def at_ends(self, state: LegState, platform: MovingBody) -> MovingBody:
        """The bodies at the ends."""
        if not state.bodies:
            number = len(self.ends)
            R = np.broadcast_to(platform.R, (number, *platform.R.shape))
            p = np.broadcast_to(platform.p, (number, *platform.p.shape))
            return MovingBody(R.reshape(-1, 3, 3), p.reshape(-1, 3))
        every = (platform, *state.bodies)  # -1 is 0 here: the base is at no end
        ends = np.maximum(self.ends, 0)
        R, p = np.stack([own.R for own in every]), np.stack([own.p for own in every])
        return MovingBody(R[ends].reshape(-1, 3, 3), p[ends].reshape(-1, 3))


@dataclass(frozen=True)
class Places:
    """Where the equations of the legs of a group have what their chains contribute.

    Attributes
    ----------
    entries, sides, shares : arrays of int
        Of all contributions to the tangent, to the residual, and to its rate by the share of loads.
    constant : (n, n) array
        Of the tangent: bodies between chains.
    by_twist : (N, n, r) array
        Of the residual, by the twist of the platform.
    """

    entries: np.ndarray
    sides: np.ndarray
    shares: np.ndarray
    constant: np.ndarray
    by_twist: np.ndarray

    @staticmethod
    def of(group: LegGroup, family: ChainFamily) -> Places:
        """The places for a group."""
        N, n, r = group.count, group.size, len(group.rows)
        number = len(group.chains)
        none, start = N * n, np.tile(np.arange(N), number)[:, None] * n
        own = np.full((N * number, len(family.arrays.order)), none)
        W = np.zeros((N * number, r), dtype=int)
        for i, columns in enumerate(family.columns):
            here = slice(i * N, (i + 1) * N)
            own[here, columns] = start[here] + group.moving_places(i)
            W[here] = start[here] + group.wrench_places[i].start + np.arange(r)
        sides = own, W
        entries = [
            np.where(
                (a < none)[:, :, None] & (b < none)[:, None],
                a[:, :, None] * n + b[:, None] % n,
                N * n * n,
            )
            for a, b in ((own, own), (W, own), (own, W))
        ]
        shares = (own,)
        constant, by_twist = np.zeros((n, n)), np.zeros((N, n, r))
        for i, chain in enumerate(group.chains):
            wrench = group.wrench_places[i]
            if chain.end is None:
                by_twist[:, wrench] -= np.eye(r)
            else:
                body = group.body_places[chain.end]
                constant[wrench, body] -= np.eye(r)
                constant[body, wrench] += np.eye(r)
        flat = [np.concatenate([one.ravel() for one in own]) for own in (entries, sides, shares)]
        return Places(flat[0], flat[1], flat[2], constant, by_twist)

    @staticmethod
    def summed(
        places: np.ndarray, values: Sequence[np.ndarray], shape: tuple[int, ...]
    ) -> np.ndarray:
        """Contributions added up at their places; what has none stands behind the last."""
        size = math.prod(shape)
        return np.bincount(places, np.concatenate(values), size + 1)[:size].reshape(shape)


def _kind(element: object) -> str:
    if isinstance(element, FiniteJoint):
        return "turn" if element.turns else "slide"
    return "spring"


def _merged(one: tuple[str, ...], other: tuple[str, ...]) -> tuple[str, ...]:
    """Kinds that contain both in order."""
    found: list[str] = []
    at = 0
    for kind in other:
        if kind in one[at:]:
            stop = one.index(kind, at) + 1
            found += one[at:stop]
            at = stop
        else:
            found.append(kind)
    return (*found, *one[at:])


def _places(own: Sequence[str], common: Sequence[str]) -> list[int]:
    """Slots of the elements of a chain: the first that fit."""
    slots = itertools.count()
    return [next(k for k in slots if common[k] == kind) for kind in own]


def _in_slots(loads: Sequence[BodyLoad], slots: np.ndarray) -> tuple[BodyLoad, ...]:
    """Loads behind slots in place of elements."""
    behind = [0, *(slots + 1).tolist()]
    return tuple(replace(load, after=behind[load.after]) for load in loads)
