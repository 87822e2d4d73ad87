"""The bodies of a linkage in the world, at one configuration, at many, or on recorded entries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.linkage.linkage import Connection
from robostiff.linkage.spanning_tree import SpanningTree
from robostiff.model import Chain
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
    """The bodies of a linkage at coordinates.

    Attributes
    ----------
    tree : SpanningTree
    q : mapping of str to arrays
        Coordinates of every connection (..., size) [m, rad]; (size,) where they are entries.
    frames : mapping of str to BodyFrame
        Of every body, along the tree.
    """

    tree: SpanningTree
    q: Mapping[str, np.ndarray]
    frames: Mapping[str, BodyFrame]

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
            else:
                frames[body] = frames[connection.b].before(bodies._over(connection, _WORLD))
        return bodies

    def beyond(self, connection: Connection) -> BodyFrame:
        """Where body b of a connection is, seen from body a."""
        return self._over(connection, self.frames[connection.a])

    def placed(self, connection: Connection) -> PlacedChain | None:
        """The element of a connection in the world; None of a weld."""
        return self._placed(connection, self.frames[connection.a])

    def gap(self, cut: Connection) -> Loop:
        """By how much a connection that closes a loop misses its body."""
        meant, there = self.beyond(cut), self.frames[cut.b]
        return Loop(cut.name, meant.R, meant.p, there.R, there.p, (), ())

    def _placed(self, connection: Connection, a: BodyFrame) -> PlacedChain | None:
        if connection.element is None:
            return None
        start = a.at(connection.before)
        chain = Chain((connection.element,))
        return place_chain(chain, self.q[connection.name], start.R, start.p)

    def _over(self, connection: Connection, a: BodyFrame) -> BodyFrame:
        end = self._placed(connection, a)
        start = a.at(connection.before) if end is None else BodyFrame(end.R, end.p)
        return start.at(connection.after)
