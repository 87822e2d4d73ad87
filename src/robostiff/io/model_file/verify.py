"""What a robot must satisfy as a whole: it closes at home, and a planar one fits the plane."""

from __future__ import annotations

import numpy as np

from robostiff.io.model_file.place import Place
from robostiff.io.suggest import Words
from robostiff.kinematics import PostureFinder, place_chain
from robostiff.kinematics.closure import leg_solver
from robostiff.model import Leg, Motion, PlacedFreedom, Robot
from robostiff.spatial import Space

_ACROSS = 1e-9


def verify(robot: Robot, places: list[Place]) -> None:
    """Raise at the leg that does not close at home, or at the joint that leaves the plane."""
    if robot.space is Space.PLANAR:
        for place, leg in zip(places, robot.legs, strict=True):
            _check_plane(place, leg)
    finder = PostureFinder(robot)
    for place, leg in zip(places, robot.legs, strict=True):
        with place.complaints():
            leg_solver(leg, finder.home_pose, finder.length)


def _check_plane(place: Place, leg: Leg) -> None:
    R_base, p_base = leg.base.rotation.as_matrix(), leg.base.translation
    placed = place_chain(leg.chain, leg.chain.home, R_base, p_base)
    freedoms = [e for e in placed.elements if isinstance(e, PlacedFreedom)]
    numbers = {id(element): i for i, element in enumerate(leg.chain.elements)}
    for element, where in leg.chain.moving:
        for freedom in freedoms[where]:
            turns = freedom.motion is Motion.ROTATION
            across, along = np.linalg.norm(freedom.axis[:2]), abs(freedom.axis[2])
            if (across if turns else along) <= _ACROSS:
                continue
            raise (place / "chain" / numbers[id(element)]).error(
                f"{'axis' if turns else 'direction'} of {element.name} in a planar robot",
                got=Words(str([round(float(part), 6) + 0.0 for part in freedom.axis])),
                expected="an axis along z of the world"
                if turns
                else "a direction in the x-y plane of the world",
                hint="planar robots move in the x-y plane; leave planar: out for any other",
            )
