"""From a tree and a side file to a linkage, and to a robot or a network."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from robostiff.errors import FileError, InputError
from robostiff.io.document import Document, read_document
from robostiff.io.expression import exact_mathematics
from robostiff.io.model_file.at_home import verified
from robostiff.io.model_file.links import stocked
from robostiff.io.model_file.place import VERSION, Place, check_version, top_place
from robostiff.io.model_file.robots import distinct_coordinates
from robostiff.io.model_file.symbols import Symbols, chosen_parameters, symbolic_values
from robostiff.io.rigid_tree.build_joints import DescribedTree
from robostiff.io.rigid_tree.build_links import (
    TOOL,
    LinkEnd,
    build_links,
    build_loops,
    drawn_links,
    far_body,
    starting,
)
from robostiff.io.rigid_tree.tree import RigidTree, TreeLoop, with_symbols
from robostiff.io.rigid_tree.written_side import WrittenSide, WrittenTool, check_known
from robostiff.io.suggest import Words, listing
from robostiff.linkage import (
    Connection,
    Linkage,
    close,
    essential,
    robot_of,
    welded_places,
    with_roles,
)
from robostiff.linkage.essential import network_of
from robostiff.model import Joint, Robot
from robostiff.model.chain import is_elastic
from robostiff.network import Network


def _linkage(described: DescribedTree) -> Linkage:
    """The linkage that a tree and its side file describe."""
    top, written, tree = described.top, described.written, described.tree
    base = tree.root
    if written.base is not None:
        base = check_known(top / "base", written.base, "link", tree.links)
    tool, joints = _tool(top, written, tree), described.joints
    drawn = drawn_links(tree, joints)
    loops = [starting(loop, drawn) for loop in build_loops(top, written, tree)]
    top = stocked(top, written.materials, written.sections)
    tool_point = (top / "tool" / "at").point(tool.at)
    ends = _ends(tree, loops, tool, tool_point, base, joints)
    elastic = build_links(top, written.links, tree, ends)

    def body(link: str, end: str) -> str:
        """The part of a link that holds something."""
        return far_body(link) if link in elastic and elastic[link][1] == end else link

    connections = [connection for connection, _ in elastic.values()]
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
            masses={link: (own,) for link, own in tree.masses.items() if link not in elastic},
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
    loops: list[TreeLoop],
    tool: WrittenTool,
    tool_point: np.ndarray,
    base: str,
    connecting: Container[str],
) -> dict[str, list[LinkEnd]]:
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


def robot_of_tree(
    tree: RigidTree, side: Document, parameters: Mapping[str, str | float] | None = None
) -> Robot | Network:
    """The robot that a tree and a side file describe.

    A serial arm, or legs that share nothing but base and platform, become a `Robot`; anything else
    a `Network` at its home configuration.

    Parameters
    ----------
    tree : RigidTree
    side : Document
    parameters : mapping of str to (str or float), optional
        Other values for some of the side file's parameters.

    Raises
    ------
    FileError
        At the place in the side file or in the description that is to blame.
    """
    described = DescribedTree.of(tree, side, parameters)
    top, written = described.top, described.written
    _, linkage = _linkages(described)
    felt = {joint.name for joint in linkage.joints}
    described.warn_of_stiffnesses(felt)
    couplings, roles = described.couplings(felt)
    linkage = with_roles(linkage, roles)
    _check_is_elastic(linkage, top)
    found = close(linkage)
    if not found.is_closed:
        raise (top / "home").error(
            "loops",
            got=Words(found.complaint),
            expected="loops that close in the home configuration",
            hint=f"{found.advice}; home has values that joints keep, start those from which they "
            "follow",
        )
    with (top / "joints").complaints(hint=_hint(linkage)):
        robot = robot_of(linkage, found, couplings)
    if robot is None:
        _refuse_followers(described.undecided & felt, top)
        return network_of(linkage, found)
    chosen = written.coordinates is not None
    if written.coordinates is not None:
        coordinates = distinct_coordinates(top / "coordinates", written.coordinates)
        if robot.is_serial:
            raise (top / "coordinates").error(
                "coordinates of a serial arm", expected="none: its joints pose it", key=True
            )
        robot = replace(robot, coordinates=coordinates)
    return verified(robot, top, [top] * len(robot.legs), chosen=chosen)


def linkage_of_tree(
    tree: RigidTree,
    side: Document,
    parameters: Mapping[str, str | float] | None = None,
    symbols: Symbols = (),
) -> Linkage:
    """The linkage that a tree and a side file describe, for any configuration.

    Parameters that are `symbols` stay so in its stiffnesses; they are none of its dimensions.

    Raises
    ------
    FileError
        At the place in the side file or in the description that is to blame.
    """
    described = DescribedTree.of(tree, side, parameters)
    top, written = described.top, described.written
    linkage, part = _linkages(described)
    _check_is_elastic(part, top)
    felt = {joint.name for joint in part.joints}
    described.warn_of_stiffnesses(felt)
    _refuse_followers(described.undecided & felt, top)
    names = chosen_parameters(symbols, written.parameters, parameters or {})
    if not names:
        return linkage
    quantities, nominal = symbolic_values(names, top.names)
    overrides = {**(parameters or {}), **quantities}
    exact = top_place(side, written.parameters, overrides, exact_mathematics())
    symbolic = DescribedTree(exact, written, described.tree)
    return with_symbols(linkage, lambda: _linkage(symbolic), nominal)


def _linkages(described: DescribedTree) -> tuple[Linkage, Linkage]:
    """The whole linkage, and the part of it between base and platform."""
    linkage = _linkage(described)
    with (described.top / "tool").complaints():
        return linkage, essential(linkage)


def _check_is_elastic(part: Linkage, top: Place) -> None:
    if not any(is_elastic(c.element) for c in part.connections):
        raise (top / "joints").error(
            f"robot {part.name!r}",
            got=Words("no compliance at all"),
            expected="the stiffness of at least one joint or link",
            hint=_hint(part),
        )


def _refuse_followers(following: frozenset[str], top: Place) -> None:
    """Raise where joints in loops that several legs share follow others."""
    if following:
        name = min(following)
        raise (top / "joints").error(
            f"joint {name!r}",
            got=Words("a joint that follows another one, in a robot whose legs are connected"),
            expected="its role, as if it were a joint of its own",
            hint=f"write {name}: {{role: locked}}, or {{stiffness: ...}} of what makes it follow",
        )


def _hint(part: Linkage) -> str:
    names = [joint.name for joint in part.joints]
    if not names:
        return "write links: {NAME: {type: beam, material: steel, section: ...}}"
    return (
        f"write joints: {{{names[0]}: {{stiffness: 1e4 N m/rad}}}} or the like; its joints are "
        f"{listing(names, 12)}"
    )


_ENDINGS = (".xacro", ".urdf", ".xml", ".mjcf")
_EXAMPLE = (
    "write robostiff: 1, source: where the numbers come from, tool: the name of a link, joints: "
    '{"*": {stiffness: 1e4 N m/rad}}, or the like'
)


def read_side(description: Path | str, side: Path | str | None = None) -> Document:
    """The side file of a robot description.

    Parameters
    ----------
    description : path or str
    side : path or str, optional
        The side file; the one beside the description when left out: ``arm.stiffness.yaml`` beside
        ``arm.urdf.xacro``.

    Raises
    ------
    InputError
        When there is none; a `FileError` when it cannot be read or is no side file.
    """
    if side is None:
        name = Path(description).name
        for ending in _ENDINGS:
            name = name[: -len(ending)] if name.lower().endswith(ending) else name
        found = Path(description).with_name(f"{name}.stiffness.yaml")
        if not found.exists():
            raise InputError(
                f"stiffness of {str(description)!r}",
                got=Words("no side file"),
                expected=f"{found} beside it, or another file by side=, --side on the command line",
                hint=f"there {_EXAMPLE}",
            )
        side = found
    document = read_document(side)
    expected = f"robostiff: {VERSION} at the top"
    check_version(document, "side file", "version of the side file", expected, _EXAMPLE)
    if "legs" in document.data:
        raise FileError(
            document.key_location(("legs",)),
            "side file",
            got=Words("a model file with legs of its own"),
            expected="a side file of a robot description",
            hint=_EXAMPLE,
        )
    return document
