"""The lines of a leg: from joint to joint, straight or bent."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from math import dist

import numpy as np

from robostiff.kept import kept
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot
from robostiff.model.snapshot import PlacedBlock
from robostiff.network import SpringElement
from robostiff.plot.geometry.displacement import BodyMotion, LegMotion

_BENDS = 17  # points along a bent part
_APART = 1e-9  # of the leg's extent


class MemberKind(Enum):
    """Kind of a line of a leg."""

    RIGID = "rigid"
    ELASTIC = "elastic"
    SLIDE = "slide"


@dataclass(frozen=True)
class Member:
    """A line of a leg."""

    leg: str
    part: str  # joint or elastic part whose line it is; empty for a rigid one
    points: np.ndarray  # (n, 3): [m]
    kind: MemberKind


@dataclass(frozen=True)
class JointMark:
    """A joint of a leg with its point (3,) [m]."""

    leg: str
    point: np.ndarray
    freedom: PlacedFreedom


def leg_members(leg: PlacedLeg, motion: LegMotion, scale: float = 0.0) -> list[Member]:
    """The lines of a leg at a single pose, its bodies displaced by `scale` times their motion.

    From base to platform, without lines too short to be visible.
    """
    return list(_LegWalk(leg.name, scale, _apart(leg)).along(leg, motion, None))


def joint_marks(
    leg: PlacedLeg, motion: LegMotion, scale: float = 0.0, name: str = ""
) -> Iterator[JointMark]:
    """Points of the joints of a leg, displaced with the body before them; a branch has its name."""
    name = name or leg.name
    for i, element in enumerate(leg.elements):
        if isinstance(element, PlacedFreedom):
            moved = element.point + scale * motion.bodies[i].displacement(element.point)
            yield JointMark(name, moved, element)
        elif isinstance(element, PlacedBlock):
            for branch, own in zip(element.branches, motion.branches[i], strict=True):
                yield from joint_marks(branch, own, scale, name)


def foot(leg: PlacedLeg) -> np.ndarray:
    """Point of a leg on the base (3,) [m]: its first joint, or the start of its first beam."""
    first = leg.elements[0]
    if isinstance(first, PlacedBlock):
        return np.mean([foot(branch) for branch in first.branches], axis=0)
    return first.point if isinstance(first, PlacedFreedom) else clamped_end(first)


def clamped_end(spring: PlacedSpring | SpringElement) -> np.ndarray:
    """Start (3,) of an elastic part of which only the far end is given.

    Its centre of compliance, where a force alone does not turn it, lies half-way: exact for a
    uniform beam; a spring in a point begins where it ends.
    """
    C = spring.elasticity.compliance
    if not np.any(C[:3, 3:]):
        return spring.point
    coupling = C[:3, 3:] @ np.linalg.pinv(C[3:, 3:])
    to_centre = 0.5 * np.array(
        [
            coupling[2, 1] - coupling[1, 2],
            coupling[0, 2] - coupling[2, 0],
            coupling[1, 0] - coupling[0, 1],
        ]
    )
    return spring.point + 2 * spring.rotation @ to_centre


def points_of(snapshot: Snapshot) -> np.ndarray:
    """Points (n, 3) of a robot at a single pose: both ends of its legs, and its parts [m]."""
    points = [snapshot.reference_point]
    for leg in snapshot.legs:
        points += [leg.end, foot(leg), *(part.point for part in leg.parts)]
    return np.array(points)


@kept
def extent(snapshot: Snapshot) -> float:
    """Length of the diagonal of the box around a robot at a single pose [m]."""
    return float(np.linalg.norm(np.ptp(points_of(snapshot), axis=0)))


@dataclass(frozen=True)
class _Place:
    """A point (3,) and the motion of the body that it belongs to."""

    point: np.ndarray
    body: BodyMotion

    def moved(self, scale: float) -> np.ndarray:
        return self.point + scale * self.body.displacement(self.point) if scale else self.point


@dataclass(frozen=True)
class _LegWalk:
    name: str
    scale: float
    apart: float

    def along(self, leg: PlacedLeg, motion: LegMotion, start: _Place | None) -> Iterator[Member]:
        """Lines from a place, or from the first element, to the end of a leg."""
        here = [] if start is None else [start]
        first = leg.elements[0]
        if isinstance(first, PlacedSpring):
            clamped = _Place(clamped_end(first), motion.bodies[0])
            for place in here:
                yield from self._line(place, clamped, "", MemberKind.RIGID)
            here = [clamped]
        slid = ""
        for i, element in enumerate(leg.elements):
            before, after = motion.bodies[i], motion.bodies[i + 1]
            if isinstance(element, PlacedBlock):
                ends = []
                # a block begins where its branches begin
                for branch, own in zip(element.branches, motion.branches[i], strict=True):
                    yield from self.along(branch, own, here[0] if here else None)
                    ends.append(_Place(branch.end, after))
                here, slid = ends, ""
                continue
            if isinstance(element, PlacedSpring):
                for place in here:
                    there = _Place(element.point, after)
                    yield from self._line(place, there, element.name, MemberKind.ELASTIC)
                here, slid = [_Place(element.point, after)], ""
                continue
            kind = MemberKind.SLIDE if slid else MemberKind.RIGID
            for place in here:
                yield from self._line(place, _Place(element.point, before), slid, kind)
            # A rail belongs to the body before the slide, whatever the position of the slide.
            here = [_Place(element.point, before)]
            slid = element.name if element.slides else ""
        for place in here:
            kind = MemberKind.SLIDE if slid else MemberKind.RIGID
            yield from self._line(place, _Place(leg.end, motion.bodies[-1]), slid, kind)

    def _line(self, start: _Place, end: _Place, part: str, kind: MemberKind) -> Iterator[Member]:
        is_long = self._is_long(start.point, end.point)
        if kind is MemberKind.RIGID and not is_long:
            return
        if kind is MemberKind.ELASTIC and self.scale and is_long:
            points = bent_line(start.point, end.point, start.body, end.body, self.scale)
        else:
            points = np.array([start.moved(self.scale), end.moved(self.scale)])
        if self._is_long(points[0], points[-1]):
            yield Member(self.name, part, points, kind)

    def _is_long(self, start: np.ndarray, end: np.ndarray) -> bool:
        return dist(start, end) > self.apart


def bent_line(
    start: np.ndarray, end: np.ndarray, first: BodyMotion, last: BodyMotion, scale: float
) -> np.ndarray:
    """Line of a beam (n, 3) from start to end (3,) [m], which move with two bodies, exaggerated.

    Across the beam the cubic with the displacements and slopes of its ends, along it a straight
    line: exact for a uniform Euler-Bernoulli beam that is loaded at its ends.
    """
    along = end - start
    s = np.linspace(0.0, 1.0, _BENDS)[:, None]
    u_0, u_1 = first.displacement(start), last.displacement(end)
    slope_0, slope_1 = first.turned(along), last.turned(along)
    cubic = (1 - 3 * s**2 + 2 * s**3) * u_0 + (3 * s**2 - 2 * s**3) * u_1
    cubic = cubic + (s - 2 * s**2 + s**3) * slope_0 + (s**3 - s**2) * slope_1
    e = along / np.linalg.norm(along)
    straight = (1 - s) * (u_0 @ e) + s * (u_1 @ e)
    u = cubic - (cubic @ e)[:, None] * e + straight * e
    return start + s * along + scale * u


def _apart(leg: PlacedLeg) -> float:
    points = np.array([foot(leg), leg.end, *(part.point for part in leg.parts)])
    return _APART * float(np.linalg.norm(np.ptp(points, axis=0)) or 1.0)
