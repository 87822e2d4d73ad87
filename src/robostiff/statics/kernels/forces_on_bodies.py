"""What acts on bodies on recorded entries: springs between them, weights, and dead forces."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.model import (
    Chain,
    Element,
    Joint,
    Leg,
    Link,
    ParallelBlock,
    PlacedBlock,
    PlacedBodySpring,
    PlacedElement,
    PlacedLeg,
    PlacedMass,
    PlacedSpring,
    Rigid,
    Telescope,
    TelescopicBeam,
)
from robostiff.model.body_spring import PLATFORM, BodySpring
from robostiff.recorded.robot import RobotOnEntries
from robostiff.spatial import is_formula
from robostiff.statics.chains.beam_bowing import Bowing

# Names a rigid part without extent, which shows where the frame of a body is.
_MARK = "\0frame"
_BOWING = Bowing()

Frames = Mapping[str, tuple[np.ndarray, np.ndarray]]


def marked(leg: Leg, bodies: Collection[str], *, weigh: bool) -> Leg:
    """A leg with a rigid part without extent in the frames of bodies, by ``leg/part``.

    And, to `weigh` them, in those in which masses are given. Their names begin with a mark and go
    on with those of the parts.
    """

    def along(chain: Chain, prefix: str) -> Chain:
        elements: list[Element] = []
        for element in chain.elements:
            pair: list[Element] = [element]
            if isinstance(element, ParallelBlock):
                inner = f"{prefix}{element.name}/"
                branches = (
                    replace(one, chain=along(one.chain, f"{inner}{one.name}/"))
                    for one in element.branches
                )
                pair = [replace(element, branches=tuple(branches))]
            carries = weigh and isinstance(element, Rigid | Link) and bool(element.masses)
            if carries or prefix + element.name in bodies:
                name = _MARK + element.name
                own = Link(np.zeros(3), Elasticity(np.zeros((6, 6))), np.eye(3), name)
                # behind a joint its body begins; a link is given in the frame before it
                pair.insert(1 if isinstance(element, Joint | ParallelBlock) else 0, own)
            elements += pair
        return replace(chain, elements=tuple(elements))

    return replace(leg, chain=along(leg.chain, f"{leg.name}/"))


def marked_bodies(springs: Sequence[BodySpring], loaded: Iterable[str]) -> set[str]:
    """Bodies whose frames are asked for: those that hold springs, or are loaded."""
    bodies = {end.body for spring in springs for end in spring.between}
    return bodies | {_part_of(name) for name in loaded}


def unmarked(
    here: RobotOnEntries, mark: Callable[[Leg], Leg], *, weigh: bool
) -> tuple[RobotOnEntries, Frames]:
    """A robot whose legs were placed with marks, without them; and the frames of the bodies.

    To `weigh` them its masses are in place, as `with_masses` has them in numbers.
    """
    frames: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    placed = []
    for leg, own in zip(here.robot.legs, here.placed, strict=True):
        without = _unmarked(mark(leg).chain, own.leg, f"{own.leg.name}/", frames, weigh)
        placed.append(replace(own, leg=without))
    return replace(here, placed=tuple(placed)), frames


def _unmarked(
    chain: Chain,
    placed: PlacedLeg,
    prefix: str,
    frames: dict[str, tuple[np.ndarray, np.ndarray]],
    weigh: bool,
) -> PlacedLeg:
    left = iter(placed.elements)
    kept: list[PlacedElement] = []
    masses: list[PlacedMass] = []
    R, p = np.eye(3), np.zeros(3)
    for element in chain.elements:
        if isinstance(element, Rigid):
            for mass in element.masses:
                centre = element.transform.p * 0.5 if mass.centre is None else mass.centre
                masses.append(PlacedMass(element.name, mass.value, p + R @ centre, len(kept)))
            continue
        own = next(left)
        if isinstance(own, PlacedSpring) and element.name.startswith(_MARK):
            R, p = own.rotation, own.point
            frames[prefix + own.name.replace(_MARK, "")] = R, p
            continue
        if isinstance(own, PlacedBlock) and isinstance(element, ParallelBlock):
            pairs = zip(element.branches, own.branches, strict=True)
            each = (_unmarked(b.chain, leg, prefix, frames, weigh) for b, leg in pairs)
            own = replace(own, branches=tuple(each))
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
    return replace(placed, elements=tuple(kept), masses=tuple(masses) if weigh else ())


def _along(link: Link, own: Any, R: np.ndarray, p: np.ndarray, after: int) -> Iterator[PlacedMass]:
    """Masses of an elastic part that begins in the frame (R, p)."""
    for mass in link.masses:
        if mass.is_spread and np.any(link.to):
            yield _spread(mass.value, own, p, mass.span or (0.0, 1.0), after)
        else:  # where it turns does not matter to its weight
            centre = p + R @ (link.to * 0.5 if mass.centre is None else mass.centre)
            start = p if np.any(link.to) else None
            yield PlacedMass(own.name, mass.value, centre, after, start)


def _of_beam(beam: TelescopicBeam, start: Any, own: Any, after: int) -> Iterator[PlacedMass]:
    """Mass of a beam of a telescope, between the points of two parts."""
    value, density = beam.mass, beam.material.density
    if value is None and density is not None:
        length = (own.point - start.point) @ own.rotation[:, 0]
        value = length * beam.section.A * density
    if value is not None:
        yield _spread(value, own, start.point, (0.0, 1.0), after)


def _spread(
    value: Any, own: PlacedSpring, start: np.ndarray, span: tuple[float, float], after: int
) -> PlacedMass:
    centre = start + (own.point - start) * (0.5 * (span[0] + span[1]))
    return PlacedMass(own.name, value, centre, after, start, span)


def has_symbols(spring: BodySpring) -> bool:
    """Whether any value of a spring is a formula."""
    ends = (x for end in spring.between for x in end.at)
    return any(map(is_formula, (spring.stiffness, spring.free_length, spring.preload, *ends)))


def _part_of(name: str) -> str:
    """The part whose frame a body has, by the name of one of its freedoms or beams."""
    return name.partition("[")[0].partition(".beam")[0]


def placed_springs(
    springs: Sequence[BodySpring], placed: Sequence[PlacedBodySpring], frames: Frames
) -> tuple[PlacedBodySpring, ...]:
    """Springs between bodies of a robot, as they are `placed` in numbers, with ends on entries."""
    found = []
    for spring, own in zip(springs, placed, strict=True):
        points = []
        for end in spring.between:
            R, p = frames[end.body]
            points.append(np.array(p, dtype=object) + np.array(R, dtype=object) @ end.at)
        found.append(replace(own, points=(points[0], points[1])))
    return tuple(found)


def frame_of(frames: Frames, name: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Axes and origin of a body by its name."""
    return frames.get(name) or frames.get(_part_of(name))


def masses_of_platform(here: RobotOnEntries) -> list[PlacedMass]:
    """Masses on the platform of a robot on entries."""
    found = []
    for mass in here.robot.platform_masses:
        at = here.pose.p if mass.centre is None else here.pose.p + here.pose.R @ mass.centre
        found.append(PlacedMass(PLATFORM, mass.value, at))
    return found


#: A body, and a point in its frame [m].
Site = tuple[str, tuple[float, float, float]]


def force_inputs(sites: Sequence[Site]) -> tuple[str, ...]:
    """Names of the inputs that are forces at points of bodies, world axes [N]."""
    return tuple(f"force{k}_{a}" for k in range(len(sites)) for a in "xyz")
