"""Masses of a robot and springs between its bodies in the world, each with the bodies it is on."""

from __future__ import annotations

from difflib import get_close_matches

import numpy as np

from robostiff.errors import InputError
from robostiff.frozen import frozen, replace
from robostiff.kept import kept
from robostiff.kinematics.frames import ChainWalk, Way
from robostiff.kinematics.posture import Posture
from robostiff.kinematics.posture_finder import find_posture, posture_finder
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import BodyPoint, Chain, PlacedBodySpring, PlacedLeg, Snapshot
from robostiff.model.body_spring import BASE, PLATFORM


def with_masses(posture: Posture) -> Snapshot:
    """The snapshot of a posture, with the masses of legs and platform in place, and gravity."""
    robot, N = posture.robot.in_floats, len(posture.pose)
    legs = list(posture.snapshot.legs)
    for places, group in posture_finder(robot).legs_alike:
        q = np.concatenate([posture.coordinates[i] for i in places])
        rows = placed_with_masses(group.leg.name, group.chain, q, *group.bases(N))
        own = rows if rows.blocks else replace(rows, elements=())  # they are known
        for i, leg in zip(places, group.one_by_one(own, N), strict=True):
            legs[i] = leg if rows.blocks else replace(legs[i], masses=leg.masses)
    R, p = turn_by_vector(posture.pose[:, 3:]), posture.pose[:, :3]
    on_platform = tuple(
        own for mass in robot.platform_masses for own in mass.placed(mass.name, R, p)
    )
    return replace(posture.snapshot, legs=tuple(legs), masses=on_platform, gravity=robot.gravity)


def placed_with_masses(
    name: str, chain: Chain, q: np.ndarray, R: np.ndarray, p: np.ndarray
) -> PlacedLeg:
    """A chain of coordinates q (..., size) in the world, its masses in place; it begins at R, p."""
    walk = ChainWalk(R, p, Way(chain, q, weighs=True))
    walk.along(chain)
    return walk.leg(name)


def with_body_springs(posture: Posture) -> Snapshot:
    """The snapshot of a posture, its springs between bodies in place.

    Raises
    ------
    InputError
        When a spring names no body of the robot.
    """
    springs = posture.robot.in_floats.springs
    if not springs:
        return posture.snapshot
    here = bodies_of(posture)
    home = bodies_of(find_posture(posture.robot, None))
    placed = []
    for spring in springs:
        (a, p), (b, q) = (_placed(here, end, spring.name) for end in spring.between)
        if spring.preload is None:
            length, tension = float(spring.free_length), 0.0
        else:
            ends = (_placed(home, end, spring.name)[1].reshape(-1, 3)[0] for end in spring.between)
            length, tension = float(np.linalg.norm(np.subtract(*ends))), float(spring.preload)
        stiffness = float(spring.stiffness)
        placed.append(PlacedBodySpring(spring.name, (a, b), (p, q), stiffness, length, tension))
    return replace(posture.snapshot, springs=tuple(placed))


@frozen
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
        way = Way(leg.chain, q)
        ChainWalk(leg.base.R, leg.base.p, way).along(leg.chain)
        for name, (placing, part) in way.bodies.items():
            own = BASE if part is None else f"{leg.name}/{part}"
            found[f"{leg.name}/{name}"] = PlacedBody(own, *placing())
    return found


def _placed(bodies: dict[str, PlacedBody], end: BodyPoint, spring: str) -> tuple[str, np.ndarray]:
    """The body, and where a point of it is (..., 3) [m]."""
    body = bodies.get(end.body)
    if body is None:
        near = get_close_matches(str(end.body), bodies, n=3) or list(bodies)[:4]
        expected = f"base, platform or leg/part, such as {', '.join(map(repr, near))}"
        raise InputError(f"body of spring {spring!r}", got=end.body, expected=expected)
    p = body.p + np.einsum("...ij,j->...i", body.R, np.asarray(end.at, dtype=float))
    return body.name, p
