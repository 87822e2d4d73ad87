"""What a leg looks like with all coordinates zero: the geometry that closed forms recognise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.kinematics.frames import place_chain
from robostiff.model import Chain, Joint, JointKind, Locked, Motion, PlacedFreedom


@dataclass(frozen=True)
class Cluster:
    """Axes through one point: one or two, or a spherical joint.

    Attributes
    ----------
    point : (3,) array
        Where they meet, in the leg's base frame, all coordinates zero.
    axes : tuple of (3,) arrays
    places : tuple of int
        Of their coordinates in the coordinate vector.
    is_ball : bool
    """

    point: np.ndarray
    axes: tuple[np.ndarray, ...]
    places: tuple[int, ...]
    is_ball: bool


@dataclass(frozen=True)
class Slide:
    """A prismatic freedom, with its place in the coordinate vector."""

    axis: np.ndarray
    place: int


@dataclass(frozen=True)
class Skeleton:
    """A leg in its base frame at zero coordinates (locked joints at home).

    Attributes
    ----------
    parts : tuple of Cluster or Slide
        From base to platform.
    R_end, p_end : arrays
        End frame.
    home : (size,) array
        Home coordinates, which the locked joints keep.
    """

    parts: tuple[Cluster | Slide, ...]
    R_end: np.ndarray
    p_end: np.ndarray
    home: np.ndarray


def skeleton_of(chain: Chain) -> Skeleton:
    """Moving freedoms of a chain at zero coordinates, neighbours through one point joined."""
    zero = np.where(chain.free, 0.0, chain.home)
    placed = place_chain(chain, zero, np.eye(3), np.zeros(3))
    freedoms = placed.freedoms
    parts: list[Cluster | Slide] = []
    for element, where in chain.moving:
        if isinstance(element.role, Locked):
            continue
        if isinstance(element, Joint) and element.kind is JointKind.SPHERICAL:
            own = freedoms[where]
            axes = tuple(freedom.axis for freedom in own)
            places = tuple(range(where.start, where.stop))
            parts.append(Cluster(own[0].point, axes, places, is_ball=True))
            continue
        for place in range(where.start, where.stop):
            _append(parts, freedoms[place], place)
    return Skeleton(tuple(parts), placed.R, placed.p, chain.home)


def _append(parts: list[Cluster | Slide], freedom: PlacedFreedom, place: int) -> None:
    if freedom.motion is Motion.TRANSLATION:
        parts.append(Slide(freedom.axis, place))
        return
    last = parts[-1] if parts else None
    if (
        isinstance(last, Cluster)
        and not last.is_ball
        and len(last.axes) == 1
        and np.array_equal(last.point, freedom.point)
        and np.linalg.norm(np.cross(last.axes[0], freedom.axis)) > 1e-6
    ):
        joined = Cluster(last.point, (*last.axes, freedom.axis), (*last.places, place), False)
        parts[-1] = joined
        return
    parts.append(Cluster(freedom.point, (freedom.axis,), (place,), is_ball=False))
