"""A chain of elements between two bodies in finite motion: velocities and their derivatives."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robostiff.spatial import cross
from robostiff.statics.element import Columns, Element, Placement


@dataclass(frozen=True)
class BodyLoad:
    """A force that keeps its direction, at a point of the body behind some elements of a chain.

    Attributes
    ----------
    after : int
        How many elements lie before the body.
    point : (N, 3) array
        Where it acts at the unloaded posture [m].
    force : (N, 3) array
        In the world [N].
    """

    after: int
    point: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class FiniteChain:
    """Elements in series from one body to another, of several legs alike.

    Attributes
    ----------
    start : int or None
        Body at its start; None for the base.
    end : int or None
        Body at its end; None for the platform.
    elements : tuple of FiniteJoint or FiniteSpring
    loads : tuple of BodyLoad
    """

    start: int | None
    end: int | None
    elements: tuple[Element, ...]
    loads: tuple[BodyLoad, ...] = ()

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
        loads = tuple(load.after for load in self.loads)
        return (self.start, self.end, loads, *(e.signature for e in self.elements))


@dataclass(frozen=True)
class Moved:
    """A chain in finite motion.

    Attributes
    ----------
    columns : tuple of Columns
        Of the body at its start, where that moves, then of every element.
    placements : tuple of Placement
        Of the body at its start, and of that behind every element.
    """

    columns: tuple[Columns, ...]
    placements: tuple[Placement, ...]

    @property
    def end(self) -> Placement:
        """Where the body at its end is, as the chain has it."""
        return self.placements[-1]


def moved(chain: FiniteChain, x: np.ndarray, start: Placement, body: Columns | None) -> Moved:
    """The chain at coordinates x (N, n), from where its start is.

    Parameters
    ----------
    chain : FiniteChain
    x : (N, n) array
    start : Placement
        Of the body at its start.
    body : Columns or None
        Velocities of that body by its own coordinates; None for the base.
    """
    columns = [] if body is None else [body]
    placements = [start]
    for element, place in zip(chain.elements, chain.places, strict=True):
        own, after = element.step(x[:, place], placements[-1])
        columns.append(own)
        placements.append(after)
    return Moved(tuple(columns), tuple(placements))


@dataclass(frozen=True)
class Velocities:
    """How a point P of the last of some bodies in series moves, by the coordinates of all.

    Attributes
    ----------
    v, w : (N, 3, n) arrays
        Velocity of P and angular velocity.
    P : (N, 3) array
    columns : tuple of Columns
        Element by element.
    """

    v: np.ndarray
    w: np.ndarray
    P: np.ndarray
    columns: tuple[Columns, ...]

    @property
    def J(self) -> np.ndarray:
        """Both of them (N, 6, n)."""
        return np.concatenate([self.v, self.w], axis=1)

    def of_wrench(self, f: np.ndarray, m: np.ndarray) -> np.ndarray:
        """``W . d_b J_a`` for a wrench (f, m) about P, which moves along (N, n, n), rows a.

        With a nearer the base than b, ``d_b v_a = w_a x v_b`` and ``d_b w_a = 0``; with b nearer,
        ``d_b v_a = w_b x v_a`` and ``d_b w_a = w_b x w_a``, the Lie bracket. Within an element,
        ``d_b v_a = d_b w_a x s + w_a x (w_b x s)``, s from its point to P.

        Parameters
        ----------
        f, m : (N, 3) arrays
            Force [N] and moment about P [N m].
        """
        w = np.swapaxes(self.w, -1, -2)
        U = w @ _crossed(self.v, f, after=True)
        bracket = w @ _crossed(self.w, m, after=False)
        order = self._order
        nearer = order[:, None] < order[None, :]
        H = np.where(nearer, U, np.swapaxes(U, -1, -2) + bracket)
        start = 0
        for own in self.columns:
            size = own.w.shape[-1]
            place = slice(start, start + size)
            start += size
            s = self.P - own.C
            turned = w[:, place] @ _crossed(_crossed(own.w, s, after=True), f, after=True)
            if own.rates is not None and own.turning is not None:
                about_C = m + cross(s, f)
                M = np.einsum("ni,nikb->nkb", about_C, own.rates)
                turned = turned + np.swapaxes(own.turning, -1, -2) @ M @ own.turning
            H[:, place, place] = turned
        return H

    @cached_property
    def _order(self) -> np.ndarray:
        sizes = [own.w.shape[-1] for own in self.columns]
        return np.repeat(np.arange(len(sizes)), sizes)


def velocities(columns: Sequence[Columns], P: np.ndarray) -> Velocities:
    """How a point P (N, 3) of the last body moves."""
    w = np.concatenate([own.w for own in columns], axis=-1)
    v = np.concatenate([own.v + _crossed(own.w, P - own.C, after=True) for own in columns], axis=-1)
    return Velocities(v, w, P, tuple(columns))


def _crossed(vectors: np.ndarray, by: np.ndarray, *, after: bool) -> np.ndarray:
    """Columns of (N, 3, n) times vectors (N, 3): ``column x by``, or ``by x column``."""
    a1, a2, a3 = vectors[:, 0], vectors[:, 1], vectors[:, 2]
    b1, b2, b3 = by[:, 0, None], by[:, 1, None], by[:, 2, None]
    out = np.stack([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1], axis=1)
    return out if after else -out
