"""The bodies of a linkage in the world, (5) along a spanning tree, of numbers or entries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.kinematics.spanning_tree import SpanningTree
from robostiff.linkage.linkage import Connection
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

    tree: SpanningTree[Connection]
    # mapping of str to arrays: coordinates of every connection (..., size) [m, rad]; (size,) where
    # they are entries
    q: Mapping[str, np.ndarray]
    frames: Mapping[str, BodyFrame]  # of every body, along the tree
    _elements: dict[str, PlacedChain] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, tree: SpanningTree[Connection], q: Mapping[str, np.ndarray]) -> Bodies:
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

    @property
    def length(self) -> float:
        """Largest distance of a body or a joint from the base [m]; 1 where all are in one point."""
        frames = self.in_world
        far = [float(np.linalg.norm(frame.p)) for frame in frames.values()]
        for cut in self.tree.cuts:
            far.append(float(np.linalg.norm((frames[cut.a] @ cut.before).p)))
        return max(far) or 1.0

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
