"""Springs between points of two bodies on recorded entries; see `statics.chains.body_springs`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robostiff.model import (
    Leg,
    PlacedBlock,
    PlacedBodySpring,
    PlacedElement,
    PlacedLeg,
    PlacedSpring,
)
from robostiff.model.body_spring import BASE, PLATFORM, BodySpring
from robostiff.record import is_zero, reciprocal, square_root, usual_size
from robostiff.recorded.robot import RobotOnEntries
from robostiff.spatial import cross, is_formula
from robostiff.statics.chains.chain import BodyLoad
from robostiff.statics.kernels.elimination import SymmetricElimination
from robostiff.statics.kernels.marks import marked
from robostiff.statics.kernels.motion import Body, MovingChain, identity
from robostiff.statics.loading.from_snapshot import LegWalk

# Names a rigid part without extent, which shows where the frame of a body is that holds a spring.
_ANCHOR = "\0anchor"
_NOWHERE, _STILL = np.zeros(3), np.zeros(3, dtype=int).astype(object)
# Of their constant force: what is rounding.
_NONE = 1e-12

Frames = Mapping[str, tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class RecordedAnchor:
    """A point (3,) of a body that holds an end of a spring, at the unloaded posture [m].

    The body is behind some elements of a chain of a leg; without these the base, or the platform.
    """

    point: np.ndarray
    leg: int | None = None
    chain: int | None = None
    after: int = 0
    on_platform: bool = False


@dataclass(frozen=True)
class RecordedBodySpring:
    """A spring that pulls with ``t = k l + c`` at its length l."""

    ends: tuple[RecordedAnchor, RecordedAnchor]
    stiffness: float  # k [N/m]
    constant: Any  # entry or number: c [N]

    @property
    def legs(self) -> set[int]:
        """Whose bodies it is held on; none of base and platform alone."""
        return {end.leg for end in self.ends if end.leg is not None}

    @property
    def at_rest(self) -> RecordedBodySpring:
        """The same without tension at the unloaded posture."""
        d = self.ends[1].point - self.ends[0].point
        return replace(self, constant=square_root(d @ d) * -self.stiffness)

    def pulling(self, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[Any]]:
        """Force on its first point, the rate of that by ``b - a``, and what must be positive."""
        d = b - a
        if is_zero(self.constant):
            return d * self.stiffness, identity() * self.stiffness, []
        square = d @ d
        by = reciprocal(square_root(square))
        across, u = self.constant * by, d * by
        D = identity() * (self.stiffness + across) - u[:, None] * (u * across)[None, :]
        return d * (self.stiffness + across), D, [square * (1 / usual_size(square))]


@dataclass(frozen=True)
class SpringEnds:
    """What springs are held on: the base, the platform, and the chains of one leg."""

    platform: Body
    twist: Sequence[str]  # unknowns of its motion
    rows: Sequence[int]  # which of six coordinates these are
    chains: Sequence[MovingChain] = ()
    names: Sequence[Sequence[str]] = ()  # unknowns that move each of them

    def add(
        self, springs: Sequence[RecordedBodySpring], elimination: SymmetricElimination
    ) -> tuple[list[list[BodyLoad]], np.ndarray]:
        """Add ``J^T D J`` of springs, and all that they do to the platform.

        Returns their pulls on the bodies of each chain, which act in second order as dead forces
        do, and the moment (3,) that they take from the platform.
        """
        pulls: list[list[BodyLoad]] = [[] for _ in self.chains]
        moment = np.zeros(3, dtype=int).astype(object)
        for spring in springs:
            (a, J_a), (b, J_b) = (self._end(end) for end in spring.ends)
            force, D, positive = spring.pulling(a, b)
            elimination.pivots += positive
            names = list({**J_a, **J_b})
            J = [J_b.get(name, _STILL) - J_a.get(name, _STILL) for name in names]
            for i, name in enumerate(names):
                rate = D @ J[i]
                for other, column in zip(names[i:], J[i:], strict=True):
                    elimination.add(name, other, rate @ column)
            for end, at, pull in zip(spring.ends, (a, b), (force, -force), strict=True):
                if end.chain is not None:
                    pulls[end.chain].append(BodyLoad(end.after, end.point, pull))
                if end.on_platform:
                    moment = moment + self._on_platform(elimination, at - self.platform.at, -pull)
        return pulls, moment

    def _end(self, anchor: RecordedAnchor) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Where an end is, and its velocity by unknowns."""
        if anchor.chain is not None:
            chain = self.chains[anchor.chain]
            at = chain.bodies[anchor.after].of(anchor.point)
            rates = chain.velocities(anchor.after, at)
            return at, dict(zip(self.names[anchor.chain], rates, strict=True))
        if not anchor.on_platform:
            return anchor.point, {}
        at, unit = self.platform.of(anchor.point), np.eye(6, dtype=int).astype(object)
        turning = [cross(unit[row, 3:], at - self.platform.at) for row in self.rows]
        rates = [unit[row, :3] + own for row, own in zip(self.rows, turning, strict=True)]
        return at, dict(zip(self.twist, rates, strict=True))

    def _on_platform(
        self, elimination: SymmetricElimination, arm: np.ndarray, f: np.ndarray
    ) -> np.ndarray:
        """Add a force that the platform exerts at an arm; the moment of it."""
        wrench = np.concatenate([f, cross(arm, f)])
        turning = np.zeros((6, 6), dtype=int).astype(object)
        outer = arm[:, None] * f[None, :]
        turning[3:, 3:] = (outer + outer.T) * 0.5 - identity() * (arm @ f)
        for i, (name, row) in enumerate(zip(self.twist, self.rows, strict=True)):
            elimination.add_right(name, -wrench[row])
            for other, column in zip(self.twist[i:], self.rows[i:], strict=True):
                elimination.add(name, other, turning[row, column])
        return wrench[3:]


def has_symbols(spring: BodySpring) -> bool:
    """Whether any value of a spring is a formula."""
    ends = (x for end in spring.between for x in end.at)
    return any(map(is_formula, (spring.stiffness, spring.free_length, spring.preload, *ends)))


def with_anchors(leg: Leg, springs: Sequence[BodySpring]) -> Leg:
    """The same leg with a mark in the frame of each body that holds a spring."""
    bodies = {end.body for spring in springs for end in spring.between}
    return marked(leg, _ANCHOR, lambda body, _: body in bodies)


def without_anchors(here: RobotOnEntries) -> tuple[RobotOnEntries, Frames]:
    """A robot whose legs were placed with marks, without them; and the frames of the bodies."""
    frames: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    placed = tuple(
        replace(own, leg=_taken(own.leg, f"{own.leg.name}/", frames)) for own in here.placed
    )
    return replace(here, placed=placed), frames


def _taken(
    leg: PlacedLeg, prefix: str, frames: dict[str, tuple[np.ndarray, np.ndarray]]
) -> PlacedLeg:
    def kept() -> Iterator[PlacedElement]:
        for element in leg.elements:
            if isinstance(element, PlacedBlock):
                branches = tuple(_taken(branch, prefix, frames) for branch in element.branches)
                yield replace(element, branches=branches)
            elif isinstance(element, PlacedSpring) and _ANCHOR in element.name:
                name = prefix + element.name.replace(_ANCHOR, "")
                frames[name] = element.rotation, element.point
            else:
                yield element

    return replace(leg, elements=tuple(kept()))


def recorded_body_springs(
    springs: Sequence[BodySpring],
    placed: Sequence[PlacedBodySpring],
    here: RobotOnEntries,
    frames: Frames,
    walks: Sequence[LegWalk],
) -> list[RecordedBodySpring]:
    """Springs between bodies of a robot on entries.

    They are given in numbers, with their tension and the names of their bodies in snapshots at one
    posture (`placed`); `frames` are those of the bodies, `walks` the legs in numbers.
    """
    known = {BASE: (np.eye(3), _NOWHERE), PLATFORM: (here.pose.R, here.pose.p), **frames}
    named = {name: (k, part) for k, walk in enumerate(walks) for name, part in walk.named.items()}
    found = []
    for spring, own in zip(springs, placed, strict=True):
        ends = []
        for end, body in zip(spring.between, own.bodies, strict=True):
            R, p = known[end.body]
            point = np.array(p, dtype=object) + np.array(R, dtype=object) @ end.at
            if body in named:
                leg, part = named[body]
                ends.append(RecordedAnchor(point, leg, part.chain, part.after))
            else:
                ends.append(RecordedAnchor(point, on_platform=body == PLATFORM))
        constant = own.tension - own.stiffness * own.length
        if abs(constant) <= _NONE * max(abs(own.tension), own.stiffness * own.length):
            constant = 0.0
        found.append(RecordedBodySpring((ends[0], ends[1]), own.stiffness, constant))
    return found
