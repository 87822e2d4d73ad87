"""Loops of a tree, closed by joints where the description draws its links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.io.model_file.build_joint import build_joint
from robostiff.io.model_file.build_link import build_spring
from robostiff.io.model_file.geometry import transform
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_elements import WrittenSpring
from robostiff.io.rigid_tree.tree import JointType, RigidTree
from robostiff.io.rigid_tree.written_side import (
    LinkFrameChoice,
    WrittenLoop,
    WrittenSide,
    check_known,
)
from robostiff.kinematics import place_chain
from robostiff.model import Chain, Joint, JointKind, Link, Passive, spherical
from robostiff.spatial import Frame


@dataclass(frozen=True)
class BuiltLoop:
    """Frames on two links that coincide up to the motion of the element between them."""

    name: str
    links: tuple[str, str]
    frames: tuple[Frame, Frame]  # one in the frame of each link
    element: Joint | Link | None  # a joint, a spring, or nothing: then they are welded


def build_loops(top: Place, written: WrittenSide, tree: RigidTree) -> list[BuiltLoop]:
    """The loops of the tree, then those of the side file."""
    loops = [
        BuiltLoop(
            loop.name,
            loop.links,
            loop.frames,
            spherical(Passive(), name=loop.name) if loop.type is JointType.SPHERICAL else None,
        )
        for loop in tree.loops
    ]
    taken = {joint.name for joint in tree.joints} | {loop.name for loop in loops}
    for i, entry in enumerate(written.loops):
        place = top / "loops" / i
        name = entry.name or f"loop{i + 1}"
        if name in taken:
            raise (place / "name").error(
                "name of the loop", got=name, expected="a name no joint or loop has"
            )
        taken.add(name)
        loops.append(_loop(place, entry, name, tree))
    return loops


def _loop(place: Place, entry: WrittenLoop, name: str, tree: RigidTree) -> BuiltLoop:
    (link_a, frame_a), (link_b, frame_b) = (
        _frame(place / "between" / i, choice, tree) for i, choice in enumerate(entry.between)
    )
    if link_a == link_b:
        raise (place / "between").error(
            "links of the loop", got=link_a, expected="two different links"
        )
    written, here = entry.joint, place / "joint"
    if isinstance(written, str):
        element = None if written == "fixed" else spherical(Passive(), name=name)
    elif isinstance(written, WrittenSpring):
        element = build_spring(here, written, name)
    else:
        element = build_joint(here, written, name)
    return BuiltLoop(name, (link_a, link_b), (frame_a, frame_b), element)


def _frame(place: Place, choice: LinkFrameChoice, tree: RigidTree) -> tuple[str, Frame]:
    if isinstance(choice, str):
        return check_known(place, choice, "link", tree.links), Frame.identity()
    check_known(place / "link", choice.link, "link", tree.links)
    return choice.link, transform(place, choice)


def drawn_links(tree: RigidTree, joints: Mapping[str, Joint | None]) -> dict[str, Frame]:
    """Frame of every link in the root's at the home coordinates, floating ones as drawn.

    Joints that are not among those given keep still.
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


def starting(loop: BuiltLoop, frames: Mapping[str, Frame]) -> BuiltLoop:
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
    for screw in joint.freedoms:
        if screw.turns:
            coordinates.append(float(2.0 * np.arctan2(screw.axis @ [x, y, z], w)))
        else:
            coordinates.append(float(screw.axis @ motion.p))
    return tuple(coordinates)
