"""From a tree and a side file to a linkage."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from robostiff.io.document import Document
from robostiff.io.expression import ParameterError, Parameters
from robostiff.io.model_file.geometry import point
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.stock import Stock
from robostiff.io.rigid_tree.build_joints import build_joints, told_coordinates
from robostiff.io.rigid_tree.build_links import TOOL, LinkEnd, build_links, far_body
from robostiff.io.rigid_tree.build_loops import Loop, build_loops
from robostiff.io.rigid_tree.choices import check_known
from robostiff.io.rigid_tree.tree import JointType, RigidTree
from robostiff.io.rigid_tree.written_side import WrittenSide, WrittenTool
from robostiff.io.suggest import Words, listing
from robostiff.linkage import Connection, Linkage
from robostiff.model import Joint
from robostiff.spatial import Frame

if TYPE_CHECKING:
    from pint import Quantity
else:
    Quantity = object


def place_of(
    document: Document, written: WrittenSide, overrides: Mapping[str, str | float]
) -> Place:
    """The whole side file, with its parameters, some of which may be given other values."""
    try:
        return Place(document, Parameters(written.parameters, overrides).values)
    except ParameterError as error:
        if error.name in overrides:
            raise  # it is not the file that is wrong
        raise (Place(document, {}) / "parameters" / error.name).error(
            error.subject, got=error.got, expected=error.expected, hint=error.hint
        ) from None


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
    loops = build_loops(top, written, tree)
    stock = Stock.of_file(top, written.materials, written.sections)
    tool_point = point(top / "tool" / "at", tool.at)
    wanted = {base, tool.link, *(link for loop in loops for link in loop.links)}
    ends = _ends(tree, loops, tool.link, tool_point, wanted, joints)
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
    with top.complaints():
        linkage = Linkage(
            name=written.name or tree.name,
            connections=tuple(connections),
            base=base,
            platform=body(tool.link, TOOL),
            reference_point=tool_point,
            held=frozenset(held),
            title=written.title,
            source=written.source,
        )
    return linkage
