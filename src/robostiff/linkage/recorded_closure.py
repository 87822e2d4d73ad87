"""The closure of a linkage as a record: bodies on entries, and Newton steps from home."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.kinematics.formula.body import tidied, tidied_point
from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.kinematics.jacobians import freedom_twist
from robostiff.linkage.closure import Configuration
from robostiff.linkage.driven import DrivenLinkage, coordinate_names, named
from robostiff.linkage.linkage import Connection
from robostiff.linkage.spanning_tree import SpanningTree
from robostiff.model import Chain, Joint
from robostiff.record import Record
from robostiff.recorded.closure import RecordedClosure, handed_on, steps_from_home
from robostiff.recorded.newton_step import (
    ClosureGroup,
    Opening,
    joint_steps,
    per_turn,
    step_of_groups,
)
from robostiff.spatial import Frame


@dataclass(frozen=True)
class RecordedFrame:
    """Axes and origin of a body in the world, on entries."""

    R: np.ndarray
    p: np.ndarray

    def at(self, frame: Frame) -> RecordedFrame:
        """A frame that is fixed to the body."""
        return RecordedFrame(self.R @ tidied(frame.R), self.p + self.R @ tidied_point(frame.p))

    def before(self, across: RecordedFrame) -> RecordedFrame:
        """The frame from which another one leads here."""
        R = self.R @ across.R.T
        return RecordedFrame(R, self.p - R @ across.p)


_WORLD = RecordedFrame(np.eye(3, dtype=int).astype(object), np.zeros(3, dtype=int).astype(object))


@dataclass(frozen=True)
class RecordedBodies:
    """The bodies of a linkage at coordinates that are entries or numbers.

    Attributes
    ----------
    tree : SpanningTree
    q : mapping of str to arrays
        Coordinates of every connection.
    frames : mapping of str to RecordedFrame
        Of every body, along the tree.
    """

    tree: SpanningTree
    q: Mapping[str, np.ndarray]
    frames: Mapping[str, RecordedFrame]

    @classmethod
    def of(cls, tree: SpanningTree, q: Mapping[str, np.ndarray]) -> RecordedBodies:
        """From the base outwards."""
        frames: dict[str, RecordedFrame] = {}
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

    def beyond(self, connection: Connection) -> RecordedFrame:
        """Where body b of a connection is, seen from body a."""
        return self._over(connection, self.frames[connection.a])

    def placed(self, connection: Connection) -> PlacedChain | None:
        """The element of a connection in the world."""
        return self._placed(connection, self.frames[connection.a])

    def _placed(self, connection: Connection, a: RecordedFrame) -> PlacedChain | None:
        if connection.element is None:
            return None
        start = a.at(connection.before)
        chain = Chain((connection.element,))
        return place_chain(chain, self.q[connection.name], start.R, start.p)

    def _over(self, connection: Connection, a: RecordedFrame) -> RecordedFrame:
        end = self._placed(connection, a)
        start = a.at(connection.before) if end is None else RecordedFrame(end.R, end.p)
        return start.at(connection.after)


def record_linkage_closure(
    driven: DrivenLinkage, samples: Sequence[Configuration]
) -> RecordedClosure | None:
    """Record the closure of a linkage from coordinates of its drives.

    Parameters
    ----------
    driven : DrivenLinkage
    samples : sequence of Configuration
        Closed, in general position.

    Returns
    -------
    RecordedClosure or None
        None where home is singular, or joints that resist are left undetermined.
    """
    part, tree, length = driven.part, driven.tree, driven.home.length
    following = driven.following(samples)
    by_name = {c.name: c for c in part.connections}
    drives = [by_name[name] for name in driven.drives]
    closed = [*samples, driven.home]  # the last one is home: a pivot that vanishes there is none
    given = _sampled(drives, closed)
    state = _sampled(following, closed)
    record = Record({**given, **state, **handed_on(len(closed))})
    bodies = RecordedBodies.of(tree, coordinates(driven, record, (*drives, *following)))
    groups = [
        ClosureGroup(
            [Opening(gap, _rates(bodies, gap, cut, moving, length)) for cut, gap in loops],
            [name for c in moving for name in coordinate_names(c)],
        )
        for loops, moving in _groups(bodies, following)
    ]

    def in_coordinates(found: dict[str, Any]) -> dict[str, Any]:
        steps: dict[str, Any] = {}
        for c in following:
            if isinstance(c.element, Joint):
                names, own = coordinate_names(c), bodies.q[c.name]
                steps |= joint_steps(c.element, names, own, c.element.freedoms, found, length)
        return steps

    step = step_of_groups(groups, [], in_coordinates, length)
    # Passive freedoms that no loop determines, as a rod that spins, stay where they are at home.
    if step.undetermined and len(following) > len(driven.passive(following)):
        return None
    q = {name: record.input(name) for name in (*given, *state)}
    start = named(following, driven.home.coordinates)
    return steps_from_home(record, tuple(given), start, step, q)


def coordinates(
    driven: DrivenLinkage, record: Record, moving: Sequence[Connection]
) -> dict[str, np.ndarray]:
    """Coordinates of all connections: inputs of a record, or as at home."""
    q: dict[str, np.ndarray] = dict(driven.home.coordinates)
    for c in moving:
        q[c.name] = np.array([record.input(name) for name in coordinate_names(c)], dtype=object)
    return q


def _sampled(
    connections: Sequence[Connection], closed: Sequence[Configuration]
) -> dict[str, np.ndarray]:
    rows = [named(connections, one.coordinates) for one in closed]
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def sampled_coordinates(
    driven: DrivenLinkage, samples: Sequence[Configuration]
) -> dict[str, np.ndarray]:
    """Values of the coordinates that move, by name (samples,): of drives, then of what follows."""
    by_name = {c.name: c for c in driven.part.connections}
    drives = [by_name[name] for name in driven.drives]
    return _sampled([*drives, *driven.following(samples)], samples)


def _groups(
    bodies: RecordedBodies, following: Sequence[Connection]
) -> Iterator[tuple[list[tuple[Connection, Loop]], list[Connection]]]:
    """Loops that share joints that follow, and these joints."""
    tree = bodies.tree
    left = [(cut, {c.name for c, _ in tree.around(cut)}) for cut in tree.cuts]
    names = {c.name for c in following}
    while left:
        cut, joints = left.pop(0)
        cuts, grown = [cut], True
        while grown:
            near = [own for own in left if own[1] & joints & names]
            left = [own for own in left if own not in near]
            cuts += [one for one, _ in near]
            joints = joints.union(*(own for _, own in near))
            grown = bool(near)
        moving = [c for c in following if c.name in joints]
        yield [(one, _gap(bodies, one)) for one in cuts], moving


def _gap(bodies: RecordedBodies, cut: Connection) -> Loop:
    meant, there = bodies.beyond(cut), bodies.frames[cut.b]
    return Loop(cut.name, meant.R, meant.p, there.R, there.p, (), ())


def _rates(
    bodies: RecordedBodies,
    gap: Loop,
    cut: Connection,
    moving: Sequence[Connection],
    length: float,
) -> dict[str, np.ndarray]:
    """Twists by which coordinates close a gap, in units of the length."""
    rates = {}
    own = {c.name for c in moving}
    for connection, sign in bodies.tree.around(cut):
        placed = bodies.placed(connection) if connection.name in own else None
        if placed is None:
            continue
        for name, freedom in zip(coordinate_names(connection), placed.freedoms, strict=True):
            twist = freedom_twist(freedom, gap.p) * int(sign)
            rates[name] = per_turn(twist, length) if freedom.turns else twist
    return rates
