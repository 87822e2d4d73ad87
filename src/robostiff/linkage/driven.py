"""A linkage that is driven by some of its joints: configurations at values of their coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.errors import InputError
from robostiff.kinematics.closure.body import tidied, tidied_point
from robostiff.linkage.closure import Configuration, close, close_all
from robostiff.linkage.essential import essential
from robostiff.linkage.linkage import Connection, Linkage
from robostiff.linkage.spanning_tree import SpanningTree, spanning_tree
from robostiff.model import Actuated, Chain, Joint, Locked, Passive
from robostiff.recorded.parameters import COUNT
from robostiff.spatial import Frame

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
        Closed, with the drives where they are at home.
    """

    part: Linkage
    drives: tuple[str, ...]
    home: Configuration

    @classmethod
    def of(cls, linkage: Linkage, joints: Sequence[str] | None = None) -> DrivenLinkage:
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
            joints = [joint.name for joint in part.joints if isinstance(joint.role, Actuated)]
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
    def tree(self) -> SpanningTree:
        """Ways to its bodies, and the connections that close loops."""
        return spanning_tree(self.part)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the coordinates of the drives."""
        by_name = {c.name: c for c in self.part.connections}
        return tuple(name for drive in self.drives for name in coordinate_names(by_name[drive]))

    @property
    def at_home(self) -> np.ndarray:
        """Coordinates of the drives at home (n,) [m, rad]."""
        return self.given_in(self.home)

    def given_in(self, found: Configuration) -> np.ndarray:
        """Coordinates of the drives in a configuration (n,) [m, rad]."""
        return np.concatenate([found.coordinates[name] for name in self.drives])

    def values(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """Coordinates of the drives (..., n) by joint."""
        sizes = [self.home.coordinates[name].size for name in self.drives]
        parts = np.split(rows, np.cumsum(sizes)[:-1], axis=-1)
        return dict(zip(self.drives, parts, strict=True))

    def at(self, rows: np.ndarray) -> list[Configuration]:
        """Configurations at coordinates of the drives (N, n), closed or as near as they came."""
        return close_all(self.part, self.home, self.values(rows)) if len(rows) else []

    def samples(self, seed: int = 0, nearer: int = 0) -> list[Configuration]:
        """A few closed configurations near home, in general position; others for another seed.

        Each whole number of `nearer` takes a fifth of the way.

        Raises
        ------
        InputError
            When the loops close nowhere around home.
        """
        random = np.random.default_rng([_SEED, seed])
        freedoms = [
            screw
            for drive in self.drives
            for c in self.part.connections
            if c.name == drive and isinstance(c.element, Joint)
            for screw in c.element.freedoms
        ]
        scale = np.array([_TURN if f.turns else _SLIDE * self.home.length for f in freedoms])
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
        """The joints that follow: passive ones, or all that may where only these close the loops.

        Parameters
        ----------
        samples : sequence of Configuration
        """
        own = [
            c
            for c in self.part.connections
            if isinstance(c.element, Joint)
            and c.name not in self.drives
            and c.name in self.tree.in_loops
            and not isinstance(c.element.role, Locked)
        ]
        passive = self.passive(own)
        others = [c.name for c in own if c not in passive]
        still = self.home.coordinates
        if any(all(np.array_equal(s.coordinates[n], still[n]) for n in others) for s in samples):
            return tuple(passive)
        return tuple(own)

    @staticmethod
    def passive(connections: Sequence[Connection]) -> list[Connection]:
        """Those that are passive joints."""
        own = [(c, c.element) for c in connections]
        return [c for c, e in own if isinstance(e, Joint) and isinstance(e.role, Passive)]


def coordinate_names(connection: Connection) -> tuple[str, ...]:
    """Names of the coordinates of a connection: the joint's, with a number where it has several."""
    element = connection.element
    return Chain((element,)).coordinate_names if isinstance(element, Joint) else ()


def named(connections: Sequence[Connection], q: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Coordinates of connections by their own names."""
    return {
        name: float(x)
        for c in connections
        for name, x in zip(coordinate_names(c), q[c.name], strict=True)
    }


def _tidied(part: Linkage) -> Linkage:
    """The same linkage; axes of frames that are 0 or 1 up to rounding are so."""

    def tidy(frame: Frame) -> Frame:
        return Frame(tidied(frame.R).astype(float), tidied_point(frame.p).astype(float))

    own = [replace(c, before=tidy(c.before), after=tidy(c.after)) for c in part.connections]
    return replace(part, connections=tuple(own))
