"""A leg laid out: which body carries each element, and how far each slide is out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.kinematics.formula.body import Body, direction_across
from robostiff.kinematics.frames import PlacedChain, telescopic_elasticity
from robostiff.model import (
    Chain,
    Joint,
    Link,
    PlacedFreedom,
    PlacedSpring,
    Rigid,
    Telescope,
    TelescopicBeam,
)
from robostiff.record import arc_tangent, is_zero
from robostiff.spatial import cross


@dataclass(frozen=True)
class Stretch:
    """Coordinate of a slide [m], told by a recorded length: ``length + offset``."""

    length: Any
    offset: Any

    @property
    def coordinate(self) -> Any:
        """The coordinate itself."""
        return self.length + self.offset

    def of(self, beam: TelescopicBeam) -> Any:
        """Length of a beam of the telescope that slides."""
        return self.length * beam.share + (beam.fixed + beam.share * self.offset)


@dataclass(frozen=True)
class Layout:
    """Bodies of a leg in the world.

    Attributes
    ----------
    bodies : dict of int to Body
        A body begins after that many elementary joints.
    slides : dict of int to Stretch
        By place in the coordinate vector.
    ball_axes : dict of int to (3,) array
        Axes of spherical joints, which may have any three.
    """

    bodies: dict[int, Body]
    slides: dict[int, Stretch]
    ball_axes: dict[int, np.ndarray]

    def after(self, joints: int) -> Body:
        """The body that follows so many elementary joints."""
        return self.bodies[max(start for start in self.bodies if start <= joints)]

    def elements(self, chain: Chain, zero: PlacedChain) -> Iterator[PlacedFreedom | PlacedSpring]:
        """The elements of a chain, taken along by the bodies that carry them."""
        freedoms = zero.freedoms
        springs = (e for e in zero.elements if isinstance(e, PlacedSpring))
        joints = 0
        for element in chain.elements:
            if isinstance(element, Link):
                yield self._spring(next(springs), self.after(joints))
            elif not isinstance(element, Rigid):
                size = element.size if isinstance(element, Joint) else 1
                for place in range(joints, joints + size):
                    yield self._freedom(freedoms[place], place)
                joints += size
                if isinstance(element, Telescope):
                    yield from self._beams(element, springs, joints - 1)

    def lengths(self, chain: Chain) -> Iterator[Any]:
        """Lengths of the telescopes' beams that a pose can make negative [m]."""
        for element, where in chain.moving:
            if isinstance(element, Telescope) and where.start in self.slides:
                for beam in element.beams:
                    if not is_zero(beam.share):
                        yield self.slides[where.start].of(beam)

    def coordinate(self, zero: PlacedChain, place: int) -> Any:
        """Record a coordinate [m, rad]: the turn of a joint between the bodies on its two sides.

        Raises
        ------
        InputError
            For a spherical joint.
        """
        if place in self.slides:
            return self.slides[place].coordinate
        freedom = zero.freedoms[place]
        if place in self.ball_axes:
            raise InputError(
                f"coordinate of {freedom.name!r}",
                got="a spherical joint of a leg in closed form",
                expected="a joint about one axis",
                hint="give limits to the joints that are driven",
            )
        near, far = self.after(place), self.after(place + 1)
        across = direction_across(freedom.axis)
        before, after = near.direction(across), far.direction(across)
        sine = near.direction(freedom.axis) @ cross(before, after)
        return arc_tangent(sine, before @ after)

    def _freedom(self, freedom: PlacedFreedom, place: int) -> PlacedFreedom:
        body = self.after(place)
        axis = self.ball_axes.get(place)
        axis = body.direction(freedom.axis) if axis is None else axis
        return PlacedFreedom(
            freedom.name, freedom.motion, body.point(freedom.point), axis, freedom.role
        )

    def _spring(self, spring: PlacedSpring, body: Body) -> PlacedSpring:
        return PlacedSpring(
            spring.name, body.point(spring.point), body.axes(spring.rotation), spring.elasticity
        )

    def _beams(
        self, telescope: Telescope, springs: Iterator[PlacedSpring], place: int
    ) -> Iterator[PlacedSpring]:
        near, far = self.after(place), self.after(place + 1)
        share: Any = 0
        for beam in telescope.beams:
            spring = next(springs)
            if place not in self.slides:  # locked: its length is that at home
                yield self._spring(spring, near)
                continue
            stretch = self.slides[place]
            share = share + beam.share
            if share == 1:
                point = far.point(spring.point)
            else:
                e = spring.rotation[:, 0]
                point = near.point(spring.point + e * (share * stretch.offset))
                point = point + near.direction(e) * (share * stretch.length)
            elasticity = telescopic_elasticity(beam, np.asarray(stretch.of(beam), dtype=object))
            yield PlacedSpring(spring.name, point, near.axes(spring.rotation), elasticity)
