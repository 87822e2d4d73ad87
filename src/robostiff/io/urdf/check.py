"""Whether a URDF has what its reader takes for granted; complaints with line and column."""

from __future__ import annotations

from xml.etree import ElementTree

from robostiff.errors import FileError
from robostiff.io.plausibility import question
from robostiff.io.rigid_tree.xml_text import XmlElement
from robostiff.io.suggest import Words, did_you_mean, listing
from robostiff.io.units import Dimension

_TYPES = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating")
_NUMBERS = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": {"lower": 1, "upper": 1},
    "mimic": {"multiplier": 1, "offset": 1},
}

_LARGEST = 1e9  # metres and radians; far beyond any robot
_ASKED = {("origin", "xyz"): Dimension.LENGTH, ("origin", "rpy"): Dimension.ANGLE}


def check_structure(root: XmlElement) -> None:
    """Raise unless links and joints have their names, types, links and numbers.

    Raises
    ------
    FileError
        At the element that is to blame.
    """
    if root.tag != "robot":
        raise FileError(
            root.location, "URDF", got=Words(f"<{root.tag}>"), expected="<robot> at the top"
        )
    _named(root, "robot")
    links = _names(root.all("link"), "link")
    if not links:
        raise FileError(root.location, "URDF", got=Words("no link"), expected="at least one")
    joints = _names(root.all("joint"), "joint")
    for name, joint in joints.items():
        kind = joint.attributes.get("type")
        if kind not in _TYPES:
            raise FileError(
                joint.location,
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
                # What nobody reads, such as an effort, must not stop the reader.
                read = {"link", "joint", *_NUMBERS.get(tag, ())}
                kept = {key: text for key, text in element.attributes.items() if key in read}
                ElementTree.SubElement(copy, tag, kept)
    return ElementTree.tostring(robot, encoding="utf-8")


def _named(element: XmlElement, what: str) -> str:
    name = element.attributes.get("name", "")
    if not name:
        raise FileError(element.location, what, got=Words("no name"), expected='name="..."')
    return name


def _names(elements: list[XmlElement], what: str) -> dict[str, XmlElement]:
    names: dict[str, XmlElement] = {}
    for element in elements:
        name = _named(element, what)
        if name in names:
            raise FileError(
                element.location, f"name of a {what}", got=name, expected="each name once"
            )
        names[name] = element
    return names


def _check_reference(joint: XmlElement, tag: str, links: dict[str, XmlElement]) -> None:
    what = f"{tag} of joint {joint.attributes['name']!r}"
    element = joint.one(tag)
    name = None if element is None else element.attributes.get("link")
    if element is None or not name:
        raise FileError(
            (element or joint).location,
            what,
            got=Words("none" if element is None else "no link"),
            expected=f'<{tag} link="..."/>',
        )
    if name not in links:
        raise FileError(
            element.location,
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
            raise FileError(
                element.location,
                f"{attribute} in the {what}",
                got=text,
                expected=f"{size} finite number{'s' * (size > 1)} up to {_LARGEST:g}",
            )
        dimension = _ASKED.get((element.tag, attribute))
        if dimension is not None:
            worst = max(numbers, key=abs)
            question(worst, dimension, lambda _, place=element.location: place, in_si=True)
