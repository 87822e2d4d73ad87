"""URDF, robot descriptions of ROS; and xacro, expanded by xacrodoc."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from robostiff.errors import Location, needs_extra
from robostiff.io.child_process import EXPAND_XACRO, answer_of
from robostiff.io.plausibility import question
from robostiff.io.rigid_tree.tree import JointType, Mimic, RigidTree, TreeJoint, mass_of_body
from robostiff.io.rigid_tree.xml_text import XmlElement, XmlLimits, read_xml
from robostiff.io.suggest import Words, did_you_mean, listing
from robostiff.io.units import Dimension
from robostiff.io.urdf_extensions import rotor_inertias, with_extensions
from robostiff.model import Actuated, Mass, Passive

_TYPES = {
    "fixed": JointType.FIXED,
    "revolute": JointType.REVOLUTE,
    "continuous": JointType.REVOLUTE,
    "prismatic": JointType.PRISMATIC,
    "planar": JointType.PLANAR,
    "floating": JointType.FLOATING,
}


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


def _linked(joint: XmlElement, tag: str, links: dict[str, XmlElement]) -> str:
    """The link that a joint has as its parent or child."""
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
    return name


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
    """
    root = read_xml(source, content=content)
    if root.tag != "robot":
        raise root.error("URDF", got=Words(f"<{root.tag}>"), expected="<robot> at the top")
    name = _named(root, "robot")
    links = _names(root.all("link"), "link")
    if not links:
        raise root.error("URDF", got=Words("no link"), expected="at least one")
    rotors = rotor_inertias(root)
    tree = RigidTree(
        name=name,
        file=str(source),
        links=tuple(links),
        joints=tuple(
            replace(_joint(own, links), inertia=rotors.get(joint, 0.0))
            for joint, own in _names(root.all("joint"), "joint").items()
        ),
        masses={own: mass for own, link in links.items() if (mass := _mass(link)) is not None},
    )
    return with_extensions(tree, root)


def _joint(joint: XmlElement, links: dict[str, XmlElement]) -> TreeJoint:
    name, word = joint.attributes["name"], joint.attributes.get("type")
    if word not in _TYPES:
        raise joint.error(
            f"type of joint {name!r}",
            got=word,
            expected=f"one of {', '.join(_TYPES)}",
            hint=did_you_mean(word, _TYPES) if word else None,
        )
    kind, of = _TYPES[word], f"of joint {name!r}"
    parent, child = (_linked(joint, tag, links) for tag in ("parent", "child"))
    before = joint.frame_at("origin", of)
    axis = joint.numbers_at("axis", "xyz", (1.0, 0.0, 0.0), of)
    if kind in (JointType.REVOLUTE, JointType.PRISMATIC, JointType.PLANAR) and not np.any(axis):
        raise joint.error(f"axis of joint {name!r}", got=axis, expected="a direction, not zero")
    low, high = (joint.numbers_at("limit", key, (0.0,), of).item() for key in ("lower", "upper"))
    limit = joint.one("limit")
    bounded = limit is not None and {"lower", "upper"} <= set(limit.attributes) and low < high
    limits = (low, high) if bounded and word != "continuous" else None
    mimic, follows = joint.one("mimic"), None
    if mimic is not None:
        factor = joint.numbers_at("mimic", "multiplier", (1.0,), of).item()
        offset = joint.numbers_at("mimic", "offset", (0.0,), of).item()
        follows = Mimic(mimic.attributes.get("joint", ""), factor, offset)
    origin = joint.one("origin")
    if origin is not None:
        turn = joint.numbers_at("origin", "rpy", (0.0, 0.0, 0.0), of)
        for numbers, dimension in ((before.p, Dimension.LENGTH), (turn, Dimension.ANGLE)):
            worst = max(numbers.tolist(), key=abs)
            question(worst, dimension, lambda _: origin.location, in_si=True)
    return TreeJoint(
        name=name,
        type=kind,
        parent=parent,
        child=child,
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
    return answer_of(EXPAND_XACRO, request, Location(file), "xacro", "xacro")["text"].encode()
