"""Where the unknowns of legs are.

They are numbered component by component: coordinates of its chains, twists of its bodies, wrenches
of its chains, and what rigid couplings push with. Components of one kind are a block.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    pass


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

    def place(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Of entries of the flat tangent, by unknowns of one component."""
        return self.rows[a] + self.local[b]

    def summed(self, places: np.ndarray, values: Sequence[np.ndarray]) -> np.ndarray:
        """The flat tangent: contributions added up at their places."""
        size = sum(own.at.size * own.at.shape[1] for own in self.blocks)
        return summed(places, np.concatenate([own.ravel() for own in values]), size)

    def as_blocks(self, A: np.ndarray) -> tuple[np.ndarray, ...]:
        """The blocks (N, n, n) of a flat tangent."""
        found, start = [], 0
        for own in self.blocks:
            N, n = own.at.shape
            found.append(A[start : start + N * n * n].reshape(N, n, n))
            start += N * n * n
        return tuple(found)


def summed(places: np.ndarray, values: np.ndarray, size: int) -> np.ndarray:
    """Sums of numbers, or of entries, by their places (size,)."""
    if values.dtype != object:
        return np.bincount(places, values, size)
    found = np.zeros(size, dtype=int).astype(object)
    np.add.at(found, places, values)
    return found
