"""A leg laid out: which body carries each element, and how far each slide is out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.kinematics.closure.body import LegBody, direction_across, tidied_point
from robostiff.kinematics.closure.closed_leg import ClosedLeg
from robostiff.kinematics.frames import Loop, PlacedChain, telescopic_elasticity
from robostiff.kinematics.turn import Turn
from robostiff.model import (
    Chain,
    Joint,
    Link,
    ParallelBlock,
    PlacedBlock,
    PlacedElement,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    Rigid,
    Telescope,
)
from robostiff.record import greater, is_zero, most_size


@dataclass(frozen=True)
class _Shift:
    """From the first branch of a block to a copy, at zero coordinates and now."""

    zero: np.ndarray
    now: np.ndarray

    def point(self, body: LegBody, x: np.ndarray) -> np.ndarray:
        """Where a point of a copy is, which a body like this one carries."""
        return body.point(x) if self is _UNSHIFTED else body.point(x - self.zero) + self.now


_UNSHIFTED = _Shift(np.zeros(3, dtype=object), np.zeros(3, dtype=object))


@dataclass(frozen=True)
class _Tour:
    """State while elements are laid out."""

    loops: Mapping[str, Loop]
    misses: list[np.ndarray] = field(default_factory=list)


@dataclass(frozen=True)
class Layout:
    """Elements of a leg in the world, carried by the bodies of the closed leg."""

    closed: ClosedLeg

    def elements(
        self, chain: Chain, zero: PlacedChain
    ) -> tuple[list[PlacedElement], list[np.ndarray]]:
        """The elements of a chain, taken along by the bodies that carry them.

        Branches of its blocks are copies, shifted from the first: they move as it does. By how much
        the body after a block then misses their ends comes second, as parts of the shift.
        """
        tour = _Tour({loop.name: loop for loop in zero.loops})
        return list(self._elements(chain, zero.elements, 0, _UNSHIFTED, tour)), tour.misses

    def _elements(
        self,
        chain: Chain,
        zero: Sequence[PlacedElement],
        joints: int,
        shift: _Shift,
        tour: _Tour,
    ) -> Iterator[PlacedElement]:
        """Elements of a chain or a branch that begins after so many joints of the main path."""
        left: Iterator[Any] = iter(zero)
        for element in chain.elements:
            if isinstance(element, ParallelBlock):
                yield self._block(element, next(left), joints, shift, tour)
                joints += element.branches[0].chain.main_places.size
            elif isinstance(element, Link):
                yield self._spring(next(left), self.closed.after(joints), shift)
            elif not isinstance(element, Rigid):
                size = element.size if isinstance(element, Joint) else 1
                for place in range(joints, joints + size):
                    yield self._freedom(next(left), place, shift)
                joints += size
                if isinstance(element, Telescope):
                    yield from self._beams(element, left, joints - 1, shift)

    def _block(
        self, block: ParallelBlock, zero: PlacedBlock, joints: int, shift: _Shift, tour: _Tour
    ) -> PlacedBlock:
        first, near = zero.branches[0], self.closed.after(joints)
        far = self.closed.after(joints + block.branches[0].chain.main_places.size)
        legs = []
        for branch, own in zip(block.branches, zero.branches, strict=True):
            shifted = shift
            if own is not first:
                apart = tidied_point(own.end - first.end)
                now = near.direction(apart)
                shifted = _Shift(shift.zero + apart, shift.now + now)
                wanted = tidied_point(tour.loops[own.name].p_wanted - first.end)
                size = np.linalg.norm([most_size(x) for x in wanted])
                tour.misses.append((far.direction(wanted) - now) * (1 / size))
            elements = tuple(self._elements(branch.chain, own.elements, joints, shifted, tour))
            legs.append(PlacedLeg(own.name, elements, shifted.point(far, own.end)))
        return PlacedBlock(zero.name, tuple(legs))

    def lengths(self, chain: Chain, copies: Sequence[int]) -> Iterator[Any]:
        """Lengths of the telescopes' beams that a pose can make negative [m].

        `copies` has for each coordinate of the chain its place on the main path.
        """
        for element, where in chain.moving:
            if isinstance(element, Telescope) and copies[where.start] in self.closed.slides:
                for beam in element.beams:
                    if not is_zero(beam.share):
                        yield self.closed.slides[copies[where.start]].of(beam)

    def coordinate(
        self,
        zero: PlacedChain,
        place: int,
        about: float = 0.0,
        limits: tuple[float, float] | None = None,
    ) -> Any:
        """Record a coordinate [m, rad]: the turn of a joint between the bodies on its two sides.

        `zero` is the main path at zero coordinates. An angle is recorded on the half turns before
        and after `about`, or on another turn where that is within the limits [rad]. A spherical
        joint has none.
        """
        if place in self.closed.slides:
            return self.closed.slides[place].coordinate
        freedom = zero.freedoms[place]
        if place in self.closed.ball_axes:
            raise InputError(
                f"coordinate of {freedom.name!r}",
                got="a spherical joint of a leg in closed form",
                expected="a joint about one axis",
                hint="give limits to the joints that are driven",
            )
        across = direction_across(freedom.axis)
        ahead = across if about == 0 else Turn.by(about).about(freedom.axis) @ across
        q = self.closed.angle(place, freedom.axis, ahead, across)
        q = q if about == 0 else q + about
        if limits is None or (limits[0] >= about - math.pi and limits[1] <= about + math.pi):
            return q
        low, high, turn = *limits, 2.0 * math.pi
        up = greater(low, q) * (1 - greater(q, high - turn))
        down = greater(q, high) * (1 - greater(low + turn, q))
        return q + (up - down) * turn

    def _freedom(self, freedom: PlacedFreedom, place: int, shift: _Shift) -> PlacedFreedom:
        body = self.closed.after(place)
        axis = self.closed.ball_axes.get(place)
        axis = body.direction(freedom.axis) if axis is None else axis
        return replace(freedom, axis=axis, point=shift.point(body, freedom.point))

    def _spring(self, spring: PlacedSpring, body: LegBody, shift: _Shift) -> PlacedSpring:
        return PlacedSpring(
            spring.name,
            shift.point(body, spring.point),
            body.axes(spring.rotation),
            spring.elasticity,
        )

    def _beams(
        self, telescope: Telescope, springs: Iterator[PlacedSpring], place: int, shift: _Shift
    ) -> Iterator[PlacedSpring]:
        near, far = self.closed.after(place), self.closed.after(place + 1)
        share: Any = 0
        for beam in telescope.beams:
            spring = next(springs)
            if place not in self.closed.slides:  # locked: its length is that at home
                yield self._spring(spring, near, shift)
                continue
            stretch = self.closed.slides[place]
            share = share + beam.share
            if share == 1:
                point = shift.point(far, spring.point)
            else:
                e = spring.rotation[:, 0]
                point = shift.point(near, spring.point + e * (share * stretch.offset))
                point = point + near.direction(e) * (share * stretch.length)
            elasticity = telescopic_elasticity(beam, np.asarray(stretch.of(beam), dtype=object))
            yield PlacedSpring(spring.name, point, near.axes(spring.rotation), elasticity)
