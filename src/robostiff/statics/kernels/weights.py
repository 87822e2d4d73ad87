"""Weights and dead forces on the bodies of a robot on recorded entries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from robostiff.kinematics import Pose
from robostiff.model import (
    Chain,
    Joint,
    Leg,
    Link,
    Mass,
    ParallelBlock,
    PlacedBlock,
    PlacedElement,
    PlacedLeg,
    PlacedMass,
    PlacedSpring,
    Rigid,
    Telescope,
    TelescopicBeam,
)
from robostiff.record import is_zero
from robostiff.recorded.robot import RobotOnEntries
from robostiff.statics.chains.beam_bowing import Beams, Bowing
from robostiff.statics.chains.chain import BodyLoad
from robostiff.statics.equilibrium import equilibrium
from robostiff.statics.kernels.marks import marked
from robostiff.statics.loading.from_snapshot import DeadForce, LegWalk
from robostiff.statics.loading.given_loads import Gravity, Loads, given_forces
from robostiff.statics.result import Equilibria

# Names a rigid part without extent, which shows where the frame of the next one is.
_FRAME = "\0frame"
_NOWHERE = np.zeros(3)
_BOWING = Bowing()


@dataclass(frozen=True)
class StandingLoads:
    """What acts beside the wrench, at every pose alike, and on what; as for `equilibrium`."""

    loads: Loads | None = None
    gravity: Gravity = None
    preload: Mapping[str, float] | None = None
    beams: Beams = _BOWING

    @property
    def given(self) -> dict[str, Any]:
        """As arguments of `equilibrium`."""
        return {name: getattr(self, name) for name in ("loads", "gravity", "preload", "beams")}

    def equilibria(self, robot: Any, pose: Pose, F: np.ndarray) -> Equilibria:
        """Of a robot at many poses, each under its wrench and what stands."""
        found = equilibrium(robot, pose, F, **self.given)
        if not isinstance(found, Equilibria):
            raise TypeError("a batch of poses gives equilibria")
        return found


def framed(leg: Leg) -> Leg:
    """The same leg with a mark in each frame in which masses are given."""
    return marked(leg, _FRAME, lambda _, e: isinstance(e, Rigid | Link) and bool(e.masses))


def with_recorded_masses(here: RobotOnEntries) -> RobotOnEntries:
    """A robot whose legs were placed with marks, without them, and its masses in place."""
    pairs = zip(here.robot.legs, here.placed, strict=True)
    placed = (replace(own, leg=_weighed(framed(leg).chain, own.leg)) for leg, own in pairs)
    return replace(here, placed=tuple(placed))


def _weighed(chain: Chain, placed: PlacedLeg) -> PlacedLeg:
    """Its masses as `with_masses` has them in numbers, in the same order."""
    left = iter(placed.elements)
    kept: list[PlacedElement] = []
    masses: list[PlacedMass] = []
    R, p = np.eye(3), _NOWHERE
    for element in chain.elements:
        if isinstance(element, Rigid):
            for mass in element.masses:
                centre = element.transform.p * 0.5 if mass.centre is None else mass.centre
                masses += _fixed(element.name, mass, p + R @ centre, len(kept))
            continue
        own = next(left)
        if isinstance(own, PlacedSpring) and element.name.startswith(_FRAME):
            R, p = own.rotation, own.point
            continue
        if isinstance(own, PlacedBlock) and isinstance(element, ParallelBlock):
            pairs = zip(element.branches, own.branches, strict=True)
            own = replace(own, branches=tuple(_weighed(b.chain, leg) for b, leg in pairs))
        kept.append(own)
        if isinstance(element, Joint):
            kept += [next(left) for _ in range(element.size - 1)]
        elif isinstance(element, Link):
            masses += _along(element, own, R, p, len(kept))
        elif isinstance(element, Telescope):
            for beam in element.beams:
                start, own = own, next(left)
                kept.append(own)
                masses += _of_beam(beam, start, own, len(kept))
    return replace(placed, elements=tuple(kept), masses=tuple(masses))


def _along(link: Link, own: Any, R: np.ndarray, p: np.ndarray, after: int) -> Iterator[PlacedMass]:
    """Masses of an elastic part that begins in the frame (R, p)."""
    for mass in link.masses:
        centre = p + R @ (link.to * 0.5 if mass.centre is None else mass.centre)
        if not np.any(link.to):
            yield from _fixed(own.name, mass, centre, after)
        elif mass.is_spread:
            yield _spread(mass.value, own, p, mass.span or (0.0, 1.0), after)
        else:
            yield from _fixed(own.name, mass, centre, after, p)


def _of_beam(beam: TelescopicBeam, start: Any, own: Any, after: int) -> Iterator[PlacedMass]:
    """Mass of a beam of a telescope, between the points of two parts."""
    value, density = beam.mass, beam.material.density
    if value is None and density is not None:
        length = (own.point - start.point) @ own.rotation[:, 0]
        value = length * beam.section.A * density
    if value is not None:
        yield _spread(value, own, start.point, (0.0, 1.0), after)


def _fixed(
    name: str, mass: Mass, centre: np.ndarray, after: int, start: np.ndarray | None = None
) -> list[PlacedMass]:
    """A mass in one place; where it turns does not matter to its weight."""
    count = 1 if mass.inertia is None else 6
    one = PlacedMass(name, mass.value * (1 / count), centre, after, start)
    return [one] * count


def _spread(
    value: Any, own: PlacedSpring, start: np.ndarray, span: tuple[float, float], after: int
) -> PlacedMass:
    centre = start + (own.point - start) * (0.5 * (span[0] + span[1]))
    return PlacedMass(own.name, value, centre, after, start, span)


def loads_on_legs(
    walks: Sequence[LegWalk],
    placed: Sequence[PlacedLeg],
    forces: Mapping[str, Sequence[DeadForce]],
    gravity: np.ndarray,
) -> list[dict[int, list[BodyLoad]]]:
    """What acts on the bodies of each leg, by chain: forces by ``leg/part``, and weights.

    The weights of one body are one force at their centre. `walks` has the legs in numbers, `placed`
    on entries.
    """
    found = []
    for walk, leg in zip(walks, placed, strict=True):
        points: dict[str, np.ndarray] = {}
        for element in leg.parts:  # the last freedom of a joint has its body behind it
            joint = getattr(element, "joint", element.name)  # of a coupling the one that follows
            for name in (element.name, element.name.partition("[")[0], joint):
                points[name] = element.point
        points |= {block.name: block.branches[0].end for block in leg.all_blocks}
        own: dict[int, list[BodyLoad]] = {}
        weights: dict[tuple[int, int], list[tuple[Any, np.ndarray]]] = {}
        if np.any(gravity):
            for own_mass, mass in zip(walk.carried, leg.all_masses, strict=True):
                end = points.get(mass.name, _NOWHERE)
                for point in mass.lumped(own_mass.parts, end):
                    at = own_mass.chain, own_mass.after - own_mass.parts + point.after
                    weights.setdefault(at, []).append((point.value, point.point))
        for (chain, after), several in weights.items():
            value, centre = _together(several)
            own.setdefault(chain, []).append(BodyLoad(after, centre, gravity * value))
        for name, part in walk.named.items():
            for force in forces.get(name, ()):
                point = force.point
                if point is None:
                    point = points[name.removeprefix(walk.prefix)]
                at = np.array(point, dtype=object)
                own.setdefault(part.chain, []).append(
                    BodyLoad(part.after, at, np.array(force.force, dtype=object))
                )
        still = {c for c, (start, _, _) in enumerate(walk.chains) if start is None}
        found.append(
            {
                chain: [load for load in loads if load.after or chain not in still]
                for chain, loads in own.items()
            }
        )
    return found


def loads_on_platform(
    here: RobotOnEntries, standing: StandingLoads, gravity: np.ndarray
) -> tuple[list[tuple[np.ndarray, np.ndarray]], dict[str, tuple[DeadForce, ...]]]:
    """Arms (3,) and forces (3,) of what acts on the platform; and forces on legs by their names."""
    robot, pose, reference = here.robot, here.pose, here.reference
    forces = given_forces(standing.loads, gravity, robot.space, {"platform": (pose.R, pose.p)}.get)
    found = []
    if np.any(gravity) and robot.platform_masses:
        several = [
            (mass.value, pose.p if mass.centre is None else pose.p + pose.R @ mass.centre)
            for mass in robot.platform_masses
        ]
        value, centre = _together(several)
        found.append((centre - reference, gravity * value))
    for own in forces.pop("platform", ()):
        arm = np.zeros(3, dtype=int).astype(object)
        if own.point is not None:
            arm = np.array(own.point, dtype=object) - reference
        found.append((arm, np.array(own.force, dtype=object)))
    return found, forces


def _together(several: Sequence[tuple[Any, np.ndarray]]) -> tuple[Any, np.ndarray]:
    """Masses as one at their centre."""
    several = [(value, np.array(point, dtype=object)) for value, point in several]
    if len(several) == 1:
        return several[0]
    total = sum(value for value, _ in several)
    if is_zero(total):
        return total, several[0][1]
    moment = reduce(add, (point * value for value, point in several))
    return total, moment * (1 / total)
