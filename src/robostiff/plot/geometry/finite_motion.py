"""Bodies of a robot under finite loads, as displacements of the points of a picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.model import PlacedLeg, Snapshot
from robostiff.model.snapshot import PlacedBlock
from robostiff.plot.geometry.displacement import BodyMotion, LegMotion, RobotMotion
from robostiff.statics import BodyPlace, BodyPlaces


@dataclass(frozen=True)
class FiniteMotion(BodyMotion):
    """A body that turns far: X moves by ``D X + t``, and a line along it by ``D`` of it.

    Attributes
    ----------
    t : (3,) array
        [m].
    """

    D: np.ndarray
    t: np.ndarray

    @staticmethod
    def of(place: BodyPlace) -> FiniteMotion:
        """The displacements of a body."""
        return FiniteMotion(np.zeros(6), np.zeros(3), place.R - np.eye(3), place.t)

    def displacement(self, point: np.ndarray) -> np.ndarray:
        """Displacement of a point (3,) of the body [m]."""
        return self.D @ point + self.t

    def turned(self, along: np.ndarray) -> np.ndarray:
        """Change of a vector (3,) that the body carries."""
        return self.D @ along


def finite_motion(snapshot: Snapshot, places: BodyPlaces) -> RobotMotion:
    """Motions of all bodies of a robot.

    Parameters
    ----------
    snapshot : Snapshot
        The robot at the unloaded posture.
    places : BodyPlaces
        Of its bodies.
    """
    platform = FiniteMotion.of(places.platform)
    still = FiniteMotion.of(BodyPlace(np.eye(3), np.zeros(3)))
    known = {name: FiniteMotion.of(own) for name, own in places.behind.items()}
    legs = []
    for leg in snapshot.legs:
        walk = _along(leg, f"{leg.name}/", still, known)
        # nothing moves behind the last part that does
        last = _last_moving(leg, f"{leg.name}/", known)
        bodies = tuple(body if i <= last else platform for i, body in enumerate(walk.bodies))
        legs.append(LegMotion(bodies, walk.branches))
    return RobotMotion(platform, tuple(legs))


def _along(
    leg: PlacedLeg, prefix: str, start: FiniteMotion, known: dict[str, FiniteMotion]
) -> LegMotion:
    bodies: list[FiniteMotion] = [start]
    branches = {}
    for i, element in enumerate(leg.elements):
        if isinstance(element, PlacedBlock):
            own = tuple(_along(branch, prefix, bodies[-1], known) for branch in element.branches)
            branches[i] = own
            bodies.append(own[0].bodies[-1])  # type: ignore[arg-type]
        else:
            bodies.append(known.get(prefix + element.name, bodies[-1]))
    return LegMotion(tuple(bodies), branches)


def _last_moving(leg: PlacedLeg, prefix: str, known: dict[str, FiniteMotion]) -> int:
    """Place of the last body before one that is the platform."""
    moving = [
        i
        for i, element in enumerate(leg.elements)
        if isinstance(element, PlacedBlock) or prefix + element.name in known
    ]
    return moving[-1] if moving else -1
