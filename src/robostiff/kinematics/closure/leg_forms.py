"""Legs in closed form: their geometry, their assembly modes, what they share, and a post.

Blocks whose branches are copies count as their first branch. An assembly mode is the signs of the
roots that a closed form takes.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from functools import cached_property
from itertools import product as combinations
from typing import Any, Self

import numpy as np

from robostiff.frozen import field, frozen, replace
from robostiff.kept import kept
from robostiff.kinematics.closure.body import (
    ClosedLeg,
    LegBody,
    Rest,
    body_after_turn,
    body_of_directions,
    constant_cosine,
    direction_across,
    dot,
    rest_of_directions,
    tidy_numbers,
)
from robostiff.kinematics.frames import beam_lengths, place_chain
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import (
    Branch,
    Chain,
    Joint,
    JointKind,
    Link,
    Locked,
    ParallelBlock,
    Rigid,
    Telescope,
)
from robostiff.record import Entry
from robostiff.spatial import Screw, cross
from robostiff.spatial.rotation import vector_of_rotation

_ALONG = 1e-6  # sine between axes that count as one
_ON_AXIS = 1e-9  # sine: rounding
_ROUNDING = 1e-13  # of the length of a link


@frozen
class Cluster:
    """Axes through one point: one or two, or a spherical joint."""

    point: np.ndarray  # (3,): where they meet, in the leg's base frame, all coordinates zero
    axes: tuple[np.ndarray, ...]  # (3,) each
    places: tuple[int, ...]  # of their coordinates in the coordinate vector
    is_ball: bool
    drawn_at: int  # place of the joint that is drawn at the point


@frozen
class Slide:
    """A prismatic freedom, with its place in the coordinate vector."""

    axis: np.ndarray
    place: int


@frozen
class Skeleton:
    """A leg in its base frame at zero coordinates (locked joints at home)."""

    # From base to platform; a freedom that turns and slides at once is a part by itself, which
    # has no closed form
    parts: tuple[Cluster | Slide | Screw, ...]
    # End frame
    R_end: np.ndarray
    p_end: np.ndarray
    home: np.ndarray  # (size,): home coordinates, which the locked joints keep
    rounding: float = 0.0  # lengths that are none [m]


def rounding_of(chain: Chain) -> float:
    """What rounding leaves of a point from which links lead away and back [m]."""
    links = [e for e in chain.elements if isinstance(e, Rigid | Link)]
    ways = (link.transform.p if isinstance(link, Rigid) else link.to for link in links)
    return _ROUNDING * max((float(np.linalg.norm(p)) for p in ways), default=0.0)


def skeleton_of(chain: Chain, *, joined_where_axes_meet: bool = False) -> Skeleton:
    """Moving freedoms of a chain at zero coordinates, neighbours through one point joined.

    The chain has no parallel blocks. `joined_where_axes_meet`: join neighbours also where only one
    of them is drawn at the point in which their axes meet.
    """
    placed = place_chain(chain, chain.zero, np.eye(3), np.zeros(3))
    freedoms = placed.freedoms
    parts: list[Cluster | Slide | Screw] = []
    for element, where in chain.moving:
        if isinstance(element.role, Locked):
            continue
        if isinstance(element, Joint) and element.kind is JointKind.SPHERICAL:
            own = freedoms[where]
            axes = tuple(freedom.axis for freedom in own)
            places = tuple(range(where.start, where.stop))
            parts.append(Cluster(own[0].point, axes, places, is_ball=True, drawn_at=where.start))
            continue
        for place in range(where.start, where.stop):
            own = freedoms[place]
            if own.slides:
                parts.append(own if own.turns else Slide(own.axis, place))
                continue
            turn = Cluster(own.point, (own.axis,), (place,), is_ball=False, drawn_at=place)
            last, meeting = parts[-1] if parts else None, None
            if isinstance(last, Cluster):
                meeting = _meeting(last, turn, joined_where_axes_meet)
            if isinstance(last, Cluster) and meeting is not None:
                axes, places = (*last.axes, own.axis), (*last.places, place)
                parts[-1] = Cluster(meeting.point, axes, places, False, meeting.drawn_at)
            else:
                parts.append(turn)
    return Skeleton(tuple(parts), placed.R, placed.p, chain.home, rounding_of(chain))


def _meeting(a: Cluster, b: Cluster, loosely: bool) -> Cluster | None:
    """That of two single axes which is drawn where they meet."""
    if a.is_ball or len(a.axes) != 1:
        return None
    (one,), (two, *_) = a.axes, b.axes
    if np.linalg.norm(np.cross(one, two)) <= _ALONG:
        return None
    if np.array_equal(a.point, b.point):
        return a
    if not loosely:
        return None
    apart = b.point - a.point
    size = _ON_AXIS * np.linalg.norm(apart)
    if np.linalg.norm(np.cross(one, apart)) <= size:
        return b
    return a if np.linalg.norm(np.cross(two, apart)) <= size else None


_SAME, _SEED = 1e-9, 2


def copied_places(chain: Chain) -> np.ndarray | None:
    """For each coordinate of a chain the one of its main path that it is equal to, (size,) int.

    That holds where all branches of every block are copies, shifted alike at both ends: while the
    bodies at both ends are not turned against each other, but about the line from copy to copy,
    equal coordinates close the loops. None where a branch is no such copy.
    """
    places: list[int] = []
    main = 0
    for element in chain.elements:
        if isinstance(element, Joint | Telescope):
            places += range(main, main + element.size)
            main += element.size
        elif isinstance(element, ParallelBlock):
            first = element.branches[0]
            for branch in element.branches:
                own = copied_places(branch.chain)
                if own is None or not (branch is first or _is_copy(first, branch)):
                    return None
                places += [main + int(place) for place in own]
            main += first.chain.main_places.size
    return np.array(places, dtype=int)


def _is_copy(first: Branch, other: Branch) -> bool:
    """Whether branches end alike at any equal coordinates, as far apart as they begin."""
    a, b = first.chain.main_path, other.chain.main_path
    if a.size != b.size or np.any(a.free != b.free):
        return False
    if np.any(np.abs(a.home - b.home)[~a.free] > _SAME):
        return False
    q = np.where(a.free, np.random.default_rng(_SEED).uniform(-1.0, 1.0, (2, a.size)), a.home)
    one = place_chain(a, q, first.start.R, first.start.p)
    two = place_chain(b, q, other.start.R, other.start.p)
    shift, ends = other.start.p - first.start.p, other.end.p - first.end.p
    size = np.linalg.norm(shift) + np.abs(one.p - first.start.p).max() + 1e-300
    turned = max(np.abs(two.R - one.R).max(), np.abs(other.end.R - first.end.R).max())
    # The body after the block may be turned against the one before.
    longer = abs(np.linalg.norm(ends) - np.linalg.norm(shift))
    apart = max(longer, np.abs(two.p - one.p - shift).max())
    return bool(turned <= _SAME and apart <= _SAME * size)


_DIGITS = 9  # to which two distances from home count as equal


@frozen
class RootSigns:
    """Signs, each 1 or -1, of the roots that a closed form takes; a smooth path keeps them."""

    root: Any = 1  # gives the length of a strut, or the coordinate of a slide or crank
    # of the triple product ``b.(a x d)`` at the joint on the near and the far end of the rod, for
    # the axis b that keeps its angles to two known directions a and d
    first: Any = 1
    second: Any = 1


def all_modes(signs: tuple[bool, bool, bool]) -> tuple[RootSigns, ...]:
    """The modes of a closed form that has some of the three signs."""
    each = ((1, -1) if two else (1,) for two in signs)
    return tuple(RootSigns(*own) for own in combinations(*each))


def nearest(
    chain: Chain,
    q: np.ndarray,
    closed: np.ndarray,
    near: np.ndarray,
    given: np.ndarray,
    leading: int,
    length: float,
) -> np.ndarray:
    """Which of some postures (m, N, size) is nearest to a wanted one: (N,) of int.

    Those that close the leg come first. Then those whose drive is within its limits, where its home
    was left out; then the nearest in the coordinates that are given; then in that of the drive;
    then in all. Distances are 1 - cos of an angle, and advances as parts of the length.

    Parameters
    ----------
    chain : Chain
        Its main path alone counts.
    q : (m, N, size) array
        Coordinates of each posture.
    closed : (m, N) array of bool
        Where it closes the leg.
    near : (size,) array
        Wanted coordinates [m, rad].
    given : (size,) array of bool
        Which of those of the main path were chosen, and not left out.
    leading : int
        Place of the drive's coordinate on the main path.
    length : float
        Against which slides are measured [m].
    """
    chain, q, near = chain.main_path, q[..., chain.main_places], near[chain.main_places]
    difference = q - near
    apart = np.empty(difference.shape)
    for place, screw in enumerate(chain.freedoms):
        x = difference[..., place]
        shift = np.abs(screw.advance(x)) / length
        apart[..., place] = shift if screw.slides else 1.0 - np.cos(x)
    for place in _balls(chain):
        chord = turn_by_vector(q[..., place]) - turn_by_vector(near[place])
        apart[..., place] = np.einsum("...ij,...ij->...", chord, chord)[..., None] / 12.0
    low, high = chain.limits[:, leading]
    outside = ((q[..., leading] < low) | (q[..., leading] > high)) & (not given[leading])
    keys = (np.sum(apart, axis=-1), apart[..., leading], np.sum(apart[..., given], axis=-1))
    rounded = [np.round(key, _DIGITS) for key in keys]
    # The last key is the first to decide; equal ones keep their order.
    return np.lexsort((*rounded, outside, where_too_short(chain, q), ~closed), axis=0)[0]


def where_too_short(chain: Chain, q: np.ndarray) -> np.ndarray:
    """Where a beam of a telescope would have no positive length (...)."""
    short = np.zeros(q.shape[:-1], dtype=bool)
    for length in beam_lengths(chain, q):
        short |= length <= 0
    return short


def beyond_limits(chain: Chain, q: np.ndarray) -> np.ndarray:
    """Where an actuator is beyond its limits (...)."""
    low, high = chain.limits
    return np.any((q < low) | (q > high), axis=-1)


def on_turn_of_home(chain: Chain, q: np.ndarray, near: np.ndarray) -> np.ndarray:
    """The same angles, each on the turn within its limits, or else nearest to given coordinates.

    A joint that slides while it turns is elsewhere after a full turn, and so is what follows a
    joint by a gear: they keep their coordinates. q (N, size) is changed in place.
    """
    places, low, high, balls = _turning(chain)
    if places.size:
        own, one = q[..., places], 2.0 * np.pi
        turns = np.round((np.minimum(np.maximum(near[places], low), high) - own) / one)
        found = own + one * turns
        turns += (found < low) & (found + one <= high)
        turns -= (found > high) & (found - one >= low)
        q[..., places] += one * turns
    for place in balls:  # rotation vectors of the same rotations
        r, own = q[..., place], near[place]
        size, far = np.linalg.norm(r, axis=-1, keepdims=True), np.linalg.norm(own)
        still = own / far if far > 0 else np.zeros(3)
        direction = np.where(size > 0, r / np.where(size > 0, size, 1.0), still)
        turns = np.round(np.sum((own - r) * direction, axis=-1, keepdims=True) / (2.0 * np.pi))
        r += 2.0 * np.pi * turns * direction
    return q


@kept
def _turning(chain: Chain) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[slice]]:
    """Places of coordinates that count full turns, their limits, and spherical joints."""
    balls = list(_balls(chain))
    of_balls = {i for place in balls for i in range(place.start, place.stop)}
    free = np.flatnonzero(chain.free).tolist()
    places = [i for i in free if chain.freedoms[i].is_rotation and i not in of_balls]
    return np.array(places, dtype=int), *chain.limits[:, places], balls


def _balls(chain: Chain) -> Iterator[slice]:
    """Places of the spherical joints that move."""
    for element, place in chain.moving:
        is_ball = isinstance(element, Joint) and element.kind is JointKind.SPHERICAL
        if is_ball and not isinstance(element.role, Locked):
            yield place


@frozen
class LegForm(ABC):
    """A leg of a kind that closes without iteration: one formula for records and for poses."""

    skeleton: Skeleton
    leading: int  # place of the coordinate that the first sign of a mode decides
    signs: tuple[bool, bool, bool]  # which signs of a mode there are
    turning: tuple[Cluster, ...]  # joints whose coordinates are angles, from base to platform
    mode: RootSigns = field(default_factory=RootSigns, kw_only=True)
    # Of the leg, where steps of a record are to be named
    name: str | None = field(default=None, kw_only=True)

    @abstractmethod
    def leg_between(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform."""

    def in_mode(self, mode: RootSigns) -> Self:
        """The same leg in another assembly mode."""
        return replace(self, mode=mode)

    def solve(self, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Coordinates (N, size) that bring the end frame to (R, p) in the leg's base frame.

        Where it is out of reach, those that bring it near.
        """
        closed = self.leg_between(self._at_rest[0], self.platform_at(R, p))
        q = np.empty((self.skeleton.home.size, len(p)))
        q[...] = self.skeleton.home[:, None]
        for place, stretch in closed.slides.items():
            q[place] = stretch.coordinate
        last = self.turning[-1].places[-1]  # which takes what is left
        for place, axis, across in self._turns:
            if place != last:
                q[place] = closed.angle(place, axis, across, across)
                continue
            # What leaves least where the bodies do not agree on the axis: the angle of sin =
            # e.vee(R) / 2, cos = (tr R - 1) / 2.
            triad = across, cross(axis, across), axis
            ends = closed.after(place), closed.after(place + 1)
            (x, y, z), (u, v, w) = ([body.direction(e) for e in triad] for body in ends)
            cosine = dot(x, u) + dot(y, v) + dot(z, w) - 1.0
            q[place] = np.arctan2(dot(y, u) - dot(x, v), cosine)
        for cluster in self.turning:
            if cluster.is_ball:
                near, far = closed.after(cluster.places[0]), closed.after(cluster.places[-1] + 1)
                own = np.stack(cluster.axes, axis=-1)  # at zero coordinates
                to_near, to_far = (body.rest.R.T @ own for body in (near, far))
                turn = np.einsum("jin,jkn->ikn", near.R, far.R)
                turn = np.einsum("ijn,jk->ikn", turn, to_far)
                turn = np.einsum("ji,jkn->ikn", to_near, turn).transpose(2, 0, 1)
                q[cluster.places[0] : cluster.places[-1] + 1] = vector_of_rotation(turn).T
        return q.T

    def platform_at(self, R: np.ndarray, p: np.ndarray) -> LegBody:
        """The end frame at poses (N, 3, 3) and (N, 3)."""
        return LegBody(self._at_rest[1], R.transpose(1, 2, 0), p.T)

    def named(self, value: Any, name: str) -> Any:
        """The same entry, or vector of entries, with a name; components get _x, _y and _z."""
        if self.name is None:
            return value
        parts = zip(value, ("_x", "_y", "_z"), strict=True) if isinstance(value, np.ndarray) else ()
        for part, axis in parts or ((value, ""),):
            if isinstance(part, Entry):
                part.named(f"{name}_{self.name}{axis}")
        return value

    @cached_property
    def _at_rest(self) -> tuple[LegBody, Rest]:
        """The base, which stays where it is, and the end frame."""
        base = LegBody(Rest(np.eye(3), np.zeros(3)), np.eye(3)[..., None], np.zeros((3, 1)))
        return base, Rest(self.skeleton.R_end, self.skeleton.p_end)

    @cached_property
    def _turns(self) -> tuple[tuple[int, np.ndarray, np.ndarray], ...]:
        """Place and axis of each turn, and a direction across it."""
        return tuple(
            (place, axis, direction_across(axis).astype(float))
            for cluster in self.turning
            if not cluster.is_ball
            for place, axis in zip(cluster.places, cluster.axes, strict=True)
        )


@frozen
class Post(LegForm):
    """A leg whose only joint turns about one point, and takes the turn that the pose has.

    It closes where the point is in the same place on the base and on the platform, and where axes
    of the joint take the turn, in one way.
    """

    joint: Cluster
    length: float = 1.0  # against which the distance of the two places counts [m]

    def leg_between(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform."""
        joint, at = self.joint, base.point(self.joint.point)
        near = [base.direction(axis) for axis in joint.axes]
        far = platform.direction(joint.axes[-1])
        bodies, ball_axes = {0: base, joint.places[-1] + 1: platform}, {}
        missed = [(platform.point(joint.point) - at) * (1 / self.length)]
        if joint.is_ball:
            ball_axes = dict(zip(joint.places, near, strict=True))
        elif len(joint.axes) == 1:
            missed.append(far - near[0])
        else:
            missed.append(np.array([dot(near[0], far) - constant_cosine(*joint.axes)]))
            a, b = joint.axes
            if base.is_at_poses:
                rest, _ = rest_of_directions(joint.point, a, b)
                between = body_after_turn(base, rest, at, a, b, far)
            else:
                between = body_of_directions((joint.point, a, b), (at, near[0], far))
            bodies[joint.places[1]] = between
        closing = [] if base.is_at_poses else [v @ v for v in map(tidy_numbers, missed)]
        return ClosedLeg(bodies, ball_axes, closing, [])
