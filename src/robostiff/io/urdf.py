"""URDF, robot descriptions of ROS; and xacro, expanded by xacrodoc.

Beside its tree a URDF may have loops and springs. Loops are joints of Gazebo, ``<gazebo><joint>``
as in SDF; ``<loop_joint>``, as Drake had it; and ``<constraint>`` with an origin in each link.
Springs are ``springStiffness`` of Gazebo, and ``spring_stiffness`` among the dynamics of a joint,
as SDF has it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from robostiff.errors import Location, Words, needs_extra, warn_of_slip
from robostiff.io.bounded_file import read_elsewhere
from robostiff.io.child_process import EXPAND_XACRO, answer_of
from robostiff.io.rigid_tree.build import drawn_links
from robostiff.io.rigid_tree.tree import (
    LARGEST_IN_XML,
    JointType,
    Mimic,
    RigidTree,
    TreeJoint,
    TreeLoop,
    XmlElement,
    XmlLimits,
    frame_of,
    mass_of_body,
    question_place,
    read_xml,
    warn_of_parts_not_read,
)
from robostiff.io.suggest import did_you_mean, listing
from robostiff.io.units import Dimension, question
from robostiff.model import Actuated, Joint, Mass, Passive, prismatic, revolute, spherical
from robostiff.spatial import Frame

_TYPES = {kind.value: kind for kind in JointType if kind is not JointType.SPHERICAL}
_TYPES["continuous"] = JointType.REVOLUTE


def _names(elements: list[XmlElement], what: str) -> dict[str, XmlElement]:
    names: dict[str, XmlElement] = {}
    for element in elements:
        name = element.attributes.get("name", "")
        if not name:
            raise element.error(what, got=Words("no name"), expected='name="..."')
        if name in names:
            raise element.error(f"name of a {what}", got=name, expected="each name once")
        names[name] = element
    return names


def read_urdf(source: Path | str, content: bytes | None = None) -> RigidTree:
    """Read a URDF.

    Meshes and collision shapes are not looked at, and no other file is opened. Loops and springs
    are read where simulators have them.

    Parameters
    ----------
    source : path or str
        The file.
    content : bytes, optional
        Its text, where it has been read already; then the file is for messages only.

    Raises
    ------
    FileError
        When it cannot be read or is no URDF that makes sense.
    """
    root = read_xml(source, content=content)
    if root.tag != "robot":
        raise root.error("URDF", got=Words(f"<{root.tag}>"), expected="<robot> at the top")
    links = _names(root.all("link"), "link")
    if not links:
        raise root.error("URDF", got=Words("no link"), expected="at least one")
    # At the joint: that of a transmission of one joint, as Drake or others have it, times the
    # square of its reduction; or the armature among the dynamics of a joint, as it is.
    rotors, known = dict[str, float](), _names(root.all("joint"), "joint")
    for transmission in root.all("transmission"):
        joints = transmission.all("joint")
        parts = [part for tag in ("actuator", "joint") for part in transmission.all(tag)]
        ratio = _of_drive(parts, "drake:gear_ratio", "mechanicalReduction", 1.0)
        inertia = _of_drive(parts, "drake:rotor_inertia", "rotorInertia", 0.0)
        if len(joints) == 1 and inertia:
            rotors[joints[0].attributes.get("name", "")] = inertia * ratio**2
    for element in root.all("joint"):
        if armature := _attribute_or_text(element, "armature", "armature"):
            rotors[element.attributes["name"]] = armature
    stray = [(joint, root.location) for joint in rotors if joint not in known]
    warn_of_parts_not_read({"rotors of no joint,": stray})
    for joint, inertia in rotors.items():
        if inertia < 0:
            raise root.error(f"rotor of joint {joint!r}", got=inertia, expected="an inertia, or 0")
    tree = RigidTree(
        name=root.attributes.get("name") or Path(source).stem,
        file=str(source),
        links=tuple(links),
        joints=tuple(
            replace(_joint(element, links), inertia=rotors.get(joint, 0.0))
            for joint, element in known.items()
        ),
        masses={key: mass for key, link in links.items() if (mass := _mass(link)) is not None},
    )
    return _with_extensions(tree, root)


def _joint(joint: XmlElement, links: dict[str, XmlElement]) -> TreeJoint:
    name, word = joint.attributes["name"], joint.attributes.get("type")
    if word not in _TYPES:
        expected = f"one of {', '.join(_TYPES)}"
        hint = did_you_mean(word, _TYPES) if word else None
        raise joint.error(f"type of joint {name!r}", got=word, expected=expected, hint=hint)
    kind, of = _TYPES[word], f"of joint {name!r}"
    ends = []
    for tag in ("parent", "child"):
        element = joint.one(tag)
        link = None if element is None else element.attributes.get("link")
        if link not in links:
            expected = f'<{tag} link="..."/> with one of the links {listing(list(links), 30)}'
            got, hint = link or Words("none"), did_you_mean(link, links) if link else None
            raise (element or joint).error(f"{tag} {of}", got=got, expected=expected, hint=hint)
        ends.append(link)
    before = joint.frame_at("origin", of)
    axis = joint.numbers_at("axis", "xyz", (1.0, 0.0, 0.0), of)
    if kind in (JointType.REVOLUTE, JointType.PRISMATIC, JointType.PLANAR) and not np.any(axis):
        raise joint.error(f"axis of joint {name!r}", got=axis, expected="a direction, not zero")
    low, high = (joint.numbers_at("limit", x, (0.0,), of, 1e30).item() for x in ("lower", "upper"))
    if low > high and word != "continuous":
        warn_of_slip(f"{joint.location}: limits {of}, from {low:g} to {high:g}: not read")
    # some programs write such as 1e16 for none
    are_limits = low < high and min(-low, high) <= LARGEST_IN_XML and word != "continuous"
    limits = (low, high) if are_limits else None
    follows = None
    if (mimic := joint.one("mimic")) is not None:
        factor = joint.numbers_at("mimic", "multiplier", (1.0,), of).item()
        offset = joint.numbers_at("mimic", "offset", (0.0,), of).item()
        follows = Mimic(mimic.attributes.get("joint", ""), factor, offset)
    place = (joint.one("origin") or joint).location
    turn = joint.numbers_at("origin", "rpy", (0.0, 0.0, 0.0), of)
    question_place(before.p, place)
    question(max(turn.tolist(), key=abs), Dimension.ANGLE, lambda _: place, in_si=True)
    return TreeJoint(
        name=name,
        type=kind,
        parent=ends[0],
        child=ends[1],
        before=before,
        axis=axis,
        role=Passive() if kind is JointType.PLANAR else Actuated(limits=limits),
        mimic=follows,
    )


def _mass(link: XmlElement) -> Mass | None:
    """Mass, centre and moments of inertia of a link in its frame; None where it has none."""
    name, inertial = link.attributes["name"], link.one("inertial")
    if inertial is None:
        return None
    of = f"in the inertial of link {name!r}"
    centre = inertial.frame_at("origin", of)
    value = inertial.numbers_at("mass", "value", (0.0,), of).item()
    xx, xy, xz, yy, yz, zz = (
        inertial.numbers_at("inertia", key, (0.0,), of).item()
        for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    if value < 0:
        raise inertial.error(f"mass {of}", got=value, expected="zero or more [kg]")
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    about_centre = centre.R @ inertia @ centre.R.T
    return mass_of_body(name, value, centre.p, about_centre, inertial.location)


def expand_xacro(source: Path | str) -> bytes:
    """The URDF that a xacro file expands to.

    Xacro computes Python expressions and includes other files. It does so in a process of its own,
    which may read files, but neither write them nor start programs nor open connections. That is a
    fence and no wall: expand no file that you would not run.

    Parameters
    ----------
    source : path or str

    Raises
    ------
    FileError
        When the file, or one that it includes, cannot be read or expanded, or takes too long.
    InputError
        When xacrodoc is not installed.
    """
    file = str(source)
    read_xml(source)
    with needs_extra("xacro files", "urdf"):
        for package in ("xacrodoc", "xacro"):
            if find_spec(package) is None:  # another process imports it
                raise ModuleNotFoundError(name=package)
    request = {"file": file, "limits": vars(XmlLimits())}
    answer = answer_of(EXPAND_XACRO, request, Location(file), "xacro", "xacro")
    read_elsewhere(answer["files"])
    return answer["text"].encode()


_HARMLESS = frozenset(
    (
        *("link", "joint", "material", "gazebo", "transmission", "ros2_control", "sensor"),
        *("loop_joint", "constraint", "mujoco", "plugin", "version", "verbose"),
        *("drake:collision_filter_group", "collision_checking"),
        *("xacro:property", "xacro:arg", "xacro:macro"),  # what an expansion may leave
    )
)

_READ = {  # of joints and inertials, with their attributes
    "origin": "xyz rpy quat_xyzw",
    "axis": "xyz",
    "mimic": "joint multiplier offset",
    "mass": "value",
    "inertia": "ixx ixy ixz iyy iyz izz",
    "limit": "lower upper effort velocity acceleration deceleration jerk current command_effort "
    "gear_velocity drake:acceleration drake:jerk",
    "dynamics": "damping friction spring_stiffness spring_reference armature mu_coulomb "
    "mu_viscous D",
}
_NO = ("false", "no", "0")
_OF_ANY = "parent child armature springStiffness springReference calibration safety_controller"

_Unread = defaultdict[str, list[tuple[str, Location]]]  # for each kind, names and places
_TURNING, _BALL = ("revolute", "continuous", "hinge"), ("ball", "spherical")


def _with_extensions(tree: RigidTree, root: XmlElement) -> RigidTree:
    """The tree with the loops and springs of its file; warns of what is not read.

    Raises FileError where their numbers are none.
    """
    unread = _Unread(list)
    drawn = drawn_links(tree, {})
    loops = []
    models = [gazebo for gazebo in root.all("gazebo") if "reference" not in gazebo.attributes]
    of_gazebo = [joint for gazebo in models for joint in gazebo.all("joint")]
    for element in (*of_gazebo, *root.all("loop_joint"), *root.all("constraint")):
        loop = _loop(element, drawn)
        if loop is None:
            unread["loops"].append(element.place)
        else:
            taken = {joint.name for joint in tree.joints} | {other.name for other in loops}
            name = loop.name
            while name in taken:
                name = f"loop {name}"
            loops.append(replace(loop, name=name))
    springs = _springs(root, unread)
    _name_parts_not_read(root, unread)
    for element in root.children:
        if element.tag not in _HARMLESS:
            words = " (expanded in a file that is called .xacro)"
            words *= element.tag.startswith("xacro:")
            unread[f"<{element.tag}>{words}"].append(element.place)
        elif element.tag == "transmission" and len(element.all("joint")) > 1:
            unread["transmissions that connect several joints"].append(element.place)
        elif element.tag == "gazebo":
            for child in element.children:
                off = _value(child).lower() in _NO
                if (child.tag, off) in (("turnGravityOff", False), ("gravity", True)):
                    place = element.place[0], child.location
                    unread["switches of weights (turnGravityOff, gravity) of"].append(place)
                elif "reference" in element.attributes:
                    continue
                elif child.tag == "link" or child.tag.startswith("joint:"):
                    unread[f"<{child.tag}> of Gazebo"].append(child.place)
    warn_of_parts_not_read(unread)
    joints = tuple(replace(edge, spring=springs.get(edge.name, 0.0)) for edge in tree.joints)
    return replace(tree, joints=joints, loops=tuple(loops))


def _name_parts_not_read(root: XmlElement, unread: _Unread) -> None:
    """Add what stands in joints, links and inertials under other names, or a second time."""
    inertials = [(link, own) for link in root.all("link") for own in link.all("inertial")]
    for link in root.all("link"):
        for part in link.children:
            again = part.tag == "inertial"
            if part is not link.one("inertial") and (part.tag == "mass" or part.all("mass")):
                unread[f"{'a second ' * again}<{part.tag}> of"].append(link.place)
    for named, element in (*((own, own) for own in root.all("joint")), *inertials):
        passed: set[str] = set()
        for part in element.children:
            known, again = _READ.get(part.tag, "").split(), part.tag in passed
            inner = () if part.tag == "dynamics" else known  # which SDF writes as elements
            found = [key for key in part.attributes if key not in known]
            found += [f"<{k.tag}>" for k in part.children if inner or k.tag not in known]
            kinds = [f"{key} in <{part.tag}>" for key in found + ["text"] * bool(part.text.strip())]
            kinds *= part.tag in _READ
            if again or part.tag not in {*_READ, *_OF_ANY.split()}:
                kinds = [f"{'a second ' * again}<{part.tag}>"]
            passed.add(part.tag)
            for kind in kinds:
                unread[f"{kind} of"].append(named.place)
    followers: dict[str, Location] = {}  # of ros2_control, and of plugins of Gazebo
    for part in (part for own in root.children for part in own.children):
        if any(own.attributes.get("name") == "mimic" for own in part.all("param")):
            followers[part.attributes.get("name", "")] = part.location
        followers[_text(part, "mimicJoint")] = part.location
    for joint in root.all("joint"):
        if joint.attributes["name"] in followers and joint.one("mimic") is None:
            place = joint.attributes["name"], followers[joint.attributes["name"]]
            unread["joints that follow others by ros2_control or a plugin,"].append(place)


def _of_drive(parts: Sequence[XmlElement], of_drake: str, tag: str, otherwise: float) -> float:
    """A number of a drive, as the value of an element or as its text."""
    for part in parts:
        for child in (*part.all(of_drake), *part.all(tag)):
            text = child.attributes.get("value") if child.tag == of_drake else child.text
            return float(part.numbers(f"{tag} of <{part.tag}>", text, (otherwise,))[0])
    return otherwise


def _springs(root: XmlElement, unread: _Unread) -> dict[str, float]:
    """Stiffness of the spring of each joint that has one [N m/rad or N/m]."""
    springs: dict[str, float] = {}
    kinds = {joint.attributes["name"]: joint.attributes["type"] for joint in root.all("joint")}
    for element in (*root.all("joint"), *root.all("gazebo")):
        name = element.attributes.get("name" if element.tag == "joint" else "reference", "")
        k = _spring(element)
        if not k:
            continue
        if name not in kinds:
            unread["springs of no joint,"].append(element.place)
        elif _TYPES[kinds[name]] not in (JointType.REVOLUTE, JointType.PRISMATIC):
            unread[f"springs of {kinds[name]} joints"].append(element.place)
        elif springs.setdefault(name, k) != k:
            unread["a second spring of"].append(element.place)
        elif _attribute_or_text(element, "spring_reference", "springReference"):
            unread["the load at home of springs with a reference,"].append(element.place)
    return springs


def _spring(element: XmlElement) -> float:
    """The stiffness written in an element, or among its dynamics; 0 for none."""
    k = _attribute_or_text(element, "spring_stiffness", "springStiffness")
    if k < 0:
        raise element.error(f"spring in <{element.tag}>", got=k, expected="a stiffness, or 0")
    return k


def _attribute_or_text(element: XmlElement, key: str, of_gazebo: str) -> float:
    """A number among the dynamics, as an attribute or an element, or in an element of Gazebo."""
    dynamics = element.one("dynamics")
    texts: list[str | None] = [_value(child) for child in element.all(of_gazebo)]
    if dynamics is not None:
        texts += [dynamics.attributes.get(key), *(child.text for child in dynamics.all(key))]
    text = next((text for text in texts if text), None)
    return float(element.numbers(f"{key} of <{element.tag}>", text, (0.0,))[0])


def _loop(element: XmlElement, drawn: Mapping[str, Frame]) -> TreeLoop | None:
    """The loop that an element closes; None where its joint or its links are of another kind."""
    if element.tag == "joint":
        joint_ends = _ends_of_gazebo(element, drawn)
        if joint_ends is None:
            return None
        links, frames, axis = joint_ends
    else:  # both links, the frame of the joint in each, and its axis; zero where they differ
        ends, axes, of = ("link1", "link2"), ("axis", "axis"), f"of <{element.tag}>"
        origins = ends
        if element.tag == "constraint":
            ends, origins = ("parent", "child"), ("parent_origin", "child_origin")
            axes = "parent_axis" if element.one("parent_axis") else "axis", "child_axis"
        bodies = (element.one(tag) for tag in ends)
        first, second = ("" if body is None else body.attributes.get("link", "") for body in bodies)
        start, end = (element.frame_at(tag, of) for tag in origins)
        axis = element.numbers_at(axes[0], "xyz", (1.0, 0.0, 0.0), of)
        same = np.allclose(axis, element.numbers_at(axes[1], "xyz", axis, of), rtol=0, atol=1e-12)
        links, frames, axis = (first, second), (start, end), axis * same
    name, kind = element.attributes.get("name") or element.tag, element.attributes.get("type")
    if not set(links) <= set(drawn) or links[0] == links[1]:
        return None
    if kind == "fixed":
        return TreeLoop(name, links, frames, None)
    if kind in _BALL:
        return TreeLoop(name, links, frames, spherical(Passive(), name=name))
    if (kind != "prismatic" and kind not in _TURNING) or not np.any(axis):
        return None
    make = prismatic if kind == "prismatic" else revolute
    spring = _spring(element.one("axis") or element)
    joint: Joint = make(axis, Actuated(spring) if spring else Passive(), name=name)
    return TreeLoop(name, links, frames, joint)


def _ends_of_gazebo(
    element: XmlElement, drawn: Mapping[str, Frame]
) -> tuple[tuple[str, str], tuple[Frame, Frame], np.ndarray] | None:
    """Parent and child, the frame of the joint in each, and its axis there.

    The joint stands in the frame of its child, and the links stand as they do at zero coordinates.
    """
    links = _text(element, "parent"), _text(element, "child")
    pose, axis = element.one("pose"), element.one("axis")
    direction = None if axis is None else axis.one("xyz")
    attributes = [part.attributes for part in (pose, direction) if part is not None]
    in_model = axis is not None and _text(axis, "use_parent_model_frame") in ("true", "1")
    if not set(links) <= set(drawn) or any(attributes) or in_model:
        return None
    numbers = element.numbers("pose of <joint>", pose and pose.text, (0.0,) * 6)
    in_child = frame_of(numbers[:3], numbers[3:])
    in_parent = drawn[links[0]].inverse @ drawn[links[1]] @ in_child
    text = direction and direction.text
    return links, (in_parent, in_child), element.numbers("axis of <joint>", text, (0.0, 0.0, 1.0))


def _text(element: XmlElement, tag: str) -> str:
    child = element.one(tag)
    return "" if child is None else _value(child)


def _value(element: XmlElement) -> str:
    """What an element of Gazebo says, as its text or as its value."""
    return element.attributes.get("value", element.text).strip()
