"""URDF, robot descriptions of ROS, read by yourdfpy; and xacro, expanded by xacrodoc."""

from __future__ import annotations

import io
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from robostiff.errors import FileError, Location, needs_extra
from robostiff.io.child_process import EXPAND_XACRO, answer_of
from robostiff.io.plausibility import question
from robostiff.io.rigid_tree.tree import JointType, Mimic, RigidTree, TreeJoint
from robostiff.io.rigid_tree.xml_text import XmlElement, XmlLimits, read_xml
from robostiff.io.suggest import Words, did_you_mean, listing
from robostiff.io.units import Dimension
from robostiff.io.urdf_extensions import masses_of_links, rotor_inertias, with_extensions
from robostiff.model import Actuated, Passive
from robostiff.spatial import Frame

_TYPES = {
    "fixed": JointType.FIXED,
    "revolute": JointType.REVOLUTE,
    "continuous": JointType.REVOLUTE,
    "prismatic": JointType.PRISMATIC,
    "planar": JointType.PLANAR,
    "floating": JointType.FLOATING,
}
_NUMBERS = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": {"lower": 1, "upper": 1},
    "mimic": {"multiplier": 1, "offset": 1},
}

_LARGEST = 1e9  # metres and radians; far beyond any robot
_ASKED = {("origin", "xyz"): Dimension.LENGTH, ("origin", "rpy"): Dimension.ANGLE}


def check_structure(root: XmlElement) -> None:
    """Raise unless links and joints have their names, types, links and numbers."""
    if root.tag != "robot":
        raise root.error("URDF", got=Words(f"<{root.tag}>"), expected="<robot> at the top")
    _named(root, "robot")
    links = _names(root.all("link"), "link")
    if not links:
        raise root.error("URDF", got=Words("no link"), expected="at least one")
    joints = _names(root.all("joint"), "joint")
    for name, joint in joints.items():
        kind = joint.attributes.get("type")
        if kind not in _TYPES:
            raise joint.error(
                f"type of joint {name!r}",
                got=kind,
                expected=f"one of {', '.join(_TYPES)}",
                hint=did_you_mean(kind, _TYPES) if kind else None,
            )
        for tag in ("parent", "child"):
            _check_reference(joint, tag, links)
        for tag, sizes in _NUMBERS.items():
            element = joint.one(tag)
            if element is not None:
                _check_numbers(element, sizes, f"{tag} of joint {name!r}")


def kinematics_alone(root: XmlElement) -> bytes:
    """The same URDF with nothing but links and joints, and nothing in the links."""
    robot = ElementTree.Element("robot", name=root.attributes["name"])
    for link in root.all("link"):
        ElementTree.SubElement(robot, "link", name=link.attributes["name"])
    for joint in root.all("joint"):
        copy = ElementTree.SubElement(robot, "joint", joint.attributes)
        for tag in ("parent", "child", *_NUMBERS):
            element = joint.one(tag)
            if element is not None:
                # What is not used, such as an effort, must not stop the reader.
                read = {"link", "joint", *_NUMBERS.get(tag, ())}
                kept = {key: text for key, text in element.attributes.items() if key in read}
                ElementTree.SubElement(copy, tag, kept)
    return ElementTree.tostring(robot, encoding="utf-8")


def _named(element: XmlElement, what: str) -> str:
    name = element.attributes.get("name", "")
    if not name:
        raise element.error(what, got=Words("no name"), expected='name="..."')
    return name


def _names(elements: list[XmlElement], what: str) -> dict[str, XmlElement]:
    names: dict[str, XmlElement] = {}
    for element in elements:
        name = _named(element, what)
        if name in names:
            raise element.error(f"name of a {what}", got=name, expected="each name once")
        names[name] = element
    return names


def _check_reference(joint: XmlElement, tag: str, links: dict[str, XmlElement]) -> None:
    what = f"{tag} of joint {joint.attributes['name']!r}"
    element = joint.one(tag)
    name = None if element is None else element.attributes.get("link")
    if element is None or not name:
        raise (element or joint).error(
            what,
            got=Words("none" if element is None else "no link"),
            expected=f'<{tag} link="..."/>',
        )
    if name not in links:
        raise element.error(
            what,
            got=name,
            expected=f"one of the links {listing(list(links), 30)}",
            hint=did_you_mean(name, links),
        )


def _check_numbers(element: XmlElement, sizes: dict[str, int], what: str) -> None:
    for attribute, size in sizes.items():
        text = element.attributes.get(attribute)
        if text is None:
            continue
        try:
            numbers = [float(word) for word in text.split()]
        except ValueError:
            numbers = []
        if len(numbers) != size or not all(abs(n) <= _LARGEST for n in numbers):
            raise element.error(
                f"{attribute} in the {what}",
                got=text,
                expected=f"{size} finite number{'s' * (size > 1)} up to {_LARGEST:g}",
            )
        dimension = _ASKED.get((element.tag, attribute))
        if dimension is not None:
            worst = max(numbers, key=abs)
            question(worst, dimension, lambda _, place=element.location: place, in_si=True)


def read_urdf(source: Path | str, content: bytes | None = None) -> RigidTree:
    """Read a URDF.

    Meshes and collision shapes are not looked at, and no other file is opened. Loops and springs
    are read where simulators have them, see `urdf_extensions`.

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
    InputError
        When yourdfpy is not installed.
    """
    file = str(source)
    root = read_xml(source, content=content)
    check_structure(root)
    robot = _parsed(root)
    places = {joint.attributes["name"]: joint.location for joint in root.all("joint")}
    rotors = rotor_inertias(root)
    tree = RigidTree(
        name=robot.name,
        file=file,
        links=tuple(link.name for link in robot.links),
        joints=tuple(
            replace(_joint(own, places[own.name]), inertia=rotors.get(own.name, 0.0))
            for own in robot.joints
        ),
        masses=masses_of_links(root),
    )
    return with_extensions(tree, root)


def _parsed(root: XmlElement) -> Any:
    """The robot as yourdfpy reads it, from links and joints alone."""
    with needs_extra("URDF files", "urdf"):
        from yourdfpy import URDF
    text = io.BytesIO(kinematics_alone(root))
    return URDF.load(text, build_scene_graph=False, load_meshes=False).robot


def _joint(joint: Any, place: Location) -> TreeJoint:
    kind = _TYPES[joint.type]
    origin = np.eye(4) if joint.origin is None else np.asarray(joint.origin, dtype=float)
    axis = np.asarray(joint.axis, dtype=float)
    moves = kind in (JointType.REVOLUTE, JointType.PRISMATIC, JointType.PLANAR)
    if moves and not np.any(axis):
        raise FileError(
            place, f"axis of joint {joint.name!r}", got=axis, expected="a direction, not zero"
        )
    mimic = None
    if joint.mimic is not None:
        mimic = Mimic(joint.mimic.joint, float(joint.mimic.multiplier), float(joint.mimic.offset))
    return TreeJoint(
        name=joint.name,
        type=kind,
        parent=joint.parent,
        child=joint.child,
        before=Frame(origin[:3, :3], origin[:3, 3]),
        axis=axis,
        role=Passive() if kind is JointType.PLANAR else Actuated(limits=_limits(joint)),
        mimic=mimic,
    )


def _limits(joint: Any) -> tuple[float, float] | None:
    limit = joint.limit
    if joint.type == "continuous" or limit is None or None in (limit.lower, limit.upper):
        return None
    low, high = float(limit.lower), float(limit.upper)
    return (low, high) if low < high else None


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
    return answer_of(EXPAND_XACRO, request, Location(file), "xacro", "xacro")["text"].encode()
