"""Masses of a robot and springs between its bodies in the world, each with the bodies it is on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any, cast

import numpy as np

from robostiff.errors import InputError
from robostiff.kept import kept
from robostiff.kinematics.frames import ChainWalk, Way
from robostiff.kinematics.posture import Posture
from robostiff.kinematics.posture_finder import find_posture
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import (
    BodyPoint,
    Chain,
    Element,
    Link,
    Mass,
    PlacedBodySpring,
    PlacedLeg,
    PlacedMass,
    PlacedSpring,
    Rigid,
    Snapshot,
    Telescope,
)
from robostiff.model.body_spring import BASE, PLATFORM
from robostiff.spatial import Frame


def with_masses(posture: Posture) -> Snapshot:
    """The snapshot of a posture, the masses of its legs and its platform in place, and its gravity.

    Examples
    --------
    >>> from robostiff.kinematics import find_posture
    >>> from robostiff.robots import load
    >>> arm = with_masses(find_posture(load("six-joint-arm"))).legs[0]
    >>> [(mass.name, round(float(mass.value), 2)) for mass in arm.masses][:2]
    [('column', 39.9), ('upper arm', 9.07)]
    """
    robot = posture.robot.in_floats
    legs = tuple(
        placed_with_masses(leg.name, leg.chain, q, leg.base)
        for leg, q in zip(robot.legs, posture.coordinates, strict=True)
    )
    R, p = turn_by_vector(posture.pose[:, 3:]), posture.pose[:, :3]
    on_platform = tuple(
        own for mass in robot.platform_masses for own in mass.placed(mass.name, R, p)
    )
    return replace(posture.snapshot, legs=legs, masses=on_platform, gravity=robot.gravity)


def placed_with_masses(name: str, chain: Chain, q: np.ndarray, base: Frame) -> PlacedLeg:
    """A chain of coordinates q (..., size) in the world, its masses in place."""
    walk = _MassWalk(base.R, base.p, Way.of(chain, q))
    walk.along(chain)
    return walk.leg(name)


class _MassWalk(ChainWalk):
    """The way along a chain, with the masses that its parts carry."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.masses: list[PlacedMass] = []

    def over(self, element: Element) -> None:
        R, p = self.R, self.p
        super().over(element)
        if isinstance(element, Rigid):
            for mass in element.masses:
                self.fixed(element.name, mass, R, p, 0.5 * element.transform.p)
        elif isinstance(element, Link):
            for mass in element.masses:
                if not np.any(element.to):
                    self.fixed(element.name, mass, R, p, np.zeros(3))
                elif mass.is_spread:
                    self.spread(mass.value, p, mass.span or (0.0, 1.0))
                else:
                    self.fixed(element.name, mass, R, p, 0.5 * element.to, start=p)

    def leg(self, name: str) -> PlacedLeg:
        return replace(super().leg(name), masses=tuple(self.masses))

    def telescope(self, telescope: Telescope, extension: np.ndarray) -> None:
        start = self.p
        super().telescope(telescope, extension)
        if not telescope.beams:
            return
        placed, beams = self.placed[-len(telescope.beams) :], telescope.beams
        after = len(self.placed) - len(beams)
        for i, (part, beam) in enumerate(zip(placed, beams, strict=True), start=1):
            value = beam.mass_at(np.asarray(beam.fixed + beam.share * extension))
            if value is not None:
                self.spread(value, start, (0.0, 1.0), after + i)
            start = cast("PlacedSpring", part).point

    def fixed(
        self,
        name: str,
        mass: Mass,
        R: np.ndarray,
        p: np.ndarray,
        usual: np.ndarray,
        start: np.ndarray | None = None,
    ) -> None:
        """A mass in one place, given in the frame at the start of its part."""
        given = mass if mass.centre is not None else replace(mass, centre=usual, span=None)
        self.masses += given.placed(self.prefix + name, R, p, len(self.placed), start)

    def spread(
        self, value: Any, start: np.ndarray, span: tuple[float, float], after: int | None = None
    ) -> None:
        """A mass along the elastic part that has been placed last, or as the `after`-th."""
        after = len(self.placed) if after is None else after
        part = self.placed[after - 1]
        end = cast("PlacedSpring", part).point
        centre = start + 0.5 * (span[0] + span[1]) * (end - start)
        self.masses.append(PlacedMass(part.name, np.asarray(value), centre, after, start, span))


def with_body_springs(posture: Posture) -> Snapshot:
    """The snapshot of a posture, its springs between bodies in place.

    Raises
    ------
    InputError
        When a spring names no body of the robot.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from robostiff.kinematics import find_posture
    >>> from robostiff.model import BodyPoint, BodySpring
    >>> from robostiff.robots import load
    >>> ends = BodyPoint("base"), BodyPoint("arm/upper arm", [0, 0, 0.1])
    >>> spring = BodySpring("compensator", ends, stiffness=2000.0, free_length=0.2)
    >>> arm = replace(load("six-joint-arm"), springs=(spring,))
    >>> with_body_springs(find_posture(arm)).springs[0].points[1].round(3)
    array([[0.184, 0.   , 0.544]])
    """
    springs = posture.robot.in_floats.springs
    if not springs:
        return posture.snapshot
    here = bodies_of(posture)
    home = bodies_of(find_posture(posture.robot, None))
    placed = []
    for spring in springs:
        ends = [_placed(here, end, spring.name) for end in spring.between]
        if spring.preload is None:
            length, tension = spring.free_length, 0.0
        else:
            a, b = (_placed(home, end, spring.name)[1].reshape(-1, 3)[0] for end in spring.between)
            length, tension = float(np.linalg.norm(b - a)), spring.preload
        placed.append(
            PlacedBodySpring(
                spring.name,
                (ends[0][0], ends[1][0]),
                (ends[0][1], ends[1][1]),
                float(spring.stiffness),
                float(length),
                float(tension),
            )
        )
    return replace(posture.snapshot, springs=tuple(placed))


@dataclass(frozen=True)
class PlacedBody:
    """A frame in which points of a body are given."""

    # ``base``, ``platform``, or ``leg/part``, the part that has been placed last before it
    name: str
    # (..., 3, 3) and (..., 3)
    R: np.ndarray
    p: np.ndarray


@kept
def bodies_of(posture: Posture) -> dict[str, PlacedBody]:
    """Frames of the bodies of a robot, by ``leg/part``: where a part begins, of a joint behind it.

    They are those in which masses and the ends of springs are given.
    """
    pose = posture.pose
    found = {
        BASE: PlacedBody(BASE, np.eye(3), np.zeros(3)),
        PLATFORM: PlacedBody(PLATFORM, turn_by_vector(pose[:, 3:]), pose[:, :3]),
    }
    for leg, q in zip(posture.robot.in_floats.legs, posture.coordinates, strict=True):
        way = Way.of(leg.chain, q)
        ChainWalk(leg.base.R, leg.base.p, way).along(leg.chain)
        for name, (R, p, part) in way.bodies.items():
            own = BASE if part is None else f"{leg.name}/{part}"
            found[f"{leg.name}/{name}"] = PlacedBody(own, R, p)
    return found


def _placed(bodies: dict[str, PlacedBody], end: BodyPoint, spring: str) -> tuple[str, np.ndarray]:
    """The body, and where a point of it is (..., 3) [m]."""
    body = bodies.get(end.body)
    if body is None:
        near = get_close_matches(str(end.body), bodies, n=3) or list(bodies)[:4]
        raise InputError(
            f"body of spring {spring!r}",
            got=end.body,
            expected=f"base, platform or leg/part, such as {', '.join(map(repr, near))}",
        )
    p = body.p + np.einsum("...ij,j->...i", body.R, np.asarray(end.at, dtype=float))
    return body.name, p
