"""Geometry of a leg by which closed forms recognise it, and blocks whose branches are copies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.kinematics.frames import place_chain
from robostiff.model import (
    Branch,
    Chain,
    Joint,
    JointKind,
    Link,
    Locked,
    ParallelBlock,
    PlacedFreedom,
    Rigid,
    Telescope,
)
from robostiff.spatial import Screw

_ALONG = 1e-6  # sine between axes that count as one
_ON_AXIS = 1e-9  # sine: rounding
_ROUNDING = 1e-13  # of the length of a link


@dataclass(frozen=True)
class Cluster:
    """Axes through one point: one or two, or a spherical joint."""

    point: np.ndarray  # (3,): where they meet, in the leg's base frame, all coordinates zero
    axes: tuple[np.ndarray, ...]  # (3,) each
    places: tuple[int, ...]  # of their coordinates in the coordinate vector
    is_ball: bool
    drawn_at: int  # place of the joint that is drawn at the point


@dataclass(frozen=True)
class Slide:
    """A prismatic freedom, with its place in the coordinate vector."""

    axis: np.ndarray
    place: int


@dataclass(frozen=True)
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
            _append(parts, freedoms[place], place, joined_where_axes_meet)
    return Skeleton(tuple(parts), placed.R, placed.p, chain.home, rounding_of(chain))


def _append(
    parts: list[Cluster | Slide | Screw], freedom: PlacedFreedom, place: int, loosely: bool
) -> None:
    if freedom.slides:
        parts.append(freedom if freedom.turns else Slide(freedom.axis, place))
        return
    own = Cluster(freedom.point, (freedom.axis,), (place,), is_ball=False, drawn_at=place)
    last = parts[-1] if parts else None
    meeting = _meeting(last, own, loosely) if isinstance(last, Cluster) else None
    if not isinstance(last, Cluster) or meeting is None:
        parts.append(own)
        return
    axes, places = (*last.axes, freedom.axis), (*last.places, place)
    parts[-1] = Cluster(meeting.point, axes, places, is_ball=False, drawn_at=meeting.drawn_at)


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
            size = element.size if isinstance(element, Joint) else 1
            places += range(main, main + size)
            main += size
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
    one, two = (
        place_chain(path, q, branch.start.R, branch.start.p)
        for path, branch in ((a, first), (b, other))
    )
    shift, ends = other.start.p - first.start.p, other.end.p - first.end.p
    size = np.linalg.norm(shift) + np.abs(one.p - first.start.p).max() + 1e-300
    turned = max(np.abs(two.R - one.R).max(), np.abs(other.end.R - first.end.R).max())
    # The body after the block may be turned against the one before.
    longer = abs(np.linalg.norm(ends) - np.linalg.norm(shift))
    apart = max(longer, np.abs(two.p - one.p - shift).max())
    return bool(turned <= _SAME and apart <= _SAME * size)
