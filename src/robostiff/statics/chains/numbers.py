"""Where the unknowns of legs are, and what moves what: alike for all legs of one kind.

Unknowns are numbered component by component: coordinates of its chains, twists of its bodies,
wrenches of its chains, and what rigid couplings push with. Components of one kind are a block.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Hashable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from robostiff.frozen import frozen
from robostiff.kinematics.spanning_tree import connected_parts
from robostiff.statics.chains.elements import ChainKind, Spot

#: Columns of the modes of every elastic part; those that it lacks are empty.
WIDE = 6
_NONE = np.zeros(0, dtype=int)


@frozen
class LegsKind:
    """What the numbers of unknowns take from all legs."""

    chains: tuple[ChainKind, ...]
    bodies: int  # between chains
    rows: tuple[int, ...]  # coordinates in which bodies move
    anchors: tuple[Spot, ...]  # of springs between bodies
    meeting: tuple[tuple[int, ...], ...]  # chains that are coupled, or hold the same spring
    rigid: tuple[tuple[int, bool], ...]  # of rigid couplings: a chain, and whether it turns


class Component(NamedTuple):
    """What is connected while the platform is held."""

    chains: list[int]
    bodies: list[int]  # between its chains
    rigid: list[int]  # couplings


@frozen
class ComponentBlock:
    """N components of one kind."""

    at: np.ndarray  # (N, n): their unknowns
    free: int  # how many of these are coordinates and twists of bodies: m
    chains: np.ndarray  # (N, k)
    beams: np.ndarray  # (N, b): beams with bowing

    @property
    def coordinates(self) -> np.ndarray:
        """Its free unknowns (N, m)."""
        return self.at[:, : self.free]

    @property
    def closures(self) -> int:
        """How many closures a component has: n - m."""
        return self.at.shape[1] - self.free


class ChainNumbers:
    """What moves what in C chains side by side.

    Bodies are numbered: those at the starts of the chains, the longest chain first, then those
    behind the first elements of all chains, behind the second ones, and so on. Columns are the
    unknowns that move a chain, chain by chain: the twist of the body at its start, where that
    moves, then its own coordinates. Pairs are those of columns of one chain, the first not after
    the second.
    """

    def __init__(self, kind: LegsKind) -> None:
        chains, C = kind.chains, len(kind.chains)
        lengths = np.array([len(c.elements) for c in chains], dtype=int)
        rank = np.empty(C, dtype=int)
        rank[np.argsort(-lengths, kind="stable")] = np.arange(C)
        longer = [int(np.sum(lengths > k)) for k in range(lengths.max(initial=0))]
        first = np.cumsum([0, C, *longer])
        self.total: int = int(first[-1])  # of bodies
        #: Of every chain: at its start, and behind each of its elements.
        self.bodies: list[np.ndarray] = [
            first[: n + 1] + place for n, place in zip(lengths, rank, strict=True)
        ]
        #: The first and the last of these (C,).
        self.starts: np.ndarray = np.array([bodies[0] for bodies in self.bodies], dtype=int)
        self.last: np.ndarray = np.array([bodies[-1] for bodies in self.bodies], dtype=int)
        self.chains: np.ndarray = np.zeros(self.total, dtype=int)
        for c, bodies in enumerate(self.bodies):
            self.chains[bodies] = c
        #: Bodies behind elements, and those before them, step by step outwards.
        self.levels: list[tuple[slice, slice]] = [
            (slice(first[k + 1], first[k + 1] + n), slice(first[k], first[k] + n))
            for k, n in enumerate(longer)
        ]
        self.before: np.ndarray = np.zeros(self.total, dtype=int)
        for outer, inner in self.levels:
            self.before[outer] = np.arange(inner.start, inner.stop)
        moved = [0 if c.start is None else len(kind.rows) for c in chains]
        sizes = [[n, *(e.size for e in c.elements)] for n, c in zip(moved, chains, strict=True)]
        stops = np.cumsum([0, *map(sum, sizes)])
        width = np.diff(stops)
        repeated = [np.repeat(b, n) for b, n in zip(self.bodies, sizes, strict=True)]
        #: Body that each column moves, and its chain (Q,).
        self.body: np.ndarray = np.concatenate([_NONE, *repeated])
        self.of_chain: np.ndarray = np.repeat(np.arange(C), width)
        #: Columns that are coordinates of elements, in order; and those that are twists of bodies.
        self.coordinates: np.ndarray = np.flatnonzero(self.body >= len(chains))
        self.of_bodies: np.ndarray = np.flatnonzero(self.body < len(chains))
        upper = [np.array(np.triu_indices(n)) + at for n, at in zip(width, stops[:-1], strict=True)]
        self.pairs: np.ndarray = np.concatenate([np.zeros((2, 0), dtype=int), *upper], axis=1)
        a, b = self.pairs
        self.same: np.ndarray = np.flatnonzero(self.body[a] == self.body[b])
        start = np.cumsum([0, *(width * (width + 1) // 2)])[:-1]
        i, n = np.arange(len(self.body)) - stops[:-1][self.of_chain], width[self.of_chain]
        #: Of each column: its pair with itself; that with the k-th behind it stands k further.
        self.diagonal: np.ndarray = start[self.of_chain] + i * n - i * (i - 1) // 2
        self._set_elements(chains)
        loads = [(c, after) for c, chain in enumerate(chains) for after in chain.loads]
        self.first_anchor: int = len(loads)
        loads += kind.anchors
        bodies = [self.bodies[c][after] for c, after in loads]
        #: Bodies of loads, then, from the first anchor on, of these (L,).
        self.load_bodies: np.ndarray = np.array(bodies, dtype=int)
        beyond = [self.bodies[c][chains[c].start is None : after + 1] for c, after in loads]
        of_load = np.repeat(np.arange(len(loads)), [len(bodies) for bodies in beyond])
        #: Bodies whose motion moves a load, and that load.
        self.reach: tuple[np.ndarray, np.ndarray] = np.concatenate([_NONE, *beyond]), of_load

    def _set_elements(self, chains: Sequence[ChainKind]) -> None:
        pairs = zip(chains, self.bodies, strict=True)
        elements = [e for c, b in pairs for e in zip(b[1:], c.elements, strict=True)]
        firsts = np.cumsum([0, *(e.size for _, e in elements)]).tolist()
        numbered = [(b, i, e) for (b, e), i in zip(elements, firsts, strict=False)]
        joints = [(b, i) for b, i, e in numbered if not e.is_spring]
        springs = [(b, i, e) for b, i, e in numbered if e.is_spring]
        self.joint_bodies: np.ndarray = np.array([b for b, _ in joints], dtype=int)
        self.joint_x: np.ndarray = np.array([i for _, i in joints], dtype=int)
        self.spring_bodies: np.ndarray = np.array([b for b, *_ in springs], dtype=int)
        parts = enumerate(e for *_, e in springs)
        #: Coordinates of elastic parts: among all that there might be, and among all of chains.
        self.full: np.ndarray = np.concatenate(
            [_NONE, *(WIDE * i + np.arange(e.size) for i, e in parts)]
        )
        self.spring_x: np.ndarray = np.concatenate(
            [_NONE, *(i + np.arange(e.size) for _, i, e in springs)]
        )
        part, place = np.divmod(self.full, WIDE)
        a, b = np.nonzero((part[:, None] == part) & (place[:, None] <= place))
        #: Part, row and column of what elastic parts contribute to pairs, and these.
        self.block_entries: tuple[np.ndarray, ...] = part[a], place[a], place[b]
        self.block_pairs: np.ndarray = (
            self.diagonal[self.coordinates[self.spring_x[a]]] + place[b] - place[a]
        )
        beams = [i for i, (*_, e) in enumerate(springs) if e.inner is not None]
        #: Among elastic parts, those with bowing.
        self.beams: np.ndarray = np.array(beams, dtype=int)


class LegNumbers:
    """Where T unknowns are, and where their equations have what chains contribute.

    The tangent is flat: its blocks (N, n, n) one behind the other.
    """

    starts: np.ndarray
    ends: np.ndarray

    def __init__(self, kind: LegsKind) -> None:
        self.of_chains: ChainNumbers = ChainNumbers(kind)
        chains, r = kind.chains, len(kind.rows)
        counts = [sum(e.size for e in c.elements) for c in chains]
        #: Coordinates of each chain among all, and of all elements, by chain and place there.
        self.coordinates: list[slice] = _slices(counts)
        self.places: dict[tuple[int, int], slice] = {}
        for c, (chain, whole) in enumerate(zip(chains, self.coordinates, strict=True)):
            for k, at in enumerate(_slices([e.size for e in chain.elements])):
                self.places[c, k] = slice(whole.start + at.start, whole.start + at.stop)
        #: Bodies where chains begin, -1 for the base, and where they end, -1 for the platform (C,).
        self.starts, self.ends = (
            np.array([-1 if body is None else body for body in bodies], dtype=int)
            for bodies in ([c.start for c in chains], [c.end for c in chains])
        )
        self.on_platform: np.ndarray = np.flatnonzero(self.ends < 0)
        self.inner_chains: np.ndarray = np.flatnonzero(self.ends >= 0)
        meeting: list[list[Hashable]] = [
            [c, *((b,) for b in (chain.start, chain.end) if b is not None)]
            for c, chain in enumerate(chains)
        ]
        meeting += [list[Hashable](spots) for spots in kind.meeting if spots]
        nodes: list[Hashable] = [*range(len(chains)), *((b,) for b in range(kind.bodies))]
        first, found = connected_parts(nodes, meeting), dict[Hashable, Component]()
        for c in range(len(chains)):
            found.setdefault(first[c], Component([], [], [])).chains.append(c)
        for b in range(kind.bodies):
            found[first[b,]].bodies.append(b)
        for i, (c, _) in enumerate(kind.rigid):
            found[first[c]].rigid.append(i)
        self.components: list[Component] = list(found.values())
        #: Coordinates (U,); of rigid couplings; twists of bodies (bodies, r); wrenches (C, r).
        self.x: np.ndarray = np.zeros(sum(counts), dtype=int)
        self.multipliers: np.ndarray = np.zeros(len(kind.rigid), dtype=int)
        self.bodies: np.ndarray = np.zeros((kind.bodies, r), dtype=int)
        self.W: np.ndarray = np.zeros((len(chains), r), dtype=int)
        self._set_blocks(kind)
        # where chains contribute to the tangent, and what the twist of the platform does
        a, b = self.of_chains.pairs
        self.off_diagonal: np.ndarray = np.flatnonzero(a != b)  # pairs of different columns
        starts = (_NONE if c.start is None else self.bodies[c.start] for c in kind.chains)
        both = zip(starts, (self.x[place] for place in self.coordinates), strict=True)
        #: Columns of `ChainTerms` (Q,).
        self.columns: np.ndarray = np.concatenate(
            [_NONE, *(part for pair in both for part in pair)]
        )
        a, b, across = self.columns[a], self.columns[b], self.W[self.of_chains.of_chain]
        to, one = self.W[self.inner_chains], self.columns[:, None]
        fro = self.bodies[self.ends[self.inner_chains]]
        pairs = [(a, b), (b[a != b], a[a != b]), (across, one), (one, across), (to, fro), (fro, to)]
        #: Of all that chains contribute to the tangent; of it, last, what bodies between them do.
        self.entries: np.ndarray = np.concatenate([self.place(i, j).ravel() for i, j in pairs])
        self.constants: np.ndarray = np.repeat([-1.0, 1.0], to.size)
        #: Of the residual, by the twist of the platform (T, r).
        self.by_twist: np.ndarray = np.zeros((self.total, len(kind.rows)))
        self.by_twist[self.W[self.on_platform]] = -np.eye(len(kind.rows))

    def _set_blocks(self, kind: LegsKind) -> None:
        """Number the unknowns."""
        chains, r, of_chain = kind.chains, len(kind.rows), defaultdict(list)
        each = [(place, chains[place[0]].elements[place[1]]) for place in self.places]
        beams = [place for place, e in each if e.inner is not None]
        for i, (c, _) in enumerate(beams):
            of_chain[c].append(i)
        kinds: dict[Hashable, list[Component]] = defaultdict(list)
        for component in self.components:
            elements = tuple(chains[c].elements for c in component.chains)
            turns = tuple(kind.rigid[i][1] for i in component.rigid)
            kinds[elements, len(component.bodies), turns].append(component)
        blocks, rows, local, total, entries = [], [_NONE], [_NONE], 0, 0
        for alike in kinds.values():
            at = []
            for several, inner, rigid in alike:
                parts = [self.x[self.coordinates[c]] for c in several]
                parts += [self.bodies[b] for b in inner]
                parts += [self.W[c] for c in several]
                parts += [self.multipliers[i : i + 1] for i in rigid]
                n = sum(map(len, parts))
                at.append(np.arange(total, total + n))
                for part, place in zip(parts, _slices(list(map(len, parts))), strict=True):
                    part[:] = at[-1][place]
                rows.append(entries + n * np.arange(n))
                local.append(np.arange(n))
                total, entries = total + n, entries + n * n
            free = sum(e.size for c in alike[0].chains for e in chains[c].elements)
            beams_of = [[i for c in one.chains for i in of_chain[c]] for one in alike]
            blocks.append(
                ComponentBlock(
                    np.array(at),
                    free + r * len(alike[0].bodies),
                    np.array([one.chains for one in alike]),
                    np.array(beams_of, dtype=int),
                )
            )
        self.total: int = total  # T
        self.blocks: tuple[ComponentBlock, ...] = tuple(blocks)
        #: Where the row of its component begins in the flat tangent; its number there (T,).
        self.rows: np.ndarray = np.concatenate(rows)
        self.local: np.ndarray = np.concatenate(local)
        #: Coordinates of beams (B, 6); any where one has fewer.
        self.beams: np.ndarray = np.zeros((len(beams), WIDE), dtype=int)
        for at, place in zip(self.beams, beams, strict=True):
            x = self.x[self.places[place]]
            at[: len(x)] = x

    @property
    def widest(self) -> int:
        """The most free unknowns that a component has."""
        return max((block.free for block in self.blocks), default=0)

    def bodies_at(self, spots: Sequence[Spot], robots: int = 1) -> np.ndarray:
        """Bodies of chains (M,) by their places in one of so many robots; those of all of them."""
        bodies = self.of_chains.bodies
        firsts = range(0, len(bodies), max(len(bodies) // robots, 1))
        return np.array([bodies[first + c][after] for first in firsts for c, after in spots], int)

    def place(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Of entries of the flat tangent, by unknowns of one component."""
        return self.rows[a] + self.local[b]


@lru_cache(maxsize=64)
def numbers_of(kind: LegsKind) -> LegNumbers:
    """The numbers of all legs of a kind: alike at all poses, and under all wrenches."""
    found = LegNumbers(kind)
    for array in (*vars(found).values(), *vars(found.of_chains).values()):
        if isinstance(array, np.ndarray):  # robots share them
            array.setflags(write=False)
    return found


def _slices(sizes: Sequence[int]) -> list[slice]:
    """Places of so many values, one behind the other."""
    ends = itertools.accumulate(sizes, initial=0)
    return list(itertools.starmap(slice, itertools.pairwise(ends)))


def side_by_side(
    robots: int, values: Sequence[Any], *shape: int, kind: np.dtype[Any] | type = float
) -> np.ndarray:
    """Values of one robot ``(..., *shape)``, at one pose or so many, as ``(n, *shape)``."""
    found = np.zeros((robots, len(values), *shape), kind)
    for i, value in enumerate(values):
        found[:, i] = value
    return found.reshape(robots * len(values), *shape)


def sums_at(places: np.ndarray, values: np.ndarray, size: int) -> np.ndarray:
    """Sums of numbers, or of entries, by their places (size,)."""
    if values.dtype != object:
        return np.asarray(np.bincount(places, values, size), dtype=float)  # empty: of integers
    found = np.zeros(size, dtype=int).astype(object)
    np.add.at(found, places, values)
    return found
