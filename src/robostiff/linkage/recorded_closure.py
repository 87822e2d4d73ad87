"""The closure of a linkage as a record: Newton steps from home."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from robostiff.kinematics.frames import Loop
from robostiff.kinematics.jacobians import freedom_twist
from robostiff.linkage.bodies import Bodies
from robostiff.linkage.closure import Configuration
from robostiff.linkage.driven import DrivenLinkage, coordinate_names, named
from robostiff.linkage.linkage import Connection
from robostiff.model import Joint
from robostiff.record import Record
from robostiff.recorded.closure import RecordedClosure, steps_from_home, with_nominal
from robostiff.recorded.newton_step import (
    ClosureGroup,
    Opening,
    joint_steps,
    per_turn,
    step_of_groups,
)


def record_linkage_closure(
    driven: DrivenLinkage, samples: Sequence[Configuration]
) -> tuple[RecordedClosure | None, tuple[str, ...]]:
    """Record the closure of a linkage from coordinates of its drives.

    Parameters
    ----------
    driven : DrivenLinkage
    samples : sequence of Configuration
        Closed, in general position.

    Returns
    -------
    closure : RecordedClosure or None
        None where home is singular, or joints that resist are left undetermined.
    undetermined : tuple of str
        Coordinates of passive joints that no loop determines, as of a rod that spins: they stay
        where they are at home.
    """
    part, tree, length = driven.part, driven.tree, driven.home.length
    following = driven.following(samples)
    by_name = {c.name: c for c in part.connections}
    drives = [by_name[name] for name in driven.drives]
    closed = [*samples, driven.home]  # the last one is home: a pivot that vanishes there is none
    given = _sampled(drives, closed) | with_nominal(part)
    state = _sampled(following, closed)
    record = Record({**given, **state})
    bodies = Bodies.of(tree, coordinates(driven, record, (*drives, *following)))
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
    undetermined = tuple(step.undetermined)
    passive = {name for c in driven.passive(following) for name in coordinate_names(c)}
    if not passive.issuperset(undetermined):
        return None, undetermined
    q = {name: record.input(name) for name in (*given, *state)}
    start = named(following, driven.home.coordinates)
    return steps_from_home(record, tuple(given), start, step, q), undetermined


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
    bodies: Bodies, following: Sequence[Connection]
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
        yield [(one, bodies.gap(one)) for one in cuts], moving


def _rates(
    bodies: Bodies,
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
