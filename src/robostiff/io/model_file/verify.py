"""Checks of a whole robot: it closes at home, and a planar one lies in the plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robostiff.io.model_file.place import Place
from robostiff.io.suggest import Words
from robostiff.kinematics import place_chain, posture_finder
from robostiff.kinematics.mobility import (
    determine_pose,
    fitting_coordinates,
    platform_mobility,
)
from robostiff.model import Chain, Leg, Robot
from robostiff.spatial import Space

_ACROSS = 1e-9


def verified(robot: Robot, top: Place, places: list[Place], *, chosen: bool) -> Robot:
    """The robot with its pose coordinates chosen, by the file or else as they follow from the legs.

    Raises at the leg that does not close at home, at the joint that leaves the plane, or at
    coordinates that do not determine the pose. `top` is the document, `places` are of the legs.
    """
    if robot.space is Space.PLANAR:
        for place, leg in zip(places, robot.legs, strict=True):
            _check_plane(place, leg)
    finder = posture_finder(robot)
    q = []
    for i, place in enumerate(places):
        with place.complaints():
            q.append(finder.closing(i).home)
    if robot.is_serial or (chosen and len(robot.coordinates) == 6):
        return robot
    mobility = platform_mobility(robot, finder.home_pose, q, finder.length)
    if determine_pose(mobility, robot.coordinates):
        return robot
    fitting = fitting_coordinates(mobility)
    if not chosen:  # none for a structure, which has the home pose only
        return replace(robot, coordinates=fitting)
    words = " ".join(coordinate.value for coordinate in robot.coordinates) or "none"
    raise (top / "coordinates").error(
        "coordinates of the platform",
        got=Words(words),
        expected=f"as many as the {len(fitting)} freedoms that the legs leave it in the home "
        "configuration, and independent",
        hint=f"write coordinates: [{', '.join(c.value for c in fitting)}], or leave it out; where "
        "the home configuration is singular, choose another one, or all six coordinates",
    )


def _check_plane(place: Place, leg: Leg) -> None:
    freedoms = place_chain(leg.chain, leg.chain.home, leg.base.R, leg.base.p).freedoms
    numbers = {
        id(inner): i
        for i, element in enumerate(leg.chain.elements)
        for inner in (element, *(inner for inner, _ in Chain((element,)).moving))
    }
    for element, where in leg.chain.moving:
        for freedom in freedoms[where]:
            turns = freedom.turns
            if turns and freedom.slides:
                raise (place / "chain" / numbers[id(element)]).error(
                    f"{element.name} in a planar robot",
                    got=Words("a helical joint"),
                    expected="joints that turn about z of the world or slide across it",
                    hint="planar robots move in the x-y plane; leave planar: out for any other",
                )
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
