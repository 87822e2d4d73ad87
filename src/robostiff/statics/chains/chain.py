"""Chains of elements between two bodies, the loads on the bodies within, and how they move."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robostiff.statics.chains.element import BodyPlace, Element, stacked


@dataclass(frozen=True)
class BodyLoad:
    """A force that keeps its direction, at a point of the body behind some elements of a chain."""

    after: int  # how many elements lie before the body
    point: np.ndarray  # (N, 3), or (3,) of entries: where it acts at the unloaded posture [m]
    force: np.ndarray  # alike, in the world [N]


@dataclass(frozen=True)
class FiniteChain:
    """Elements in series from one body to another, of several legs alike."""

    start: int | None  # body at its start; None for the base
    end: int | None  # body at its end; None for the platform
    elements: tuple[Element, ...]
    loads: tuple[BodyLoad, ...] = ()
    # where springs between bodies are held, without a force of their own
    anchors: tuple[BodyLoad, ...] = ()

    @staticmethod
    def stacked(chains: Sequence[FiniteChain], counts: Sequence[int]) -> FiniteChain:
        """Chains whose elements are alike as one, each of so many legs."""
        first = chains[0]
        elements = tuple(
            stacked([own.elements[k] for own in chains]) for k in range(len(first.elements))
        )
        loads = stacked_loads([own.loads for own in chains], counts)
        return FiniteChain(first.start, first.end, elements, loads)

    @cached_property
    def places(self) -> tuple[slice, ...]:
        """Coordinates of each element."""
        ends = np.cumsum([0] + [e.size for e in self.elements])
        return tuple(slice(int(a), int(b)) for a, b in itertools.pairwise(ends))

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.places[-1].stop if self.places else 0

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return (self.start, self.end, *(e.signature for e in self.elements))


def stacked_loads(
    loads: Sequence[tuple[BodyLoad, ...]], counts: Sequence[int]
) -> tuple[BodyLoad, ...]:
    """Loads of several chains as those of one; a chain that has fewer carries zero forces.

    Each of the chains has so many legs.
    """
    found = []
    for after in sorted({load.after for own in loads for load in own}):
        there = [[load for load in own if load.after == after] for own in loads]
        for i in range(max(len(own) for own in there)):
            points, forces = [], []
            for own, count in zip(there, counts, strict=True):
                has = i < len(own)
                points.append(own[i].point if has else np.zeros((count, 3)))
                forces.append(own[i].force if has else np.zeros((count, 3)))
            found.append(BodyLoad(after, np.concatenate(points), np.concatenate(forces)))
    return tuple(found)


@dataclass(frozen=True)
class Moved:
    """Chains in finite motion."""

    # (N, K + 1, 4, 4): motion from the unloaded posture of the body at the start, and of that
    # behind every element
    T: np.ndarray

    @property
    def placements(self) -> tuple[BodyPlace, ...]:
        """Of the body at the start, and of that behind every element."""
        return tuple(self._placement(k) for k in range(self.T.shape[1]))

    @property
    def end(self) -> BodyPlace:
        """Where the body at the end is, as the chain has it."""
        return self._placement(-1)

    def _placement(self, k: int) -> BodyPlace:
        return BodyPlace(self.T[:, k, :3, :3], self.T[:, k, :3, 3])


@dataclass(frozen=True)
class ChainTerms:
    """What chains contribute to the equations of their legs."""

    end: BodyPlace  # where the body at the end is, as the chain has it
    # (N, 6, n): velocity of the end point and angular velocity, by the unknowns that move the
    # chain: of the body at its start, where that moves, then its own
    J: np.ndarray
    # (N, n, n): curvature of the energy, less what wrench and loads do in second order
    tangent: np.ndarray
    gradient: np.ndarray  # (N, n): of the energy, less the work of wrench and loads
    by_share: np.ndarray  # (N, n): derivative of the gradient by the share of loads and preloads
