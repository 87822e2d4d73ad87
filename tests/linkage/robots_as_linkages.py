"""Robots with legs, described once more as linkages: every element a connection of two bodies."""

from dataclasses import replace

import numpy as np

import robostiff as rs
from robostiff.kinematics import find_posture
from robostiff.linkage import Connection, Linkage
from robostiff.model import Joint
from robostiff.spatial import Frame


def linkage_of(robot: rs.Robot) -> Linkage:
    """The linkage of a robot of joints and links, at home where the robot is."""
    posture, connections = find_posture(robot), []
    for leg, q in zip(robot.legs, posture.coordinates, strict=True):
        own, before = [], leg.base
        places = {id(element): place for element, place in leg.chain.moving}
        for element in leg.chain.elements:
            if isinstance(element, rs.Rigid):
                before = before @ element.transform
                continue
            name, part = f"{leg.name}.{element.name}", element
            if isinstance(element, Joint):
                home = tuple(q[..., places[id(element)]].ravel().tolist())
                part = replace(element, home=home, name=name)
            own.append((name, before, part))
            before = Frame.identity()
        for k, (name, start, element) in enumerate(own):
            last = k == len(own) - 1
            a = "base" if k == 0 else f"{leg.name}/{k}"
            b = "platform" if last else f"{leg.name}/{k + 1}"
            end = before @ leg.attachment.inverse if last else Frame.identity()
            connections.append(Connection(name, a, b, start, element, end))
    return Linkage(robot.name, tuple(connections), "base", "platform", robot.reference_point)


def drives_at(robot: rs.Robot, pose: np.ndarray) -> dict[str, np.ndarray]:
    """Coordinates of the actuated joints at a pose, by their names in the linkage."""
    posture = find_posture(robot, pose)
    assert posture.reached
    return {
        f"{leg.name}.{element.name}": q[..., place].ravel()
        for leg, q in zip(robot.legs, posture.coordinates, strict=True)
        for element, place in leg.chain.moving
        if isinstance(element.role, rs.Actuated)
    }
