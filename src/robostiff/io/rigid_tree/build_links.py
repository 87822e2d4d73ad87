"""Elastic links of a tree, and the joints that close its loops."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.errors import warn_of_slip
from robostiff.io.model_file.links import WrittenBeam, WrittenLink
from robostiff.io.model_file.place import Place
from robostiff.io.rigid_tree.tree import RigidTree, TreeLoop
from robostiff.io.rigid_tree.written_side import (
    LinkFrameChoice,
    WrittenElasticLink,
    WrittenLinkBeam,
    WrittenSide,
    check_known,
)
from robostiff.io.suggest import Words, listing
from robostiff.kinematics import place_chain
from robostiff.linkage import Connection
from robostiff.model import Chain, Joint, JointKind, Passive, spherical
from robostiff.spatial import Frame

TOOL = "tool"
"""Name of the tool point among the ends of a link."""


@dataclass(frozen=True)
class LinkEnd:
    """Something that a link holds: a joint, a loop closure or the tool point."""

    name: str
    point: np.ndarray  # (3,), where, in the frame of the link [m]
    leads_on: bool  # whether it leads to the base, the platform, the tool or a loop


def build_links(
    top: Place,
    written: Mapping[str, WrittenElasticLink],
    tree: RigidTree,
    ends: Mapping[str, list[LinkEnd]],
) -> dict[str, tuple[Connection, str]]:
    """For each elastic link its two bodies and what is between them, and what the far one holds.

    Both bodies have the frame of the link. `ends` has what each link of the tree holds.
    """
    links = {}
    taken = {joint.name for joint in tree.joints} | {loop.name for loop in tree.loops}
    for name, entry in written.items():
        place = top / "links" / name
        check_known(place, name, "link", tree.links)
        end = _far_end(place, name, entry, ends.get(name, []))
        joint = tree.joint_into(name)
        start = np.zeros(3) if joint is None else joint.after.inverse.p + 0.0
        to = end.point - start
        given: dict[str, Any] = {
            key: getattr(entry, key) for key in type(entry).model_fields if key != "to"
        }
        given |= {"to": to.tolist(), "name": name}
        if not isinstance(entry, WrittenLinkBeam):
            link = WrittenLink.model_construct(**given).build(place, name)
        elif np.any(np.abs(to) > 1e-12):
            link = WrittenBeam.model_construct(**given).build(place, name)
        else:
            raise place.error(
                f"beam {name!r}",
                got=Words("a joint and a next one at the same point"),
                expected="a link that has a length",
                hint="write type: link with a stiffness for a short part",
            )
        described = tree.masses.get(name)
        if described is not None:  # in place of the mass of the elastic part
            link = replace(link, masses=(described.seen_from(_at(-start)),))
        own = f"link {name}" if name in taken else name
        connection = Connection(
            own, name, far_body(name), _at(start), link, _at(-start - np.asarray(link.to))
        )
        links[name] = connection, end.name
    return links


def far_body(link: str) -> str:
    """Name of the body at the far end of an elastic link."""
    return f"{link}, far end"


def _far_end(place: Place, name: str, entry: WrittenElasticLink, ends: list[LinkEnd]) -> LinkEnd:
    by_name = {end.name: end for end in ends}
    if entry.to is not None:
        return by_name[check_known(place / "to", entry.to, "end of the link", list(by_name))]
    leading = [end for end in ends if end.leads_on]
    if len(leading) == 1:
        return leading[0]
    if not leading:
        raise place.error(
            f"elastic link {name!r}",
            got=Words("no joint, loop or tool point beyond it that is connected to the platform"),
            expected="a link between the base and the tool",
            key=True,
        )
    raise place.error(
        f"elastic link {name!r}",
        got=Words(f"{len(leading)} places to which it leads: {listing([e.name for e in leading])}"),
        expected="to:, the name of one of them; what holds the others is its near end",
    )


def _at(point: np.ndarray) -> Frame:
    return Frame(np.eye(3), point + 0.0)


def build_loops(top: Place, written: WrittenSide, tree: RigidTree) -> list[TreeLoop]:
    """The loops of the tree, then those of the side file."""
    loops = list(tree.loops)
    taken = {joint.name for joint in tree.joints} | {loop.name for loop in loops}
    for i, entry in enumerate(written.loops):
        place = top / "loops" / i
        name = entry.name or f"loop{i + 1}"
        if name in taken:
            raise (place / "name").error(
                "name of the loop", got=name, expected="a name no joint or loop has"
            )
        taken.add(name)
        (link_a, frame_a), (link_b, frame_b) = (
            _frame(place / "between" / j, choice, tree) for j, choice in enumerate(entry.between)
        )
        if link_a == link_b:
            raise (place / "between").error(
                "links of the loop", got=link_a, expected="two different links"
            )
        closing, here = entry.joint, place / "joint"
        if isinstance(closing, str):
            element = None if closing == "fixed" else spherical(Passive(), name=name)
        else:
            element = closing.build(here, name)
        loop = TreeLoop(name, (link_a, link_b), (frame_a, frame_b), element)
        described = [own.name for own in tree.loops if set(own.links) == set(loop.links)]
        if described:
            words = (
                f"a loop between links that {described[0]!r} of the description connects; both hold"
            )
            warn_of_slip(f"{place.document.location(place.path)}: {words}")
        loops.append(loop)
    return loops


def _frame(place: Place, choice: LinkFrameChoice, tree: RigidTree) -> tuple[str, Frame]:
    if isinstance(choice, str):
        return check_known(place, choice, "link", tree.links), Frame.identity()
    check_known(place / "link", choice.link, "link", tree.links)
    return choice.link, choice.build(place)


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


def starting(loop: TreeLoop, frames: Mapping[str, Frame]) -> TreeLoop:
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
