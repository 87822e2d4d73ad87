"""From a tree and a side file to a linkage, and to a robot or a network."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.errors import InputError, Words, warn_of_slip
from robostiff.io.document import Document
from robostiff.io.expression import exact_mathematics
from robostiff.io.model_file.at_home import robot_at_home
from robostiff.io.model_file.links import WrittenBeam, WrittenLink
from robostiff.io.model_file.place import Place, top_place
from robostiff.io.model_file.robots import distinct_coordinates
from robostiff.io.model_file.symbols import Symbols, chosen_parameters, symbolic_values
from robostiff.io.rigid_tree.side_file import (
    DescribedTree,
    WrittenElasticLink,
    WrittenLinkBeam,
    WrittenSide,
    WrittenTool,
    check_known,
)
from robostiff.io.rigid_tree.tree import RigidTree, TreeLoop
from robostiff.io.suggest import listing
from robostiff.kinematics import place_chain
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
from robostiff.model import Chain, Coupling, Joint, JointKind, Link, Passive, Robot, spherical
from robostiff.model.chain import is_elastic
from robostiff.model.entries import free_symbols
from robostiff.network import Network
from robostiff.spatial import Frame

TOOL = "tool"
"""Name of the tool point among the ends of a link."""


Ends = list[tuple[str, np.ndarray, bool]]
"""What a link holds, that is joints, loops and the tool point.

Name, place in the frame of the link (3,) [m], and whether it leads to the base, the tool or a loop.
"""


def build_links(
    top: Place,
    written: Mapping[str, WrittenElasticLink],
    tree: RigidTree,
    ends_of: Callable[[str], Ends],
) -> dict[str, tuple[Connection, str]]:
    """For each elastic link its two bodies and what is between them, and what the far one holds.

    Both bodies have the frame of the link.
    """
    links = {}
    taken = {joint.name for joint in tree.joints} | {loop.name for loop in tree.loops}
    for name, entry in written.items():
        place = top / "links" / name
        check_known(place, name, "link", tree.links)
        ends = ends_of(name)
        leading = [(end, point) for end, point, leads_on in ends if leads_on]
        if entry.to is not None:
            places = {end: point for end, point, _ in ends}
            check_known(place / "to", entry.to, "end of the link", list(places))
            end, to = entry.to, places[entry.to]
        elif len(leading) == 1:
            end, to = leading[0]
        else:
            got = "no joint, loop or tool point beyond it that is connected to the platform"
            expected = "a link between the base and the tool"
            if leading:
                names = listing([end for end, _ in leading])
                got = f"{len(leading)} places to which it leads: {names}"
                expected = "to:, the name of one of them; what holds the others is its near end"
            subject = f"elastic link {name!r}"
            raise place.error(subject, got=Words(got), expected=expected, key=not leading)
        joint = tree.into.get(name)
        start = np.zeros(3) if joint is None else joint.after.inverse.p + 0.0
        to = to - start
        entries: dict[str, Any] = {**dict(entry), "to": to.tolist(), "name": name}
        if not isinstance(entry, WrittenLinkBeam):
            link = WrittenLink.model_construct(**entries).build(place, name)
        elif np.any(np.abs(to) > 1e-12):
            link = WrittenBeam.model_construct(**entries).build(place, name)
        else:
            got, expected = "a joint and a next one at the same point", "a link that has a length"
            hint = "write type: link with a stiffness for a short part"
            raise place.error(f"beam {name!r}", got=Words(got), expected=expected, hint=hint)
        described = tree.masses.get(name)
        if described is not None:  # in place of the mass of the elastic part
            link = replace(link, masses=(described.seen_from(_at(-start)),))
        label = f"link {name}" if name in taken else name
        connection = Connection(
            label, name, far_body(name), _at(start), link, _at(-start - np.asarray(link.to))
        )
        links[name] = connection, end
    return links


def far_body(link: str) -> str:
    """Name of the body at the far end of an elastic link."""
    return f"{link}, far end"


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
        links, frames = [], []
        for j, choice in enumerate(entry.between):
            at = place / "between" / j
            is_name = isinstance(choice, str)
            link, where = (choice, at) if is_name else (choice.link, at / "link")
            links.append(check_known(where, link, "link", tree.links))
            frames.append(Frame.identity() if is_name else choice.build(at))
        if links[0] == links[1]:
            raise (place / "between").error(
                "links of the loop", got=links[0], expected="two different links"
            )
        closing, here = entry.joint, place / "joint"
        if isinstance(closing, str):
            element = None if closing == "fixed" else spherical(Passive(), name=name)
        else:
            element = closing.build(here, name)
        loop = TreeLoop(name, (links[0], links[1]), (frames[0], frames[1]), element)
        twins = [other.name for other in tree.loops if set(other.links) == set(loop.links)]
        if twins:
            words = f"a loop between links that {twins[0]!r} of the description connects; both hold"
            warn_of_slip(f"{place.document.location(place.path)}: {words}")
        loops.append(loop)
    return loops


def drawn_links(tree: RigidTree, joints: Mapping[str, Joint | None]) -> dict[str, Frame]:
    """Frame of every link in the root's at the home coordinates, floating ones as drawn.

    Joints that are not among those given keep still.
    """
    frames = {tree.root: Frame.identity()}
    waiting = [tree.root]
    for link in waiting:  # which grows meanwhile
        for joint in tree.out_of.get(link, ()):
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
    if not isinstance(joint, Joint) or any(joint.home) or joint.kind is JointKind.UNIVERSAL:
        return loop
    ends = [frames[link] @ frame for link, frame in zip(loop.links, loop.frames, strict=True)]
    motion = ends[0].inverse @ ends[1]
    turn = Rotation.from_matrix(motion.R)
    x, y, z, w = turn.as_quat()
    home = [
        2.0 * np.arctan2(freedom.axis @ [x, y, z], w) if freedom.turns else freedom.axis @ motion.p
        for freedom in joint.freedoms
    ]
    if joint.kind is JointKind.SPHERICAL:
        home = turn.as_rotvec()
    return replace(loop, element=replace(joint, home=tuple(map(float, home))))


def _linkage(described: DescribedTree) -> Linkage:
    """The linkage that a tree and its side file describe."""
    top, written, tree = described.top, described.written, described.tree
    base = tree.root
    if written.base is not None:
        base = check_known(top / "base", written.base, "link", tree.links)
    tool, joints = _tool(top, written, tree), described.joints
    drawn = drawn_links(tree, joints)
    loops = [starting(loop, drawn) for loop in build_loops(top, written, tree)]
    top = written.stocked(top)
    tool_point = (top / "tool" / "at").point(tool.at)
    leading: set[str] = set()  # joints to the base, the tool and loops
    for link in {base, tool.link, *(link for loop in loops for link in loop.links)}:
        joint = tree.into.get(link)
        while joint is not None and joint.name not in leading:
            leading.add(joint.name)
            if joint.name in described.misfits:
                raise described.misfits[joint.name]
            joint = tree.into.get(joint.parent)

    def ends_of(link: str) -> Ends:
        moving = (edge for edge in tree.out_of.get(link, ()) if edge.name in joints)
        ends = [(edge.name, edge.drawn_at, edge.name in leading) for edge in moving]
        for loop in loops:
            pairs = zip(loop.links, loop.frames, strict=True)
            ends += [(loop.name, frame.p, True) for loop_link, frame in pairs if loop_link == link]
        at_tool = [(TOOL, tool_point, bool(np.any(tool_point)))] if link == tool.link else []
        return ends + at_tool

    elastic = build_links(top, written.links, tree, ends_of)

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
    with_home = {name for name in written.home if isinstance(joints.get(name), Joint)}
    tool_body = body(tool.link, TOOL)
    platform = tool_body if written.platform in (None, tool.link) else written.platform
    with top.complaints():
        linkage = Linkage(
            name=written.name or tree.name,
            connections=tuple(connections),
            base=base,
            platform=platform,
            reference_point=tool_point,
            held=frozenset(with_home),
            title=written.title,
            source=written.source,
            masses={link: (mass,) for link, mass in tree.masses.items() if link not in elastic},
        )
        places = welded_places(linkage)
    (whole, platform_place), (other, tool_place) = places[platform], places[tool_body]
    if whole != other:
        got = Words("a link that moves against the platform")
        expected = f"one that is fixed to {written.platform!r}"
        raise (top / "tool").error(f"tool on the link {tool.link!r}", got=got, expected=expected)
    tool_frame = platform_place.inverse @ tool_place
    return replace(linkage, reference_point=tool_frame.p + tool_frame.R @ tool_point + 0.0)


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
    _, linkage, couplings = _linkages(described)
    joints = {joint.name for joint in linkage.joints}
    closure = close(linkage)
    if not closure.is_closed:
        raise (top / "home").error(
            "loops",
            got=Words(closure.complaint),
            expected="loops that close in the home configuration",
            hint=f"{closure.advice}; home has values that joints keep, start those from which they "
            "follow",
        )
    with (top / "joints").complaints(hint=_hint(linkage)):
        robot = robot_of(linkage, closure, couplings)
    if robot is None:
        _refuse_followers(described.undecided & joints, top)
        return network_of(linkage, closure)
    if written.coordinates is not None:
        coordinates = distinct_coordinates(top / "coordinates", written.coordinates)
        if robot.is_serial:
            raise (top / "coordinates").error(
                "coordinates of a serial arm", expected="none: its joints pose it", key=True
            )
        robot = replace(robot, coordinates=coordinates)
    return robot_at_home(
        robot, top, [top] * len(robot.legs), chosen=written.coordinates is not None
    )


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
    linkage, part, _ = _linkages(described)
    _refuse_followers(described.undecided & {joint.name for joint in part.joints}, top)
    names = chosen_parameters(symbols, written.parameters, parameters or {})
    if not names:
        return linkage
    quantities, nominal = symbolic_values(names, top.names)
    overrides = {**(parameters or {}), **quantities}
    exact = top_place(side, written.parameters, overrides, exact_mathematics())
    what = f"symbols of linkage {linkage.name!r}"
    expected = "parameters of stiffnesses, elastic parts and masses alone"
    hint = "give values to parameters of dimensions: load_linkage(path, {NAME: ...})"
    refusal = InputError(what, got=tuple(nominal), expected=expected, hint=hint)
    try:
        symbolic = _linkage(DescribedTree(exact, written, described.tree))
    except (InputError, TypeError):  # a dimension that is computed with a symbol is no number
        raise refusal from None
    dimensions: list[Any] = [symbolic.reference_point]
    connections = []
    for connection, other in zip(linkage.connections, symbolic.connections, strict=True):
        element, twin = connection.element, other.element
        dimensions += [other.before, other.after, *(getattr(twin, k, None) for k in ("to", "home"))]
        if isinstance(element, Joint) and isinstance(twin, Joint):
            k = getattr(twin.role, "stiffness", None)
            if free_symbols(k):
                element = replace(element, role=replace(element.role, stiffness=k))
        elif isinstance(element, Link) and free_symbols(twin):
            twin = cast("Link", twin)
            element = replace(element, elasticity=twin.elasticity, masses=twin.masses)
        connections.append(replace(connection, element=element))
    if free_symbols(tuple(dimensions)):
        raise refusal
    return replace(linkage, connections=tuple(connections), nominal=nominal)


def _linkages(described: DescribedTree) -> tuple[Linkage, Linkage, tuple[Coupling, ...]]:
    """The linkage, its part between base and platform, and the couplings of joints there."""
    linkage, top = _linkage(described), described.top
    with (top / "tool").complaints():
        part = essential(linkage)
    joints = {joint.name for joint in part.joints}
    described.warn_of_stiffnesses(joints)
    couplings, roles = described.couplings(joints)
    part = with_roles(part, roles)
    if not any(is_elastic(c.element) for c in part.connections):
        what, got = f"robot {part.name!r}", Words("no compliance at all")
        expected = "the stiffness of at least one joint or link"
        raise (top / "joints").error(what, got=got, expected=expected, hint=_hint(part))
    return with_roles(linkage, roles), part, couplings


def _refuse_followers(following: frozenset[str], top: Place) -> None:
    """Raise where joints in loops that several legs share follow others."""
    if following:
        name = min(following)
        got = Words("a joint that follows another one, in a robot whose legs are connected")
        expected = "its role, as if it were a joint of its own"
        hint = f"write {name}: {{role: locked}}, or {{stiffness: ...}} of what makes it follow"
        raise (top / "joints").error(f"joint {name!r}", got=got, expected=expected, hint=hint)


def _hint(part: Linkage) -> str:
    names = [joint.name for joint in part.joints]
    if not names:
        return "write links: {NAME: {type: beam, material: steel, section: ...}}"
    return (
        f"write joints: {{{names[0]}: {{stiffness: 1e4 N m/rad}}}} or the like; its joints are "
        f"{listing(names, 12)}"
    )
