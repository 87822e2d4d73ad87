"""What the robot of a file must be at home: closed, in its plane, posed by its coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np

from robostiff.errors import Words
from robostiff.io.model_file.joints import WrittenLaw, build_law
from robostiff.io.model_file.place import Place
from robostiff.kinematics import find_posture, place_chain, posture_finder, with_body_springs
from robostiff.kinematics.closure.loops import (
    determine_pose,
    fitting_coordinates,
    platform_mobility,
)
from robostiff.model import Chain, ForceLaw, Robot, pose_coordinates
from robostiff.model.checks import check_in_plane
from robostiff.spatial import Space

# Coordinates this far from home, in radians and metres, say how many freedoms an arm has elsewhere.
_ASIDE, _SEED = 1e-1, 5


def robot_at_home(robot: Robot, top: Place, places: list[Place], *, chosen: bool) -> Robot:
    """The robot with its pose coordinates chosen, by the file or else as they follow from the legs.

    Raises at the leg that does not close at home, at the joint that leaves the plane, or at
    coordinates that do not determine the pose. `top` is the document, `places` are of the legs.
    """
    legs = zip(places, robot.legs, strict=True) if robot.space is Space.PLANAR else ()
    for place, leg in legs:
        freedoms = place_chain(leg.chain, leg.chain.home, leg.base.R, leg.base.p).freedoms
        numbers = {
            id(inner): i
            for i, element in enumerate(leg.chain.elements)
            for inner in (element, *(inner for inner, _ in Chain((element,)).moving))
        }
        for element, where in leg.chain.moving:
            for freedom in freedoms[where]:
                with (place / "chain" / numbers[id(element)]).complaints():
                    check_in_plane(f"{element.name} in a planar robot", freedom)
    finder = posture_finder(robot)
    q = []
    for i, place in enumerate(places):
        with place.complaints():
            q.append(finder.closing(i).home)
    coordinates = pose_coordinates(robot.space)
    if robot.is_posed_by_joints or (chosen and len(robot.coordinates) == len(coordinates)):
        return robot
    mobility = platform_mobility(robot, finder.home_pose, q, finder.length)
    if determine_pose(mobility, robot.coordinates):
        return robot
    fitting = fitting_coordinates(mobility)
    if not chosen:  # none for a structure, which has the home pose only
        if robot.is_serial and not robot.legs[0].chain.has_blocks:
            # not of an arm that has fewer freedoms at its home than aside
            step = np.random.default_rng(_SEED).uniform(-_ASIDE, _ASIDE, q[0].shape)
            aside = platform_mobility(robot, finder.home_pose, [q[0] + step], 1.0)
            at_home = platform_mobility(robot, finder.home_pose, q, 1.0)
            if at_home.shape[1] < aside.shape[1]:
                return robot
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


def at_home(
    top: Place, robot: Robot, places: list[Place], *, chosen: bool, laws: Mapping[str, WrittenLaw]
) -> Robot:
    """The robot of a model file, verified with its flexible platform, springs and force laws.

    Raises at the part that is to blame, as `verified` does.
    """
    robot = robot_at_home(robot, top, places, chosen=chosen)
    if robot.platform is not None:
        from robostiff.network import SpringElement
        from robostiff.network.equations import check_fits

        with (top / "platform").complaints():
            for p in robot.platform.parts:
                spring = SpringElement(p.name, p.a, p.b, p.point, p.axes, p.elasticity)
                check_fits(spring, robot.space)
    for i, spring in enumerate(robot.springs):
        alone = robot.with_springs((spring,))
        with (top / "springs" / i / "between").complaints():
            with_body_springs(find_posture(alone, None))
    if not laws:
        return robot
    from robostiff.statics.loading.given_loads import check_own_laws

    snapshot = find_posture(robot, None).snapshot.one(0)
    joints = {f"{leg.name}/{joint.name}": joint for leg in snapshot.legs for joint in leg.freedoms}
    built: dict[str, ForceLaw] = {}
    for pattern, law in laws.items():  # names leg/joint, in which * stands for any part
        place = top / "laws" / pattern
        names = [name for name in joints if fnmatchcase(name, pattern)]
        if not names:
            expected = "leg/joint, such as " + ", ".join(map(repr, list(joints)[:3]))
            raise place.error("joint of a law", got=pattern, expected=expected, key=True)
        for name in names:
            force_law = build_law(place, law, joints[name])
            with place.complaints():
                check_own_laws({name: force_law}, snapshot)
            built[name] = force_law
    return replace(robot, laws=built)
