"""A spanning tree of a linkage, and its bodies in the world: at numbers or recorded entries."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.linkage.linkage import Connection, Linkage
from robostiff.spatial import Frame
from robostiff.spatial.batch import product, transposed


@dataclass(frozen=True)
class BodyFrame:
    """Axes (..., 3, 3) and origin (..., 3) of a body in the world [m]."""

    R: np.ndarray
    p: np.ndarray

    def at(self, frame: Frame) -> BodyFrame:
        """A frame that is fixed to the body."""
        return BodyFrame(product(self.R, frame.R), self.p + self.R @ frame.p)

    def before(self, across: BodyFrame) -> BodyFrame:
        """The frame from which another one leads here."""
        R = product(self.R, transposed(across.R))
        return BodyFrame(R, self.p - np.einsum("...ij,...j->...i", R, across.p))


_WORLD = BodyFrame(np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class Bodies:
    """The bodies of a linkage at coordinates."""

    tree: SpanningTree
    # mapping of str to arrays: coordinates of every connection (..., size) [m, rad]; (size,) where
    # they are entries
    q: Mapping[str, np.ndarray]
    frames: Mapping[str, BodyFrame]  # of every body, along the tree
    _elements: dict[str, PlacedChain] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, tree: SpanningTree, q: Mapping[str, np.ndarray]) -> Bodies:
        """From the base outwards."""
        frames: dict[str, BodyFrame] = {}
        bodies = cls(tree, q, frames)
        for body, way in tree.ways.items():
            if not way:
                frames[body] = _WORLD
                continue
            connection, direction = way[-1]
            if direction > 0:
                frames[body] = bodies.beyond(connection)
            elif connection.rigid is not None:
                frames[body] = frames[connection.b].at(connection.rigid.inverse)
            else:
                across = _end(connection, bodies._placed(connection, _WORLD))
                frames[body] = frames[connection.b].before(across)
        return bodies

    @property
    def in_world(self) -> dict[str, Frame]:
        """Frames of the bodies, at one posture."""
        return {name: Frame(own.R, own.p) for name, own in self.frames.items()}

    def beyond(self, connection: Connection) -> BodyFrame:
        """Where body b of a connection is, seen from body a."""
        if connection.rigid is not None:
            return self.frames[connection.a].at(connection.rigid)
        return _end(connection, self.placed(connection))

    def placed(self, connection: Connection) -> PlacedChain:
        """The element of a connection in the world."""
        if connection.name not in self._elements:
            placed = self._placed(connection, self.frames[connection.a])
            self._elements[connection.name] = placed
        return self._elements[connection.name]

    def gap(self, cut: Connection) -> Loop:
        """By how much a connection that closes a loop misses its body."""
        meant, there = self.beyond(cut), self.frames[cut.b]
        return Loop(cut.name, meant.R, meant.p, there.R, there.p, (), ())

    def _placed(self, connection: Connection, a: BodyFrame) -> PlacedChain:
        start = a.at(connection.before)
        return place_chain(connection.chain, self.q[connection.name], start.R, start.p)


def _end(connection: Connection, placed: PlacedChain) -> BodyFrame:
    return BodyFrame(placed.R, placed.p).at(connection.after)


Way = tuple[tuple[Connection, float], ...]
"""Connections from the base to a body, each with 1 where it is passed from a to b, otherwise -1."""


@dataclass(frozen=True)
class SpanningTree:
    """Which connections lead to the bodies, and which close loops."""

    base: str
    # For every body that is connected with the base, in an order that walks outwards
    ways: Mapping[str, Way]
    cuts: tuple[Connection, ...]  # those that close loops

    @cached_property
    def in_loops(self) -> frozenset[str]:
        """Names of the connections that are part of a loop."""
        names: set[str] = set()
        for cut in self.cuts:
            names |= {c.name for c, _ in self.around(cut)}
        return frozenset(names)

    def around(self, cut: Connection) -> Way:
        """The loop that a connection closes, which comes first.

        Signs are 1 for what moves the end of the cut, -1 for what moves the body that it meets.
        """
        here, there = self.ways[cut.a], self.ways[cut.b]
        shared = {c.name for c, _ in here} & {c.name for c, _ in there}
        one = tuple((c, sign) for c, sign in here if c.name not in shared)
        other = tuple((c, -sign) for c, sign in there if c.name not in shared)
        return ((cut, 1.0), *one, *other)

    def length(self, frames: Mapping[str, Frame]) -> float:
        """Largest distance of a body or a joint from the base [m]; 1 where all are in one point."""
        far = [float(np.linalg.norm(frame.p)) for frame in frames.values()]
        for cut in self.cuts:
            far.append(float(np.linalg.norm((frames[cut.a] @ cut.before).p)))
        return max(far) or 1.0


def spanning_tree(linkage: Linkage) -> SpanningTree:
    """The tree of the connections that come first; those that close loops are later ones."""
    group = {body: body for body in linkage.bodies}
    at: dict[str, list[Connection]] = {body: [] for body in linkage.bodies}
    cuts = []
    for connection in linkage.connections:
        a, b = _root(group, connection.a), _root(group, connection.b)
        if a == b:
            cuts.append(connection)
            continue
        group[b] = a
        at[connection.a].append(connection)
        at[connection.b].append(connection)
    ways: dict[str, Way] = {linkage.base: ()}
    waiting = deque([linkage.base])
    while waiting:
        body = waiting.popleft()
        for connection in at[body]:
            forward = connection.a == body
            other = connection.b if forward else connection.a
            if other not in ways:
                ways[other] = (*ways[body], (connection, 1.0 if forward else -1.0))
                waiting.append(other)
    reached = tuple(cut for cut in cuts if cut.a in ways)
    return SpanningTree(linkage.base, ways, reached)


def _root(group: dict[str, str], body: str) -> str:
    """The body that stands for all that are connected with this one."""
    while group[body] != body:
        group[body] = group[group[body]]
        body = group[body]
    return body
