"""Masses of a robot in the world, each with the body that carries it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np

from robostiff.kinematics.frames import ChainWalk, Way
from robostiff.kinematics.posture import Posture
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import (
    Chain,
    Element,
    Link,
    Mass,
    PlacedLeg,
    PlacedMass,
    PlacedSpring,
    Rigid,
    Snapshot,
    Telescope,
)
from robostiff.spatial import Frame


def with_masses(posture: Posture) -> Snapshot:
    """The snapshot of a posture, the masses of its legs and its platform in place, and its gravity.

    Parameters
    ----------
    posture : Posture

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
