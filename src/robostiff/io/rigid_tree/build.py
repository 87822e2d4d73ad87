"""From a tree and a side file to a linkage."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace

import numpy as np

from robostiff.io.model_file.geometry import point
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.stock import Stock
from robostiff.io.rigid_tree.build_joints import build_joints
from robostiff.io.rigid_tree.build_links import TOOL, LinkEnd, build_links, far_body
from robostiff.io.rigid_tree.build_loops import BuiltLoop, build_loops, drawn_links, starting
from robostiff.io.rigid_tree.choices import check_known
from robostiff.io.rigid_tree.tree import RigidTree
from robostiff.io.rigid_tree.written_side import WrittenSide, WrittenTool
from robostiff.io.suggest import Words, listing
from robostiff.linkage import Connection, Linkage, welded_places
from robostiff.model import Joint


def build_linkage(top: Place, written: WrittenSide, tree: RigidTree) -> Linkage:
    """The linkage that a tree and its side file describe.

    Raises
    ------
    FileError
        At the place in the side file that is to blame.
    """
    base = tree.root
    if written.base is not None:
        base = check_known(top / "base", written.base, "link", tree.links)
    tool = _tool(top, written, tree)
    joints = build_joints(top, written, tree)
    drawn = drawn_links(tree, joints)
    loops = [starting(loop, drawn) for loop in build_loops(top, written, tree)]
    stock = Stock.of_file(top, written.materials, written.sections)
    tool_point = point(top / "tool" / "at", tool.at)
    ends = _ends(tree, loops, tool, tool_point, base, joints)
    elastic = build_links(top, written.links, tree, ends, stock)

    def body(link: str, end: str) -> str:
        """The part of a link that holds something."""
        return far_body(link) if link in elastic and elastic[link].end == end else link

    connections = [link.connection for link in elastic.values()]
    for joint in tree.joints:
        if joint.name in joints:
            parent = body(joint.parent, joint.name)
            element = joints[joint.name]
            connections.append(
                Connection(joint.name, parent, joint.child, joint.before, element, joint.after)
            )
    for loop in loops:
        a, b = (body(link, loop.name) for link in loop.links)
        before, after = loop.frames[0], loop.frames[1].inverse
        connections.append(Connection(loop.name, a, b, before, loop.element, after))
    held = {name for name in written.home if isinstance(joints.get(name), Joint)}
    tool_body = body(tool.link, TOOL)
    platform = tool_body if written.platform in (None, tool.link) else written.platform
    with top.complaints():
        linkage = Linkage(
            name=written.name or tree.name,
            connections=tuple(connections),
            base=base,
            platform=platform,
            reference_point=tool_point,
            held=frozenset(held),
            title=written.title,
            source=written.source,
        )
        places = welded_places(linkage)
    (whole, platform_place), (other, tool_place) = places[platform], places[tool_body]
    if whole != other:
        raise (top / "tool").error(
            f"tool on the link {tool.link!r}",
            got=Words("a link that moves against the platform"),
            expected=f"one that is fixed to {written.platform!r}",
        )
    seen = platform_place.inverse @ tool_place
    return replace(linkage, reference_point=seen.p + seen.R @ tool_point + 0.0)


def _tool(top: Place, written: WrittenSide, tree: RigidTree) -> WrittenTool:
    if written.platform is not None:
        check_known(top / "platform", written.platform, "link", tree.links)
    match written.tool:
        case WrittenTool():
            check_known(top / "tool" / "link", written.tool.link, "link", tree.links)
            return written.tool
        case str():
            link = check_known(top / "tool", written.tool, "link", tree.links)
        case _ if written.platform is not None:
            link = written.platform
        case _ if len(tree.leaves) == 1:
            (link,) = tree.leaves
        case _:
            raise (top / "tool").error(
                "missing key",
                expected=f"tool: the link whose stiffness is computed, one of "
                f"{listing(list(tree.leaves), 30)}, or another one",
            )
    return WrittenTool(link=link)


def _ends(
    tree: RigidTree,
    loops: list[BuiltLoop],
    tool: WrittenTool,
    tool_point: np.ndarray,
    base: str,
    connecting: Container[str],
) -> dict[str, list[LinkEnd]]:
    """The joints, loops and tool point on each link."""
    leading: set[str] = set()
    for link in {base, tool.link, *(link for loop in loops for link in loop.links)}:
        joint = tree.joint_into(link)
        while joint is not None and joint.name not in leading:
            leading.add(joint.name)
            joint = tree.joint_into(joint.parent)
    ends: dict[str, list[LinkEnd]] = {link: [] for link in tree.links}
    for joint in tree.joints:
        if joint.name in connecting:
            end = LinkEnd(joint.name, joint.drawn_at, joint.name in leading)
            ends[joint.parent].append(end)
    for loop in loops:
        for link, frame in zip(loop.links, loop.frames, strict=True):
            ends[link].append(LinkEnd(loop.name, frame.p, leads_on=True))
    ends[tool.link].append(LinkEnd(TOOL, tool_point, leads_on=bool(np.any(tool_point))))
    return ends
