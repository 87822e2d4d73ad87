"""A linkage that is driven by some of its joints, and its configurations at their values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import frozen, replace
from robostiff.kept import kept
from robostiff.kinematics.closure.body import tidy_numbers, tidy_point
from robostiff.kinematics.machine_pose import coordinates_of_drives
from robostiff.linkage.essential import essential, network_of
from robostiff.linkage.linkage import (
    PART_OF_A_TURN,
    Configuration,
    Connection,
    DriveValues,
    JointValues,
    Linkage,
    LoopsOfLinkage,
    moved_bodies,
)
from robostiff.model import Actuated
from robostiff.model.subject import Subject
from robostiff.network import Network
from robostiff.recorded.parameters import COUNT
from robostiff.spatial import Frame, Screw

_SEED = 20110
# Samples are this far from home at first, in radians and parts of the length.
_TURN, _SLIDE, _NEARER, _SHRINKS = 0.2, 0.1, 0.2, 5
# Of the largest rate at which coordinates close gaps: rates of motions that are free, and of loops
# that are regular; and of the length, what rounding leaves of a gap.
_FREE, _REGULAR, _ROUNDING = 1e-12, 1e-3, 1e-16


@frozen
class DrivenLinkage:
    """The part of a linkage between base and platform, and the joints that drive it."""

    part: Linkage  #: from `essential`
    drives: tuple[str, ...]  #: names of the joints whose coordinates are given
    #: closed, with the drives where they are at home; from `driven_by` it may be open
    home: Configuration
    # Without the answers that are kept.
    __getstate__: ClassVar[Callable[[Any], dict[str, Any]]] = Subject.__getstate__

    @classmethod
    def of(cls, linkage: Linkage, joints: Sequence[str] | None = None) -> DrivenLinkage:
        """Driven by the given joints, or by all actuated ones.

        Raises
        ------
        InputError
            When a name is no joint of the part between base and platform, there is none, or the
            loops do not close at home.
        """
        driven = driven_by(linkage, None)
        home, known = driven.home, [joint.name for joint in driven.part.joints]
        joints = driven.drives if joints is None else joints
        if isinstance(joints, str) or not joints:
            raise InputError(
                f"driven joints of {linkage.name!r}",
                got=joints or "no actuated joint",
                expected="names of joints",
                hint=f"write joints=({known[0]!r},)" if known else None,
            )
        for name in joints:
            if name not in known or list(joints).count(name) > 1:
                expected = f"each once of {', '.join(known)}"
                raise InputError(f"driven joint of {linkage.name!r}", got=name, expected=expected)
        if not home.is_closed:
            raise InputError(
                f"home of {linkage.name!r}",
                got=home.complaint,
                expected="a configuration in which its loops close",
                hint=home.advice,
            )
        return replace(driven, drives=tuple(joints))

    @property
    def driving(self) -> tuple[Connection, ...]:
        """The connections of the drives."""
        by_name = {c.name: c for c in self.part.connections}
        return tuple(by_name[name] for name in self.drives)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the coordinates of the drives."""
        return tuple(name for c in self.driving for name in c.coordinate_names)

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
        drives = {name: self.home.coordinates[name] for name in self.drives}
        others = [] if not isinstance(values, Mapping) else [x for x in values if x not in drives]
        hint = f"write rs.compile(linkage, joints=(..., {others[0]!r}))" if others else None
        subject = f"driven joints of {self.part.name!r}"
        return coordinates_of_drives(subject, values, drives, self.inputs, self.units, hint)

    def values(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """Coordinates of the drives (..., n) by joint."""
        sizes = [self.home.coordinates[name].size for name in self.drives]
        parts = np.split(rows, np.cumsum(sizes, dtype=int), axis=-1)[:-1]
        return dict(zip(self.drives, parts, strict=True))

    def at(self, rows: np.ndarray) -> list[Configuration]:
        """Configurations at coordinates of the drives (N, n), closed or as near as they came.

        Values are reached along the straight path from a home that closes, in its assembly mode.
        """
        values = self.values(rows)
        if self.drives and not self._start.is_closed:
            driven = ({name: x[i] for name, x in values.items()} for i in range(len(rows)))
            return [_nearest(self.part, frozenset(self.drives), q) for q in driven]
        found, open_ = [self.home] * len(rows), np.arange(len(rows) if self.drives else 0)
        for loops in self._loops if open_.size else ():
            reached = loops.path_to({name: x[open_] for name, x in values.items()})
            for i, one in zip(open_, reached, strict=True):
                found[i] = one
            open_ = open_[[not one.is_closed for one in reached]]
            if not open_.size:
                break
        return found

    @cached_property
    def _start(self) -> Configuration:
        """Home; a drive may contradict a joint that keeps its home coordinate, which then moves."""
        return self.home if self.home.is_closed else _nearest(self.part, frozenset(), {})

    @cached_property
    def _loops(self) -> list[LoopsOfLinkage]:
        """Loops that passive joints keep closed, then those that all joints do that may move."""
        moving = _movable(self.part, frozenset(self.drives))
        return [LoopsOfLinkage.of(self.part, self._start.coordinates, joints) for joints in moving]

    def after_rounding(self, found: Sequence[Configuration]) -> dict[int, Configuration]:
        """Closed configurations moved by rounding along the motion that their loops hold least.

        Loops near a singular configuration do not decide all coordinates to their last digits.
        Motions that they leave free, as the spin of a rod, are no such. By number, without those
        whose loops are regular.
        """
        if not found:
            return {}
        closing, row = self._loops[0], moved_bodies(self.part).row
        x = np.array([row(one.coordinates) for one in found])
        _, values, V_T = np.linalg.svd(closing.loops.rates(x))
        largest = values.max(axis=-1, initial=0.0)[:, None]
        last = np.count_nonzero(values > _FREE * largest, axis=-1) - 1
        rows = [k for k, j in enumerate(last) if j >= 0 and values[k, j] <= _REGULAR * values[k, 0]]
        if not rows:
            return {}
        steps = [V_T[k, last[k]] * _ROUNDING / values[k, last[k]] for k in rows]
        moved = closing.configurations(closing.loops.after_step(x[rows], np.array(steps)))
        return dict(zip(rows, moved, strict=True))

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
            found = [one for one in self.at(self.at_home + shifts) if one.is_closed]
            if len(found) >= COUNT:
                return found[:COUNT]
        raise InputError(
            f"driven joints of {self.part.name!r}",
            got=Words(f"{', '.join(self.drives)}: loops that do not close around home"),
            expected="joints that may be driven independently of one another",
            hint="give fewer, joints=(...), or another home",
        )

    def following(self, samples: Sequence[Configuration]) -> tuple[Connection, ...]:
        """Joints that follow: passive ones, or all that may where only these close the loops."""
        *_, movable = _movable(self.part, frozenset(self.drives))
        movable = tuple(c for c in movable if c.name in self.part.tree.in_loops)
        passive = tuple(c for c in movable if c.is_passive)
        others = [c.name for c in movable if not c.is_passive]
        still = self.home.coordinates
        if any(all(np.array_equal(s.coordinates[n], still[n]) for n in others) for s in samples):
            return passive
        return movable


@kept
def driven_by(linkage: Linkage, joints: tuple[str, ...] | None) -> DrivenLinkage:
    """Driven as in `network_at`: home may be open, and joints beside the part are left out.

    Raises InputError when a name is no joint of the linkage.
    """

    def tidy(frame: Frame) -> Frame:  # axes that are 0 or 1 up to rounding
        return Frame(tidy_numbers(frame.R).astype(float), tidy_point(frame.p).astype(float))

    part = essential(linkage)
    connections = [replace(c, before=tidy(c.before), after=tidy(c.after)) for c in part.connections]
    part = replace(part, connections=tuple(connections))
    if joints is None:
        joints = tuple(joint.name for joint in part.joints if isinstance(joint.role, Actuated))
    else:
        linkage.check_names(joints)
        known = {joint.name for joint in part.joints}
        joints = tuple(name for name in joints if name in known)
    return DrivenLinkage(part, joints, close(part))


def network_at(linkage: Linkage, values: DriveValues | None = None) -> Network:
    """A linkage as a network, with some joints at given coordinates.

    Parameters
    ----------
    linkage : Linkage
    values : mapping of str to float or sequence of float, or (n,) array, optional
        Coordinates of joints by name, or of all actuated ones [m, rad], which these joints keep.
        The others start at home and follow as the loops need. The home configuration when left
        out.

    Raises
    ------
    NoAnswerError
        When the loops do not close.
    InputError
        When a name is no joint's, or its numbers are not finite or too many or few.
    """
    return network_of(*closed_at(linkage, values))


def closed_at(linkage: Linkage, values: DriveValues | None = None) -> tuple[Linkage, Configuration]:
    """The part between base and platform, closed; as `network_at`.

    Every path begins at the same home, which is closed once.
    """
    if values is None or isinstance(values, Mapping):
        given = linkage.checked(values or {})
        driven = driven_by(linkage.in_floats, tuple(given))
        row = np.concatenate([np.zeros(0), *(given[name] for name in driven.drives)])
    else:
        driven = driven_by(linkage.in_floats, None)
        row = driven.rows(values)
        if row.size != len(driven.inputs):
            subject, expected = f"driven joints of {linkage.name!r}", "one configuration"
            raise InputError(subject, got=Words(f"shape {row.shape}"), expected=expected)
    (found,) = driven.at(row.reshape(1, -1))
    if not found.is_closed:
        raise NoAnswerError(
            f"the loops of {linkage.name!r} do not close: {found.complaint}; {found.advice}"
        )
    return driven.part, found


def close(linkage: Linkage, values: JointValues | None = None) -> Configuration:
    """Coordinates at which all loops close.

    Passive joints move first. Only where they cannot close the loops, other joints move too, as
    little as it takes. Joints among `values`, held joints and locked ones keep their coordinates.
    Values are reached along the straight path from home, in its assembly mode.

    Parameters
    ----------
    linkage : Linkage
    values : mapping of str to float or sequence of float, optional
        Coordinates of joints that keep them [m, rad].

    Returns
    -------
    Configuration
        Closed, or as near as it came.

    Raises
    ------
    InputError
        When a name in `values` is no joint's, or its numbers do not fit.
    """
    given, home = linkage.checked(values or {}), _nearest(linkage, linkage.held, {})
    if not given:
        return home
    row = np.concatenate([*given.values()])
    return DrivenLinkage(linkage, tuple(given), home).at(row[None])[0]


def _movable(linkage: Linkage, fixed: frozenset[str]) -> list[tuple[Connection, ...]]:
    """The passive joints that may move; then all that may, where these are more."""
    movable = tuple(c for c in linkage.connections if c.may_move and c.name not in fixed)
    passive = tuple(c for c in movable if c.is_passive)
    return [passive] if len(passive) == len(movable) else [passive, movable]


def _nearest(
    linkage: Linkage, fixed: frozenset[str], values: Mapping[str, np.ndarray]
) -> Configuration:
    """Closed at values of some joints, as near to the home coordinates of the others as it goes.

    Passive joints move, or all that may and are not fixed, where only these close the loops.
    """
    guess = {c.name: values.get(c.name, c.home) for c in linkage.connections}
    passive, *others = _movable(linkage, fixed)
    found = LoopsOfLinkage.of(linkage, guess, passive).nearest
    if found.is_closed or not others:
        return found
    return LoopsOfLinkage.of(linkage, guess, others[0]).nearest
