"""A robot at a pose: its coordinates, its parts in the world, and whether it reaches the pose."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from robostiff.frozen import frozen
from robostiff.kinematics.closure.leg_forms import beyond_limits
from robostiff.model import Leg, Passive, Robot, Snapshot, StiffnessLaw, Telescope

_REACHED = 1e-7


@frozen
class Posture:
    """A robot at a batch of poses, one a row."""

    robot: Robot
    batch: tuple[int, ...]  #: shape of the given batch
    pose: np.ndarray  #: (N, 6): platform pose: x, y, z, rotation vector [m, rad]
    coordinates: tuple[np.ndarray, ...]  #: tuple of (N, size) arrays: of each leg [m, rad]
    snapshot: Snapshot  #: the robot in the world, about its own reference point
    #: shift_gaps, turn_gaps (N, legs): by how much each leg misses the platform [m], [rad]
    shift_gaps: np.ndarray
    turn_gaps: np.ndarray
    #: (N,): where a drive may have any coordinate, so that the one given is arbitrary, or the
    #: nearest to home
    undetermined: np.ndarray
    #: (N,): where all legs close, but no path without singularity was found that leads there from
    #: home
    elsewhere: np.ndarray
    length: float  #: characteristic length of the closure [m]

    def __repr__(self) -> str:
        count, reached = len(self.pose), int(np.count_nonzero(self.reached))
        poses = f"{count} pose{'s' * (count != 1)}"
        return f"<Posture of {self.robot.name!r} at {poses}, {reached} within reach>"

    @cached_property
    def reached(self) -> np.ndarray:
        """Which poses all legs reach, in the assembly mode of home (N,)."""
        reached = np.all(self.closed, axis=-1) & ~self.elsewhere
        for _, _, values in self._positive:
            reached &= values > 0
        return reached

    def meets(self, tolerance: float) -> np.ndarray:
        """Where all legs meet the platform within a part of the robot's length (N,)."""
        met = (self.shift_gaps <= tolerance * self.length) & (self.turn_gaps <= tolerance)
        return np.all(met, axis=-1)

    @cached_property
    def within_limits(self) -> np.ndarray:
        """At which poses every actuator is within its limits (N,)."""
        each = zip(self.robot.legs, self.coordinates, strict=True)
        return ~np.any([beyond_limits(leg.chain, q) for leg, q in each], axis=0)

    @property
    def complaints(self) -> tuple[str, ...]:
        """Reasons why the first pose is not reached or not allowed, a sentence each."""
        sentences = []
        for i, leg in enumerate(self.robot.legs):
            if not self.closed[0, i]:
                shift, turn, parts = self.shift_gaps[0, i], self.turn_gaps[0, i], []
                if shift > _REACHED * self.length:
                    parts.append(f"{1e3 * shift:.4g} mm")
                if turn > _REACHED:
                    parts.append(f"{np.degrees(turn):.4g} deg")
                missed = " and ".join(parts)
                sentences.append(f"leg {leg.name!r} falls short of the pose by {missed}")
        for i, what, values in self._positive:
            if self.closed[0, i] and not values[0] > 0:
                name = self.robot.legs[i].name
                sentences.append(f"leg {name!r}: {what} would be {values[0]:.4g} at this pose")
        if not sentences and self.elsewhere[0]:
            sentences.append(
                "the legs close at this pose in another assembly mode only: the straight way from "
                "home passes a singularity; give poses nearer to home, another home, or joint "
                "coordinates close by: near=[...]"
            )
        if self.reached[0] and self.undetermined[0]:
            sentences.append(
                "drives can move at this pose while the platform stands still, as two axes of a "
                "wrist in one line, or a crank below the end of its rod: one of the postures is "
                "shown, of an arm the nearest to home; joint coordinates close by choose another: "
                "near=[...]"
            )
        if self.reached[0]:
            for leg, (q, *_) in zip(self.robot.legs, self.coordinates, strict=True):
                low, high = leg.chain.limits
                for i in np.flatnonzero((q < low) | (q > high)).tolist():
                    sentences.append(_beyond(leg, i, q[i], low[i], high[i]))
        return tuple(sentences)

    @cached_property
    def closed(self) -> np.ndarray:
        """Which legs meet the platform, with all loops in them closed (N, legs)."""
        return (self.shift_gaps <= _REACHED * self.length) & (self.turn_gaps <= _REACHED)

    @property
    def _positive(self) -> Iterator[tuple[int, str, np.ndarray]]:
        """What must be positive: number of the leg, what it is, and its values (N,)."""
        for i, (leg, q) in enumerate(zip(self.robot.legs, self.coordinates, strict=True)):
            for element, where in leg.chain.moving:
                if isinstance(element, Telescope):
                    for number, beam in enumerate(element.beams, start=1):
                        what = f"the length [m] of beam {number} of {element.name!r}"
                        yield i, what, beam.fixed + beam.share * q[:, where.start]
            names = leg.chain.coordinate_names
            for role, name, own in zip(leg.chain.roles, names, q.T, strict=True):
                law = None if isinstance(role, Passive) else role.stiffness
                if isinstance(law, StiffnessLaw):
                    yield i, f"the stiffness of {name!r}", law.at(own)


def _beyond(leg: Leg, place: int, value: float, low: float, high: float) -> str:
    """A sentence about an actuator beyond its limits."""
    element = next(e for e, where in leg.chain.moving if where.start <= place < where.stop)
    turns = leg.chain.freedoms[place].turns
    unit, factor = ("deg", np.degrees(1.0)) if turns else ("mm", 1e3)
    return (
        f"{element.name!r} of leg {leg.name!r} is at {factor * value:.5g} {unit}, outside its "
        f"limits {factor * low:.5g} to {factor * high:.5g} {unit}"
    )
