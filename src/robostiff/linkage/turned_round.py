"""A connection seen from its other end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robostiff.elasticity import moved
from robostiff.kinematics import place_chain
from robostiff.kinematics.turn import vector_of_turn
from robostiff.linkage.linkage import Connection
from robostiff.model import (
    Chain,
    Freedom,
    Joint,
    JointKind,
    Link,
    Motion,
    planar,
    universal,
)


def turned_round(connection: Connection) -> Connection:
    """The same connection from body b to body a; home coordinates give the same configuration.

    A joint keeps its coordinates where it has one, for its axis is reversed.
    """
    element = connection.element
    if isinstance(element, Joint):
        element = _joint(element)
    elif isinstance(element, Link):
        element = _link(element)
    return Connection(
        connection.name,
        connection.b,
        connection.a,
        connection.after.inverse,
        element,
        connection.before.inverse,
    )


def _joint(joint: Joint) -> Joint:
    home = np.array(joint.home, dtype=float)
    axes = [-freedom.axis for freedom in joint.freedoms]
    match joint.kind:
        case JointKind.SPHERICAL:
            return replace(joint, home=tuple((-home).tolist()))
        case JointKind.UNIVERSAL:
            last = home[::-1].tolist()
            return universal(axes[1], axes[0], joint.role, home=last, name=joint.name)
        case JointKind.PLANAR:
            return _planar(joint)
    freedoms = tuple(
        Freedom(freedom.motion, axis) for freedom, axis in zip(joint.freedoms, axes, strict=True)
    )
    return replace(joint, freedoms=freedoms)


def _planar(joint: Joint) -> Joint:
    placed = place_chain(Chain((joint,)), np.array(joint.home, dtype=float), np.eye(3), np.zeros(3))
    slides = [f.axis for f in joint.freedoms if f.motion is Motion.TRANSLATION]
    normal = joint.freedoms[-1].axis
    back = -(placed.R.T @ placed.p)
    turn = -(normal @ vector_of_turn(placed.R))
    home = [float(slide @ back) for slide in slides] + [float(turn)]
    return replace(planar(normal, joint.role, home=home, name=joint.name), freedoms=joint.freedoms)


def _link(link: Link) -> Link:
    # Energy decides: the wrench is the same at both ends, told about the other one.
    elasticity = moved(link.elasticity, link.axes, -np.asarray(link.to))
    return Link(-np.asarray(link.to), elasticity, np.eye(3), link.name)
