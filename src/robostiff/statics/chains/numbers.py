"""Where the unknowns of legs are.

They are numbered component by component: coordinates of its chains, twists of its bodies, wrenches
of its chains, and what rigid couplings push with. Components of one kind are a block.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from robostiff.statics.chains.legs import Legs


class Component(NamedTuple):
    """What is connected while the platform is held."""

    chains: list[int]
    bodies: list[int]  # between its chains
    rigid: list[int]  # couplings


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class Numbers:
    """Where T unknowns are, and where their equations have what chains contribute.

    The tangent is flat: its blocks (N, n, n) one behind the other.
    """

    total: int
    blocks: tuple[ComponentBlock, ...]
    x: np.ndarray  # (U,): coordinates of all chains
    bodies: np.ndarray  # (bodies, r): twists of the bodies between them
    W: np.ndarray  # (C, r): their wrenches
    held: np.ndarray  # of rigid couplings
    columns: np.ndarray  # (Q,): columns of `ChainTerms`
    beams: np.ndarray  # (B, 6): coordinates of beams; any where one has fewer
    #: Of each unknown: where the row of its component begins in the flat tangent; its number there.
    rows: np.ndarray
    local: np.ndarray
    entries: np.ndarray  # of all contributions of chains to the tangent
    constants: np.ndarray  # the last of these: of bodies between chains
    by_twist: np.ndarray  # (T, r): of the residual, by the twist of the platform

    @staticmethod
    def of(legs: Legs) -> Numbers:
        """Of some legs."""
        r, chains, of_chain = len(legs.rows), legs.chains, defaultdict(list)
        for i, (c, k, beam) in enumerate(legs.beams):
            of_chain[c].append((i, k, beam))
        kinds: dict[Hashable, list[Component]] = defaultdict(list)
        for own in legs.components:
            beams = ((k, legs.inner_modes[i]) for c in own.chains for i, k, _ in of_chain[c])
            sizes = tuple(tuple(e.size for e in chains[c].elements) for c in own.chains)
            turns = tuple(legs.rigid[i].drive.turns for i in own.rigid)
            kind = sizes, len(own.bodies), turns, tuple((k, has.tobytes()) for k, has in beams)
            kinds[kind].append(own)
        x, held = (np.zeros(n, dtype=int) for n in (len(legs.arrays.coordinates), len(legs.rigid)))
        bodies, W = (np.zeros((len(n), r), dtype=int) for n in (legs.points, chains))
        none, blocks, total, entries = np.zeros(0, dtype=int), [], 0, 0
        rows, local = [none], [none]
        for each in kinds.values():
            at = []
            free = sum(chains[c].size for c in each[0].chains) + r * len(each[0].bodies)
            for own, inner, rigid in each:
                parts = [x[legs.coordinates[c]] for c in own] + [bodies[b] for b in inner]
                parts += [*(W[c] for c in own), *(held[i : i + 1] for i in rigid)]
                n = sum(map(len, parts))
                at.append(np.arange(total, total + n))
                for part, place in zip(parts, _split(at[-1], parts), strict=True):
                    part[:] = place
                rows.append(entries + n * np.arange(n))
                local.append(np.arange(n))
                total, entries = total + n, entries + n * n
            beams = [[beam for c in own for beam in of_chain[c]] for own, *_ in each]
            blocks.append(
                ComponentBlock(
                    np.array(at),
                    free,
                    np.array([own for own, *_ in each]),
                    np.array([[i for i, *_ in own] for own in beams], dtype=int),
                )
            )
        a, b = legs.arrays.pairs
        starts = ((bodies[own.start] if own.start is not None else none) for own in chains)
        both = zip(starts, (x[own] for own in legs.coordinates), strict=True)
        columns = np.concatenate([none, *(part for pair in both for part in pair)])
        a, b, across = columns[a], columns[b], W[legs.arrays.of_chain]
        to, fro, one = W[legs.inner_chains], bodies[legs.ends[legs.inner_chains]], columns[:, None]
        every = [(a, b), (b[a != b], a[a != b]), (across, one), (one, across), (to, fro), (fro, to)]
        rows, local = np.concatenate(rows), np.concatenate(local)
        by_twist = np.zeros((total, r))
        by_twist[W[legs.on_platform]] = -np.eye(r)
        beams = np.zeros((len(legs.beams), 6), dtype=int)
        for i, (c, k, beam) in enumerate(legs.beams):
            beams[i, : beam.size] = x[legs.places[c, k]]
        return Numbers(
            total=total,
            blocks=tuple(blocks),
            x=x,
            bodies=bodies,
            W=W,
            held=held,
            columns=columns,
            beams=beams,
            rows=rows,
            local=local,
            entries=np.concatenate([(rows[i] + local[j]).ravel() for i, j in every]),
            constants=np.repeat([-1.0, 1.0], to.size),
            by_twist=by_twist,
        )

    def place(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Of entries of the flat tangent, by unknowns of one component."""
        return self.rows[a] + self.local[b]

    def summed(self, places: np.ndarray, *values: np.ndarray) -> np.ndarray:
        """The flat tangent: contributions added up at their places."""
        size = sum(own.at.size * own.at.shape[1] for own in self.blocks)
        return np.bincount(places, np.concatenate([own.ravel() for own in values]), size)

    def as_blocks(self, A: np.ndarray) -> tuple[np.ndarray, ...]:
        """The blocks (N, n, n) of a flat tangent."""
        found, start = [], 0
        for own in self.blocks:
            N, n = own.at.shape
            found.append(A[start : start + N * n * n].reshape(N, n, n))
            start += N * n * n
        return tuple(found)


def _split(values: np.ndarray, parts: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Values cut into as many as each part has."""
    return np.split(values, np.cumsum([len(own) for own in parts[:-1]], dtype=int))
