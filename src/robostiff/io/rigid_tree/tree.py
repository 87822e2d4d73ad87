"""Robot descriptions as data: XML from unknown sources, and the tree of rigid links read of it.

XML is bounded and without entities, every element with its location.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.errors import FileError, InputError, Location, Words, warn_of_slip
from robostiff.extras import READERS, entry_points_of
from robostiff.frozen import frozen
from robostiff.io.bounded_file import bounded_bytes
from robostiff.io.document import Document, read_document
from robostiff.io.model_file.place import VERSION, check_version
from robostiff.io.suggest import listing
from robostiff.io.units import Dimension, question
from robostiff.model import Actuated, Joint, Link, Mass, Role
from robostiff.spatial import Frame

Numbers = Sequence[float] | np.ndarray

LARGEST_IN_XML = 1e9  # metres and radians; far beyond any robot


@frozen
class XmlLimits:
    """Bounds on a description."""

    size: int = 16_000_000  # of the file [bytes]
    depth: int = 200  # of elements inside each other
    elements: int = 200_000  # in all, those that MJCF replicates counted as often


@dataclass
class XmlElement:
    """An element: its name, attributes, place, children, and the beginning of its text."""

    tag: str
    attributes: dict[str, str]
    location: Location
    children: list[XmlElement]
    text: str = ""

    @property
    def place(self) -> tuple[str, Location]:
        """Its name, or that of what it refers to, and where it is."""
        name = self.attributes.get("name") or self.attributes.get("reference", "")
        return name, self.location

    def error(self, subject: str, **words: Any) -> FileError:
        """An error at this element."""
        return FileError(self.location, subject, **words)

    def all(self, tag: str) -> list[XmlElement]:
        """Its children of that name."""
        return [child for child in self.children if child.tag == tag]

    def one(self, tag: str) -> XmlElement | None:
        """Its first child of that name."""
        return next(iter(self.all(tag)), None)

    def numbers(
        self, what: str, text: str | None, otherwise: Numbers, most: float = LARGEST_IN_XML
    ) -> np.ndarray:
        """Numbers of a text in this element, as many as there are otherwise.

        Raises FileError where they are no finite numbers, or others in number.
        """
        if text is None:
            return np.array(otherwise, dtype=float)
        try:
            numbers = np.array(text.replace("_", "?").split(), dtype=float)  # 1_0 is Python's alone
        except ValueError:
            numbers = np.zeros(0)
        size = len(otherwise)
        if numbers.shape != (size,) or not (np.abs(numbers) <= most).all():
            expected = f"{size} finite number{'s' * (size > 1)} up to {most:g}"
            raise self.error(what, got=text, expected=expected)
        return numbers

    def numbers_at(
        self, tag: str, key: str, otherwise: Numbers, of: str, most: float = LARGEST_IN_XML
    ) -> np.ndarray:
        """Numbers of an attribute of its first child of that name."""
        child = self.one(tag)
        if child is None:
            return np.array(otherwise, dtype=float)
        return child.numbers(f"{key} in the {tag} {of}", child.attributes.get(key), otherwise, most)

    def frame_at(self, tag: str, of: str) -> Frame:
        """Frame of a child with xyz and rpy or quat_xyzw: a place, and turns about fixed axes."""
        at, turn = (self.numbers_at(tag, key, np.zeros(3), of) for key in ("xyz", "rpy"))
        child, key = self.one(tag), "quat_xyzw"
        if child is None or key not in child.attributes:
            return frame_of(at, turn)
        quaternion = self.numbers_at(tag, key, np.zeros(4), of)
        if "rpy" in child.attributes or not np.any(quaternion):
            expected = "a quaternion, not zero, and no rpy beside it"
            raise child.error(f"{key} in the {tag} {of}", got=child.attributes, expected=expected)
        return Frame(Rotation.from_quat(quaternion).as_matrix(), at + 0.0)


def frame_of(at: np.ndarray, turn: np.ndarray) -> Frame:
    """Frame from a place (3,) and from roll, pitch and yaw (3,) about fixed axes."""
    return Frame(Rotation.from_euler("xyz", turn).as_matrix(), at + 0.0)


_LIMITS = XmlLimits()
_LONGEST_TEXT = 1000  # beyond which no number or name is read


def read_xml(
    source: Path | str, limits: XmlLimits = _LIMITS, content: bytes | None = None
) -> XmlElement:
    """The root element of a file in XML, or of its `content` where it has been read already.

    A document type is refused before it is read, so that there are no entities to expand.

    Raises FileError when it cannot be read, is no XML, has a document type, or is too large.
    """
    if content is None:
        content = bounded_bytes(source, limits.size, "a robot description")
    parser, file = expat.ParserCreate(), str(source)
    top = XmlElement("", {}, Location(file), [])  # what has the root in it
    open_, count = [top], 0

    def here() -> Location:
        return Location(file, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > limits.elements or len(open_) > limits.depth:
            got = Words("more elements, or deeper ones")
            expected = f"at most {limits.elements}, {limits.depth} inside each other"
            raise FileError(here(), "XML", got=got, expected=expected)
        element = XmlElement(tag, attributes, here(), [])
        open_[-1].children.append(element)
        open_.append(element)

    def characters(text: str) -> None:
        if len(open_[-1].text) < _LONGEST_TEXT:
            open_[-1].text += text

    def refuse_doctype(*_: object) -> None:
        expected = "none: robot descriptions need no document type, and no entities"
        raise FileError(here(), "document type", got=Words("<!DOCTYPE"), expected=expected)

    parser.StartElementHandler, parser.EndElementHandler = start, lambda _: open_.pop()
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = characters, refuse_doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        place = Location(file, error.lineno, error.offset + 1)
        words = Words(expat.ErrorString(error.code))
        raise FileError(place, "XML", got=words, expected="a well-formed document") from None
    return top.children[0]


MOST_LINKS = 2000
"""Of a description; robots have a hundred at most."""


class JointType(Enum):
    """Kinds of joint in robot description files."""

    FIXED = "fixed"
    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    SPHERICAL = "spherical"
    PLANAR = "planar"
    FLOATING = "floating"


@frozen
class Mimic:
    """A joint whose coordinate is ``multiplier`` times that of another one plus ``offset``."""

    joint: str
    multiplier: float
    offset: float


@frozen
class TreeJoint:
    """A joint between a link and its child."""

    name: str
    type: JointType
    parent: str  #: name of a link
    child: str  #: and of the one that it moves
    before: Frame  #: of the joint at coordinate zero, in the parent's frame
    #: (3,): of a revolute or prismatic joint, or normal of a planar one, in the joint's frame
    axis: np.ndarray
    #: of the child, seen from the joint's frame once it has moved
    after: Frame = field(default_factory=Frame.identity)
    #: in the description; a stiffness is that of its drive
    role: Role = field(default_factory=Actuated)
    spring: float = 0.0  #: stiffness of one beside its drive [N m/rad or N/m]; 0 for none
    inertia: float = 0.0  #: of the rotor of its drive, at the joint [kg m^2 or kg]; 0 for none
    home: float = 0.0  #: coordinate in the configuration in which the description draws it
    mimic: Mimic | None = None

    @property
    def drawn_at(self) -> np.ndarray:
        """Point of the joint in the description, in the parent's frame (3,) [m].

        A slide is drawn at its own coordinate, which need not be zero; a link ends there.
        """
        slides = self.type is JointType.PRISMATIC
        return self.before.p + self.before.R @ (self.home * self.axis * slides)


@frozen
class TreeLoop:
    """Frames on two links that coincide up to the motion of what is between them."""

    name: str
    links: tuple[str, str]
    frames: tuple[Frame, Frame]  #: one in the frame of each link
    element: Joint | Link | None  #: a joint, a spring, or nothing for links that are welded


@frozen
class RigidTree:
    """Links connected to one root.

    Raises
    ------
    FileError
        When links and joints are no tree with one root, or too many.
    """

    name: str
    file: str  #: for messages
    links: tuple[str, ...]
    joints: tuple[TreeJoint, ...]
    loops: tuple[TreeLoop, ...] = ()
    masses: Mapping[str, Mass] = field(default_factory=dict)  #: of links, in their frames
    keyframes: tuple[str, ...] = ()  #: postures of the description, which are not read

    def __post_init__(self) -> None:
        if len(self.links) > MOST_LINKS:
            raise self.error("links", got=len(self.links), expected=f"at most {MOST_LINKS}")
        for child, count in Counter(joint.child for joint in self.joints).items():
            if count > 1:
                what = f"joints that lead to the link {child!r}"
                got = Words(", ".join(j.name for j in self.joints if j.child == child))
                hint = "write what closes a loop under loops: in the side file"
                raise self.error(what, got=got, expected="one", hint=hint)
        roots = [link for link in self.links if link not in self.into]
        if len(roots) != 1:
            got = Words(listing(roots) or "none")
            raise self.error("links without a parent", got=got, expected="one root of the tree")
        reached = [roots[0]]
        for link in reached:  # which grows meanwhile
            reached += [joint.child for joint in self.out_of.get(link, ())]
        if len(reached) < len(self.links):
            rest = [link for link in self.links if link not in set(reached)]
            got = Words(listing(rest, 12))
            raise self.error("links that are connected in a circle", got=got, expected="a tree")

    @cached_property
    def root(self) -> str:
        """The link without a parent."""
        return next(link for link in self.links if link not in self.into)

    @cached_property
    def leaves(self) -> tuple[str, ...]:
        """The links without a child."""
        return tuple(link for link in self.links if link not in self.out_of)

    @cached_property
    def into(self) -> dict[str, TreeJoint]:
        """The joint between each link and its parent; none of the root."""
        return {joint.child: joint for joint in self.joints}

    @cached_property
    def out_of(self) -> dict[str, list[TreeJoint]]:
        """The joints between each link and its children, if it has any."""
        out: dict[str, list[TreeJoint]] = {}
        for joint in self.joints:
            out.setdefault(joint.parent, []).append(joint)
        return out

    def error(self, subject: str, **words: Any) -> FileError:
        """An error in the description."""
        return FileError(Location(self.file), subject, **words)


@frozen
class Reader:
    """Reads descriptions of robots."""

    kind: str  #: what is read, in words: ``"a model of MuJoCo"``
    #: from a path, str or `Path`, or an object of another program, to its tree of rigid links
    read: Callable[[Any], RigidTree]


def question_place(place: np.ndarray, location: Location) -> None:
    """Warn when a place (3,) [m] is so far away that it is probably in another unit."""
    far = float(np.max(np.abs(place)))
    question(far, Dimension.LENGTH, lambda _: location, in_si=True)


def mass_of_body(
    name: str, value: float, centre: np.ndarray, inertia: np.ndarray, place: Location
) -> Mass | None:
    """The mass of a link in its frame, None of none; warns where its moments are of no body.

    The moments of inertia (3, 3) [kg m^2] are about the centre (3,) [m], in the axes of the link.
    """
    if value == 0:
        if np.any(inertia):
            warn_of_slip(f"{place}: link {name!r} has moments of inertia and no mass: not read")
        return None
    try:
        return Mass(value, centre, name=name, inertia=inertia if np.any(inertia) else None)
    except InputError as error:
        warn_of_slip(f"{place}: {error}; its mass of {value:g} kg is taken without them")
        return Mass(value, centre, name=name)


def warn_of_parts_not_read(
    parts: Mapping[str, Sequence[tuple[str, Location]]],
    instead: str = "nothing stands in their place",
) -> None:
    """Warn of parts of a description that move, bend, weigh or hold others, and are not read.

    For each kind their names and places; that of the first is shown.
    """
    for kind, entries in parts.items():
        if entries:
            names = listing([name or "without a name" for name, _ in entries], 12)
            words = f"not read: {kind} {names}; {instead}"
            warn_of_slip(f"{entries[0][1]}: {words}")


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
        for ending in (".xacro", ".urdf", ".xml", *entry_points_of(READERS)):
            name = name[: -len(ending)] if name.lower().endswith(ending) else name
        path = Path(description).with_name(f"{name}.stiffness.yaml")
        if not path.exists():
            what, got = f"stiffness of {str(description)!r}", Words("no side file")
            expected = f"{path} beside it, or another file by side=, --side on the command line"
            raise InputError(what, got=got, expected=expected, hint=f"there {_EXAMPLE}")
        side = path
    document = read_document(side)
    expected = f"robostiff: {VERSION} at the top"
    check_version(document, "side file", "version of the side file", expected, _EXAMPLE)
    if "legs" in document.data:
        got = Words("a model file with legs of its own")
        expected = "a side file of a robot description"
        raise FileError(
            document.key_location(("legs",)), "side file", got=got, expected=expected, hint=_EXAMPLE
        )
    return document
