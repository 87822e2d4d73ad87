"""All chains of groups of legs, their elements side by side: computed together."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robostiff.spatial.rotation import vector_of_rotation
from robostiff.statics.chains.body_springs import Pulls, on_anchors
from robostiff.statics.chains.chain import (
    BodyLoad,
    ChainTerms,
    LegEquations,
    LegState,
    Share,
    stacked_loads,
)
from robostiff.statics.chains.moving_chain import MovingChains

if TYPE_CHECKING:
    from robostiff.statics.chains.legs import LegGroup


@dataclass(frozen=True)
class ChainFamily:
    """The chains of groups in slots: in each of them a chain has an element of its kind, or none.

    Rows of arrays are the legs of the first chain, then those of the next.

    Attributes
    ----------
    groups : tuple of LegGroup
    arrays : MovingChains
    rows : tuple of slice
        Of every chain.
    slots : tuple of arrays of int
        Of the elements of every chain.
    columns : tuple of arrays of int
        Of the unknowns that move every chain: of the body at its start, where that moves, its own.
    taken : (rows, n) array of int
        Where each coordinate stands among those of the states, one after the other, and a zero.
    starts, ends : (rows,) arrays of int
        Bodies at their ends: those between chains from 1 on; 0 for the base, and for the platform.
    held : tuple of (int, int, int)
        Chain, place among its anchors, and place among the loads, of every anchor.
    """

    groups: tuple[LegGroup, ...]
    arrays: MovingChains
    rows: tuple[slice, ...]
    slots: tuple[np.ndarray, ...]
    columns: tuple[np.ndarray, ...]
    taken: np.ndarray
    starts: np.ndarray
    ends: np.ndarray
    held: tuple[tuple[int, int, int], ...]

    @staticmethod
    def of(groups: Sequence[LegGroup]) -> ChainFamily:
        """The chains of some groups."""
        chains = [chain for group in groups for chain in group.chains]
        counts = [group.count for group in groups for _ in group.chains]
        stops = np.cumsum([0, *counts]).tolist()
        rows = tuple(itertools.starmap(slice, itertools.pairwise(stops)))
        kinds = [tuple(e.kind for e in chain.elements) for chain in chains]
        common: tuple[str, ...] = ()
        for own in sorted(dict.fromkeys(kinds), key=len, reverse=True):
            common = _merged(common, own)
        slots = []  # of the elements of each chain: the first that fit
        for own in kinds:
            left = itertools.count()
            first = [next(k for k in left if common[k] == kind) for kind in own]
            slots.append(np.array(first, dtype=int))
        sizes = np.ones(len(common), dtype=int)
        for chain, own in zip(chains, slots, strict=True):
            sizes[own] = np.maximum(sizes[own], [e.size for e in chain.elements])
        starts, ends, points = _bodies(groups)
        body_rows = groups[0].rows if np.any(starts) else ()
        first = (len(body_rows) + np.cumsum([0, *sizes])).tolist()
        columns = tuple(
            np.array(
                [
                    *(() if chain.start is None else range(len(body_rows))),
                    *(
                        column
                        for k, e in zip(own.tolist(), chain.elements, strict=True)
                        for column in range(first[k], first[k] + e.size)
                    ),
                ],
                dtype=int,
            )
            for own, chain in zip(slots, chains, strict=True)
        )
        last = sum(count * chain.size for count, chain in zip(counts, chains, strict=True))
        taken, at = np.full((stops[-1], int(sizes.sum())), last), 0
        for chain, own, here in zip(chains, columns, rows, strict=True):
            count = here.stop - here.start
            there = own[len(own) - chain.size :] - len(body_rows)
            taken[here, there] = np.arange(at, at + count * chain.size).reshape(count, chain.size)
            at += count * chain.size
        loads = [_in_slots(chain.loads, own) for chain, own in zip(chains, slots, strict=True)]
        stacked = list(stacked_loads(loads, counts))
        held = []
        for c, (chain, own) in enumerate(zip(chains, slots, strict=True)):
            for place, anchor in enumerate(_in_slots(chain.anchors, own)):
                held.append((c, place, len(stacked)))
                at_anchor = np.tile(anchor.point, (stops[-1], 1))
                stacked.append(BodyLoad(anchor.after, at_anchor, np.zeros(at_anchor.shape)))
        of_ends = (g.end_point(i) for g in groups for i in range(len(g.chains)))
        end_points = points[starts], np.concatenate([np.zeros((0, 3)), *of_ends])
        moves = starts > 0
        arrays = MovingChains(
            common, sizes, chains, slots, stacked, rows, end_points, body_rows, moves
        )
        return ChainFamily(
            tuple(groups), arrays, rows, tuple(slots), columns, taken, starts, ends, tuple(held)
        )

    @cached_property
    def places(self) -> tuple[Places, ...]:
        """Where the equations of every group have what its chains contribute."""
        chains, slots = iter(self.columns), iter(self.slots)
        return tuple(
            Places.of(
                group,
                [next(chains) for _ in group.chains],
                [next(slots) for _ in group.chains],
                self.arrays,
            )
            for group in self.groups
        )

    def equations(
        self, states: Sequence[LegState], R: np.ndarray, p: np.ndarray, share: Share
    ) -> list[LegEquations]:
        """Equilibrium and closure of every group; axes and point [m] of the platform are R, p."""
        rows = list(self.groups[0].rows)
        springs = [
            group.spring_arrays.at(group, state, share.value) if group.springs else None
            for group, state in zip(self.groups, states, strict=True)
        ]
        terms = self.terms(states, springs, share.value)
        J, tangent = terms.J[:, rows], terms.tangent + terms.bracket
        R_end, p_end = self._bodies(states, R, p, self.ends)
        turn = vector_of_rotation(terms.R @ np.swapaxes(R_end, -1, -2))
        gap = np.concatenate([terms.P - p_end, turn], axis=-1)[:, rows]
        by_J, found, at = -np.swapaxes(J, -1, -2), [], 0
        parts = zip(self.groups, states, springs, self.places, strict=True)
        for group, state, spring, known in parts:
            N, n = group.count, group.size
            own = slice(at, at := at + N * len(group.chains))
            A = known.summed(known.entries, (tangent[own], J[own], by_J[own]), (N, n, n))
            A += known.constant
            residual = known.summed(known.sides, (terms.gradient[own], gap[own]), (N, n))
            r_factor = known.summed(known.shares, (terms.by_share[own],), (N, n)) * share.rate
            for chain, acting in zip(group.chains, state.W, strict=True):
                if chain.end is not None:
                    residual[:, group.body_places[chain.end]] += acting
            missing, rate = (
                by_leg(part[own], N)[:, known.beams]
                for part in (terms.beams.missing, terms.beams.rate)
            )
            axial = missing, rate, known.beam_columns
            if group.couplings:
                group.add_couplings(state, share, A, residual, r_factor)
            if spring is not None:
                m = group.free_size
                A[0, :m, :m] += spring.stiffness
                r_factor[0, :m] += share.rate * spring.by_share
            found.append(LegEquations(A, residual, known.by_twist, r_factor, state, axial))
        return found

    def terms(
        self, states: Sequence[LegState], springs: Sequence[Pulls | None], share: float
    ) -> ChainTerms:
        """What the chains contribute, of numbers or of entries, with springs between bodies."""
        acting = np.concatenate([own for state in states for own in state.W])
        W = np.zeros((len(self.taken), 6), dtype=int).astype(acting.dtype)
        W[:, list(self.groups[0].rows)] = acting
        x, axial, starts = self.coordinates(states), self.axial(states), self.starting(states)
        return self.arrays.terms(x, *starts, W, axial, share, self._pulls(springs))

    def _pulls(self, springs: Sequence[Pulls | None]) -> np.ndarray | None:
        """Forces (rows, L, 3) at the points of its loads, from those on the anchors of chains."""
        if not self.held:
            return None
        of_chains: list[np.ndarray] = []
        for group, own in zip(self.groups, springs, strict=True):
            none = [np.zeros((0, 3))] * len(group.chains)
            of_chains += none if own is None else on_anchors(group, own.force)
        found = 0 * self.arrays.load_force
        for chain, place, load in self.held:
            found[self.rows[chain], load] = of_chains[chain][place]
        return found

    def coordinates(self, states: Sequence[LegState]) -> np.ndarray:
        """Of all chains, 0 where a chain has no element in a slot (rows, n)."""
        flat = [x.ravel() for state in states for x in state.x]
        return np.concatenate([*flat, np.zeros(1)])[self.taken]

    def axial(self, states: Sequence[LegState]) -> np.ndarray:
        """Axial forces of elastic parts, 0 of those that are no beams with bowing (rows, S)."""
        S, found = self.arrays.mode_stiffness.shape[1], []
        for group, state, known in zip(self.groups, states, self.places, strict=True):
            N, C = group.count, len(group.chains)
            own = np.zeros((N, C * S), dtype=int).astype(state.axial.dtype)
            own[:, known.beams] = state.axial
            found.append(np.swapaxes(own.reshape(N, C, S), 0, 1).reshape(C * N, S))
        return np.concatenate(found)

    def starting(self, states: Sequence[LegState]) -> tuple[np.ndarray, np.ndarray]:
        """Axes and points of the bodies at the starts [m]; those of the base alone."""
        if not self.arrays.body_rows:
            return np.eye(3), np.zeros(3)
        return self._bodies(states, np.eye(3), np.zeros(3), self.starts)

    def _bodies(
        self, states: Sequence[LegState], R: np.ndarray, p: np.ndarray, which: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Axes and points of bodies by number, with those of body 0."""
        bodies = [body for state in states for body in state.bodies]
        all_R = np.concatenate([R[None], *(body.R for body in bodies)])
        return all_R[which], np.concatenate([p[None], *(body.p for body in bodies)])[which]


def _bodies(groups: Sequence[LegGroup]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bodies at the starts and the ends of all chains, row by row, and the points of all bodies."""
    none = np.zeros(0, dtype=int)
    starts, ends, first = [none], [none], 1
    for group in groups:
        N = group.count
        for chain in group.chains:
            for found, body in ((starts, chain.start), (ends, chain.end)):
                of_legs = (
                    np.zeros(N, dtype=int) if body is None else np.arange(N) + body * N + first
                )
                found.append(of_legs)
        first += N * len(group.points)
    points = np.concatenate([np.zeros((1, 3)), *(own for g in groups for own in g.points)])
    return np.concatenate(starts), np.concatenate(ends), points


@dataclass(frozen=True)
class Places:
    """Where the equations of the legs of a group have what their chains contribute."""

    entries: np.ndarray  # of all contributions to the tangent
    sides: np.ndarray  # to the residual
    shares: np.ndarray  # to its rate by the share of loads
    constant: np.ndarray  # (n, n): of the tangent, bodies between chains
    by_twist: np.ndarray  # (N, n, r): of the residual, by the twist of the platform
    # beams with bowing among the elastic parts of all chains (b,), and where their coordinates are
    # among the unknowns (b, c); of the inner modes of beams (a,), those that there are
    beams: np.ndarray
    beam_columns: np.ndarray
    modes: np.ndarray

    @staticmethod
    def of(
        group: LegGroup,
        columns_of: Sequence[np.ndarray],
        slots_of: Sequence[np.ndarray],
        arrays: MovingChains,
    ) -> Places:
        """The places for a group, whose chains have unknowns and elements in columns and slots."""
        N, n, r, width = group.count, group.size, len(group.rows), len(arrays.order)
        number = len(group.chains)
        none, start = N * n, np.tile(np.arange(N), number)[:, None] * n
        own = np.full((N * number, width), none)
        W = np.zeros((N * number, r), dtype=int)
        for i, columns in enumerate(columns_of):
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
        constant, by_twist = np.zeros((n, n)), np.zeros((N, n, r))
        for i, chain in enumerate(group.chains):
            wrench = group.wrench_places[i]
            if chain.end is None:
                by_twist[:, wrench] -= np.eye(r)
            else:
                body = group.body_places[chain.end]
                constant[wrench, body] -= np.eye(r)
                constant[body, wrench] += np.eye(r)
        flat = [np.concatenate([one.ravel() for one in each]) for each in (entries, sides)]
        S, c = arrays.mode_stiffness.shape[1:]
        at = np.cumsum(np.isin(np.arange(arrays.slots), arrays.spring_elements)) - 1
        beams = [i * S + at[slots_of[i][k]] for i, k, _ in group.beams]
        inside = []
        columns = np.zeros((len(beams), c), dtype=int)
        for number, (i, k, beam) in enumerate(group.beams):
            place, first = group.chains[i].places[k], group.coordinates[i].start
            columns[number, : place.stop - place.start] = first + np.arange(place.start, place.stop)
            inside.append(12 * number + np.flatnonzero(np.any(beam.bending.b != 0, axis=0)))
        none = np.zeros(0, dtype=int)
        return Places(
            flat[0],
            flat[1],
            own.ravel(),
            constant,
            by_twist,
            np.array(beams, dtype=int),
            columns,
            np.concatenate([none, *inside]),
        )

    @staticmethod
    def summed(
        places: np.ndarray, values: Sequence[np.ndarray], shape: tuple[int, ...]
    ) -> np.ndarray:
        """Contributions added up at their places; what has none stands behind the last."""
        size = math.prod(shape)
        flat = np.concatenate([own.ravel() for own in values])
        return np.bincount(places, flat, size + 1)[:size].reshape(shape)


def by_leg(values: np.ndarray, count: int) -> np.ndarray:
    """Of elastic parts (C N, S, ...) of C chains, one after the other, by leg (N, C S, ...)."""
    chains, parts, rest = len(values) // count, values.shape[1], values.shape[2:]
    own = np.swapaxes(values.reshape(chains, count, parts, *rest), 0, 1)
    return own.reshape(count, chains * parts, *rest)


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


def _in_slots(loads: Sequence[BodyLoad], slots: np.ndarray) -> tuple[BodyLoad, ...]:
    """Loads behind slots in place of elements."""
    behind = [0, *(slots + 1).tolist()]
    return tuple(replace(load, after=behind[load.after]) for load in loads)
