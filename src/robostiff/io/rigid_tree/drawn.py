"""Where a description draws its links, from which the joints that close loops start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.io.rigid_tree.build_loops import Loop
from robostiff.io.rigid_tree.tree import RigidTree
from robostiff.kinematics import place_chain
from robostiff.model import Chain, Joint, JointKind, Motion
from robostiff.spatial import Frame


def drawn_links(tree: RigidTree, joints: Mapping[str, Joint | None]) -> dict[str, Frame]:
    """Frame of every link in the root's at the home coordinates, floating ones as drawn.

    Parameters
    ----------
    tree : RigidTree
    joints : mapping of str to Joint or None
        Those that move; the others keep still.
    """
    frames = {tree.root: Frame.identity()}
    waiting = [tree.root]
    while waiting:
        link = waiting.pop()
        for joint in tree.joints_from(link):
            start = frames[link] @ joint.before
            moving = joints.get(joint.name)
            if moving is not None:
                home = np.array(moving.home, dtype=float)
                end = place_chain(Chain((moving,)), home, start.R, start.p)
                start = Frame(end.R, end.p)
            frames[joint.child] = start @ joint.after
            waiting.append(joint.child)
    return frames


def starting(loop: Loop, frames: Mapping[str, Frame]) -> Loop:
    """The loop with its joint as near as it comes to what is drawn, unless it says where it is."""
    joint = loop.element
    if not isinstance(joint, Joint) or any(joint.home):
        return loop
    ends = [frames[link] @ frame for link, frame in zip(loop.links, loop.frames, strict=True)]
    home = _nearest(joint, ends[0].inverse @ ends[1])
    return replace(loop, element=replace(joint, home=home))


def _nearest(joint: Joint, motion: Frame) -> tuple[float, ...]:
    """Coordinates of a joint whose motion comes near a given one."""
    turn = Rotation.from_matrix(motion.R)
    if joint.kind is JointKind.SPHERICAL:
        return tuple(turn.as_rotvec().tolist())
    if joint.kind is JointKind.UNIVERSAL:
        return joint.home
    x, y, z, w = turn.as_quat()
    coordinates = []
    for freedom in joint.freedoms:
        if freedom.motion is Motion.TRANSLATION:
            coordinates.append(float(freedom.axis @ motion.p))
        else:
            coordinates.append(float(2.0 * np.arctan2(freedom.axis @ [x, y, z], w)))
    return tuple(coordinates)
