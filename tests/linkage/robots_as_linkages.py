"""Robots with legs, described once more as linkages: every element a connection of two bodies."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import circle, material
from robostiff.kinematics import find_posture
from robostiff.linkage import Connection, Linkage
from robostiff.model import Coordinate, Joint
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


def five_bar() -> rs.Robot:
    """Two cranks and two rods of steel that meet in a hinge; the platform is the left rod's end."""
    steel, bar = material("steel"), circle(0.02)
    l, tip = 0.35, np.array([0.0, 0.5, 0.0])
    angles = []
    for x, side in ((-0.2, 1.0), (0.2, -1.0)):
        way = tip - [x, 0, 0]
        far = np.linalg.norm(way)
        crank = np.arctan2(way[1], way[0]) + side * np.arccos(far / (2 * l))
        rod = np.arctan2(way[1], way[0]) - side * np.arccos(far / (2 * l))
        angles.append((crank, rod))
    legs = []
    for x, (crank, rod), name in zip((-0.2, 0.2), angles, ("left", "right"), strict=True):
        chain = [
            rs.revolute([0, 0, 1], rs.Actuated(3e4), home=[crank], name="motor"),
            rs.beam_link([l, 0, 0], steel, bar, name="crank"),
            rs.revolute([0, 0, 1], rs.Passive(), home=[rod - crank], name="elbow"),
            rs.beam_link([l, 0, 0], steel, bar, name="rod"),
        ]
        if name == "right":
            chain.append(
                rs.revolute([0, 0, 1], rs.Passive(), home=[angles[0][1] - rod], name="tip")
            )
        base = Frame(np.eye(3), np.array([x, 0, 0]))
        legs.append(rs.Leg(name, base, rs.Chain(tuple(chain)), Frame.identity()))
    home = Frame(Rotation.from_rotvec([0, 0, angles[0][1]]).as_matrix(), tip)
    xy = (Coordinate.X, Coordinate.Y)
    return rs.Robot("five-bar", tuple(legs), home, np.zeros(3), xy)
