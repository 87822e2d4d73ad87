"""A linkage that is driven by some of its joints: configurations at their values, and its record.

Wrenches circulate in its loops. Bodies that more than two connections meet are joined by chains.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any, ClassVar

import numpy as np

from robostiff.elastostatics import scaling
from robostiff.errors import InputError
from robostiff.kept import kept
from robostiff.kinematics.closure.body import tidied, tidied_point
from robostiff.kinematics.spanning_tree import independent_parts
from robostiff.linkage.closure import (
    PART_OF_A_TURN,
    Configuration,
    PathsFromHome,
    close,
    moved_bodies,
)
from robostiff.linkage.connections import ConnectedBodies, Connection, DriveValues
from robostiff.linkage.essential import essential, network_of, placed_branches
from robostiff.model import Actuated, Joint, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry, Record, usual_size
from robostiff.recorded.circulation import BodyChain, circulating
from robostiff.recorded.closure import RecordedClosure, steps_from_home
from robostiff.recorded.factor import factors_of
from robostiff.recorded.guess import with_nominal
from robostiff.recorded.leg import LegRecorder, at_samples, stiffness_entries
from robostiff.recorded.newton_step import openings, step_of_groups
from robostiff.recorded.parameters import COUNT, parameter_samples, with_inputs
from robostiff.recorded.robot import RecordedRobot
from robostiff.recorded.working_frame import WorkingFrame
from robostiff.spatial import Frame, Screw, Space, as_floats

_SEED = 20110
# Samples are this far from home at first, in radians and parts of the length.
_TURN, _SLIDE, _NEARER, _SHRINKS = 0.2, 0.1, 0.2, 5


@dataclass(frozen=True)
class DrivenLinkage:
    """The part of a linkage between base and platform, and the joints that drive it.

    Attributes
    ----------
    part : Linkage
        From `essential`.
    drives : tuple of str
        Names of the joints whose coordinates are given.
    home : Configuration
        Closed, with the drives where they are at home; from `driven_by` it may be open.
    """

    kind: ClassVar[str] = ConnectedBodies.kind
    part: ConnectedBodies
    drives: tuple[str, ...]
    home: Configuration

    @classmethod
    def of(cls, linkage: ConnectedBodies, joints: Sequence[str] | None = None) -> DrivenLinkage:
        """Driven by the given joints, or by all actuated ones.

        Raises
        ------
        InputError
            When a name is no joint of the part between base and platform, there is none, or the
            loops do not close at home.
        """
        part = _tidied(essential(linkage))
        known = [joint.name for joint in part.joints]
        if joints is None:
            joints = _actuated(part)
        if isinstance(joints, str) or not joints:
            raise InputError(
                f"driven joints of {linkage.name!r}",
                got=joints or "no actuated joint",
                expected="names of joints",
                hint=f"write joints=({known[0]!r},)" if known else None,
            )
        for name in joints:
            if name not in known or list(joints).count(name) > 1:
                raise InputError(
                    f"driven joint of {linkage.name!r}",
                    got=name,
                    expected=f"each once of {', '.join(known)}",
                )
        home = close(part)
        if not home.is_closed:
            raise InputError(
                f"home of {linkage.name!r}",
                got=home.complaint,
                expected="a configuration in which its loops close",
                hint=home.advice,
            )
        return cls(part, tuple(joints), home)

    @cached_property
    def _paths(self) -> PathsFromHome:
        return PathsFromHome(self.part, self.home, self.drives)

    @property
    def driving(self) -> tuple[Connection, ...]:
        """The connections of the drives."""
        by_name = {c.name: c for c in self.part.connections}
        return tuple(by_name[name] for name in self.drives)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the coordinates of the drives."""
        return tuple(name for c in self.driving for name in coordinate_names(c))

    @property
    def units(self) -> tuple[str, ...]:
        """SI units of these coordinates."""
        return tuple(screw.unit for screw in self._freedoms)

    @property
    def _freedoms(self) -> list[Screw]:
        return [screw for c in self.driving for screw in c.freedoms]

    @property
    def at_home(self) -> np.ndarray:
        """Coordinates of the drives at home (n,) [m, rad]."""
        return self.given_in(self.home)

    def given_in(self, found: Configuration) -> np.ndarray:
        """Coordinates of the drives in a configuration (n,) [m, rad]."""
        return np.concatenate([np.zeros(0), *(found.coordinates[name] for name in self.drives)])

    def rows(self, values: DriveValues) -> np.ndarray:
        """Coordinates of the drives (..., n) in the order of `inputs` [m, rad].

        Given in that order, or by the names of the joints, (..., size) for a joint with several;
        those left out stay at home. What does not fit is an `InputError`.
        """
        subject, n = f"driven joints of {self.part.name!r}", len(self.inputs)
        if not isinstance(values, Mapping):
            words = f"an array (N, {n}): {' '.join(self.inputs)}, one pose a row"
            rows = as_floats(subject, values, words, self.units)
            if rows.ndim == 0 or rows.shape[-1] != n:
                raise InputError(subject, got=f"shape {rows.shape}", expected=words)
            return rows
        parts, units = self.values(self.at_home), self.values(np.array(self.units))
        for name, own in values.items():
            if name not in parts:
                raise InputError(
                    subject,
                    got=name,
                    expected=f"one of {', '.join(parts)}",
                    hint=f"write rs.compile(linkage, joints=(..., {name!r}))",
                )
            size = self.home.coordinates[name].size
            words = f"numbers (N,) of {name!r}" if size == 1 else f"numbers (N, {size}) of {name!r}"
            unit = units[name].tolist()[0 if size == 1 else slice(None)]
            numbers = as_floats(f"coordinates of {name!r}", own, words, unit)
            parts[name] = numbers[..., None] if size == 1 else numbers
            if parts[name].shape[-1:] != (size,):
                raise InputError(subject, got=f"shape {numbers.shape}", expected=words)
        try:
            batch = np.broadcast_shapes(*(own.shape[:-1] for own in parts.values()))
        except ValueError:
            shapes = ", ".join(f"{own.shape[:-1]} of {name!r}" for name, own in parts.items())
            raise InputError(subject, got=shapes, expected="as many poses for each joint") from None
        each = [np.broadcast_to(own, (*batch, own.shape[-1])) for own in parts.values()]
        return np.concatenate([np.zeros((*batch, 0)), *each], axis=-1)

    def values(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """Coordinates of the drives (..., n) by joint."""
        sizes = [self.home.coordinates[name].size for name in self.drives]
        parts = np.split(rows, np.cumsum(sizes, dtype=int), axis=-1)[:-1]
        return dict(zip(self.drives, parts, strict=True))

    def at(self, rows: np.ndarray) -> list[Configuration]:
        """Configurations at coordinates of the drives (N, n), closed or as near as they came."""
        if not len(rows):
            return []
        if not self.drives:
            return [self.home] * len(rows)
        if self.home.is_closed:
            return self._paths.to(self.values(rows))
        values = [self.values(row) for row in rows]
        return [close(self.part, {n: q.tolist() for n, q in own.items()}) for own in values]

    def turned_far(self, rows: np.ndarray) -> np.ndarray:
        """Where screws that follow may close on another turn than along the path from home (N,)."""
        if not any(c.is_screw for c in self.part.connections if c.name not in self.drives):
            return np.zeros(len(rows), dtype=bool)
        turning = np.array([screw.turns for screw in self._freedoms], dtype=bool)
        return np.any(np.abs(rows - self.at_home)[:, turning] > PART_OF_A_TURN, axis=-1)

    def samples(self, seed: int = 0, nearer: int = 0) -> list[Configuration]:
        """A few closed configurations near home, in general position; others for another seed.

        Each whole number of `nearer` takes a fifth of the way.

        Raises
        ------
        InputError
            When the loops close nowhere around home.
        """
        random = np.random.default_rng([_SEED, seed])
        reach = _SLIDE * self.home.length
        scale = np.array([_TURN if screw.turns else reach for screw in self._freedoms])
        for shrink in range(nearer, _SHRINKS):
            shifts = scale * _NEARER**shrink * random.uniform(-1, 1, (2 * COUNT, len(scale)))
            found = [there for there in self.at(self.at_home + shifts) if there.is_closed]
            if len(found) >= COUNT:
                return found[:COUNT]
        raise InputError(
            f"driven joints of {self.part.name!r}",
            got=f"{', '.join(self.drives)}: loops that do not close around home",
            expected="joints that may be driven independently of one another",
            hint="give fewer, joints=(...), or another home",
        )

    def following(self, samples: Sequence[Configuration]) -> tuple[Connection, ...]:
        """Joints that follow: passive ones, or all that may where only these close the loops."""
        own = [
            c
            for c in self.part.connections
            if c.may_move and c.name not in self.drives and c.name in self.part.tree.in_loops
        ]
        passive = [c for c in own if c.is_passive]
        others = [c.name for c in own if c not in passive]
        still = self.home.coordinates
        if any(all(np.array_equal(s.coordinates[n], still[n]) for n in others) for s in samples):
            return tuple(passive)
        return tuple(own)


@kept
def driven_by(linkage: ConnectedBodies, joints: tuple[str, ...] | None) -> DrivenLinkage:
    """Driven as in `network_at`: home may be open, and joints beside the part are left out.

    Raises InputError when a name is no joint of the linkage.
    """
    part = _tidied(essential(linkage.in_floats))
    if joints is None:
        return DrivenLinkage(part, _actuated(part), close(part))
    linkage.check_names(joints)
    known = {joint.name for joint in part.joints}
    return DrivenLinkage(part, tuple(name for name in joints if name in known), close(part))


def _actuated(part: ConnectedBodies) -> tuple[str, ...]:
    return tuple(joint.name for joint in part.joints if isinstance(joint.role, Actuated))


def coordinate_names(connection: Connection) -> tuple[str, ...]:
    """Names of the coordinates of a connection: the joint's, with a number where it has several."""
    return connection.chain.coordinate_names if isinstance(connection.element, Joint) else ()


def named(connections: Sequence[Connection], q: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Coordinates of connections by their own names."""
    return {
        name: float(x)
        for c in connections
        for name, x in zip(coordinate_names(c), q[c.name], strict=True)
    }


def _tidied(part: ConnectedBodies) -> ConnectedBodies:
    """The same linkage; axes of frames that are 0 or 1 up to rounding are so."""

    def tidy(frame: Frame) -> Frame:
        return Frame(tidied(frame.R).astype(float), tidied_point(frame.p).astype(float))

    own = [replace(c, before=tidy(c.before), after=tidy(c.after)) for c in part.connections]
    return replace(part, connections=tuple(own))


def record_linkage_closure(
    driven: DrivenLinkage, samples: Sequence[Configuration]
) -> tuple[RecordedClosure | None, tuple[str, ...]]:
    """Record the closure of a linkage from coordinates of its drives; as `record_linkage`.

    None where home is singular, or joints that resist are left undetermined. Passive joints that no
    loop determines, as of a rod that spins, stay where they are at home.
    """
    part, length = driven.part, driven.home.length
    following = driven.following(samples)
    closed = [*samples, driven.home]  # the last one is home: a pivot that vanishes there is none
    given = sampled(driven.driving, closed) | with_nominal(part)
    state = sampled(following, closed)
    record = Record({**given, **state})
    bodies = moved_bodies(part)
    q = coordinates(driven, record, (*driven.driving, *following))
    tree, moving = bodies.tree, {}
    for c in following:
        moving |= zip(
            bodies.places[c.name][0], ({name: 1} for name in coordinate_names(c)), strict=True
        )
    found = [*openings(tree, tree.placed(bodies.row(q)), moving, length)]
    unknowns = [name for own in moving.values() for name in own]
    parts = independent_parts(unknowns, [own.rates for own in found])
    groups = [([found[k] for k in loops], names) for names, loops in parts]
    joints = [
        (c.element, coordinate_names(c), q[c.name] * bodies.places[c.name][1], c.freedoms)
        for c in following
        if isinstance(c.element, Joint)
    ]
    step = step_of_groups(groups, {}, joints, length)
    # A spherical joint that is passed backwards turns the other way.
    signs = {name: bodies.places[c.name][1] for c in following for name in coordinate_names(c)}
    step = replace(step, steps={name: x * signs[name] for name, x in step.steps.items()})
    undetermined = tuple(step.undetermined)
    passive = {name for c in following if c.is_passive for name in coordinate_names(c)}
    if not passive.issuperset(undetermined):
        return None, undetermined
    inputs = {name: record.input(name) for name in (*given, *state)}
    start = named(following, driven.home.coordinates)
    return steps_from_home(record, tuple(given), start, step, inputs), undetermined


def coordinates(
    driven: DrivenLinkage, record: Record, moving: Sequence[Connection]
) -> dict[str, np.ndarray]:
    """Coordinates of all connections: inputs of a record, or as at home."""
    q: dict[str, np.ndarray] = dict(driven.home.coordinates)
    for c in moving:
        q[c.name] = np.array([record.input(name) for name in coordinate_names(c)], dtype=object)
    return q


def sampled(
    connections: Sequence[Connection], closed: Sequence[Configuration]
) -> dict[str, np.ndarray]:
    """Coordinates of connections in some configurations (samples,), by their own names."""
    rows = [named(connections, one.coordinates) for one in closed]
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


# A smallest stiffness below this part of the largest is watched the more closely, so that a loss of
# 1e4 stays above the ratio of 1e-10 at which `Tolerance` doubts.
_SOFT = 1e-6
_ROUNDING = 1e-11  # of a wrench: what elimination leaves of zero


def record_linkage(
    driven: DrivenLinkage, samples: Sequence[Configuration]
) -> tuple[RecordedRobot | None, tuple[str, ...]]:
    """Record the stiffness of a linkage; inputs are the coordinates of its drives, then symbols.

    All ways to hold the platform are those of one leg. None where the closure has no record; the
    second result are coordinates that no loop determines. A transmitted wrench that meets no
    compliance is an `InputError`.

    Examples
    --------
    >>> from robostiff.robots.descriptions import load_linkage
    >>> driven = DrivenLinkage.of(load_linkage("double-pantograph"))
    >>> recorded, undetermined = record_linkage(driven, driven.samples())
    >>> recorded.closure.inputs, recorded.factors.rank, undetermined
    (('screw',), 6, ())
    """
    closure, undetermined = record_linkage_closure(driven, samples)
    if closure is None:
        return None, undetermined
    movers = [*driven.driving, *driven.following(samples)]
    record = Record(sampled(movers, samples) | parameter_samples(driven.part))
    part = with_inputs(driven.part, record)
    moved = {c.name for c in movers}
    moving = [c for c in part.connections if c.name in moved]
    bodies, q = moved_bodies(part), coordinates(driven, record, moving)
    placed = bodies.tree.placed(bodies.row(q))
    R, p = placed.at(bodies.frames[part.platform])
    reference = p + R @ part.reference_point
    reference = np.array([record.simplified(x, driven.home.length) for x in reference])
    length = (
        network_of(driven.part.numeric, driven.home).characteristic_length or driven.home.length
    )
    recorder = LegRecorder(record, reference, Space.SPATIAL, length)

    def start_of(c: Connection) -> tuple[np.ndarray, np.ndarray]:
        return placed.at(bodies.frames[c.a].to(c.before.R, c.before.p))

    legs = []
    for a, b, path in placed_branches(part, q, start_of):
        every = [e for _, own in path for e in own.parts]
        legs.append((a, b, PlacedLeg(path[0][0].name, _simple(every, recorder), reference)))
    legs.sort(key=lambda leg: sum(f.is_passive for f in leg[2].freedoms))
    chains = [BodyChain(leg.name, a, b, leg) for a, b, leg in legs]
    world = WorkingFrame(np.eye(3, dtype=int).astype(object), reference)
    leg = circulating(part.name, chains, part.base, part.platform, recorder, world)
    K = stiffness_entries([leg], 6)
    recorded = RecordedRobot(
        name=part.name,
        record=record,
        space=Space.SPATIAL,
        length=length,
        legs=(leg,),
        K=K,
        reach=(),
        closure_losses=tuple(_near_softness(K, length, record.count)),
        limits=(),
        joints=closure.joints,
        closure=closure,
    )
    return recorded, undetermined


def _near_softness(K: dict[tuple[int, int], Any], length: float, count: int) -> list[Any]:
    """By how much K is nearer to a free motion than at the samples, where it is near there."""
    factors = factors_of(K, 6)
    places = list(combinations_with_replacement(range(6), 2))
    upper = at_samples([K[place] for place in places], count)
    unit = np.zeros((count, 6, 6))
    for number, (i, j) in enumerate(places):
        unit[:, i, j] = unit[:, j, i] = upper[:, number]
    scale = scaling(np.array(length), Space.SPATIAL)
    unit /= np.outer(scale, scale)
    size = np.sqrt(np.einsum("sii->si", unit))
    size = np.maximum(size, _ROUNDING * np.max(size, axis=1, keepdims=True))
    unit /= size[:, :, None] * size[:, None, :]
    # As the network decides: the smallest eigenvalue that is held, at a unit diagonal.
    ratio = float(np.min(np.linalg.eigvalsh(unit)[:, 6 - factors.rank])) if factors.rank else 1.0
    if not 0 < ratio < _SOFT:
        return []
    return [_SOFT / ratio * usual_size(d) / d for d in factors.d if isinstance(d, Entry)]


def _simple(
    elements: Sequence[PlacedFreedom | PlacedSpring], recorder: LegRecorder
) -> tuple[PlacedFreedom | PlacedSpring, ...]:
    """Elements in the world, their entries as simple as they are at the samples."""
    record, length = recorder.record, recorder.length

    def plain(x: np.ndarray, size: float = 1.0) -> np.ndarray:
        flat = [record.simplified(one, size) for one in x.ravel()]
        return np.array(flat, dtype=object).reshape(x.shape)

    return tuple(
        replace(e, axis=plain(e.axis), point=plain(e.point, length))
        if isinstance(e, PlacedFreedom)
        else replace(e, rotation=plain(e.rotation), point=plain(e.point, length))
        for e in elements
    )
