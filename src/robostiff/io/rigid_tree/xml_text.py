"""XML from unknown sources: bounded, without entities, every element with its location."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.errors import FileError, Location, Words
from robostiff.io.bounded_file import bounded_bytes
from robostiff.spatial import Frame

Numbers = Sequence[float] | np.ndarray


@dataclass(frozen=True)
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

    def error(self, subject: str, **words: Any) -> FileError:
        """An error at this element."""
        return FileError(self.location, subject, **words)

    def all(self, tag: str) -> list[XmlElement]:
        """Its children of that name."""
        return [child for child in self.children if child.tag == tag]

    def one(self, tag: str) -> XmlElement | None:
        """Its first child of that name."""
        return next(iter(self.all(tag)), None)

    def numbers(self, what: str, text: str | None, otherwise: Numbers) -> np.ndarray:
        """Numbers of a text in this element, as many as there are otherwise.

        Raises FileError where they are no finite numbers, or others in number.
        """
        if text is None:
            return np.array(otherwise, dtype=float)
        try:
            numbers = np.array(text.split(), dtype=float)
        except ValueError:
            numbers = np.zeros(0)
        size = len(otherwise)
        if numbers.shape != (size,) or not (np.abs(numbers) <= _LARGEST).all():
            expected = f"{size} finite number{'s' * (size > 1)} up to {_LARGEST:g}"
            raise self.error(what, got=text, expected=expected)
        return numbers

    def numbers_at(self, tag: str, key: str, otherwise: Numbers, of: str) -> np.ndarray:
        """Numbers of an attribute of its first child of that name."""
        child = self.one(tag)
        if child is None:
            return np.array(otherwise, dtype=float)
        return child.numbers(f"{key} in the {tag} {of}", child.attributes.get(key), otherwise)

    def frame_at(self, tag: str, of: str) -> Frame:
        """Frame of a child with xyz and rpy: a place, and turns about fixed axes."""
        return frame_of(*(self.numbers_at(tag, key, np.zeros(3), of) for key in ("xyz", "rpy")))


def frame_of(at: np.ndarray, turn: np.ndarray) -> Frame:
    """Frame from a place (3,) and from roll, pitch and yaw (3,) about fixed axes."""
    return Frame(Rotation.from_euler("xyz", turn).as_matrix(), at + 0.0)


_LIMITS = XmlLimits()
_LARGEST = 1e9  # metres and radians; far beyond any robot
_LONGEST_TEXT = 1000  # beyond which no number or name is read


def read_xml(
    source: Path | str, limits: XmlLimits = _LIMITS, content: bytes | None = None
) -> XmlElement:
    """The root element of a file in XML, or of its `content` where it has been read already.

    A document type is refused before it is read, so that there are no entities to expand.

    Raises FileError when it cannot be read, is no XML, has a document type, or is too large.

    Examples
    --------
    >>> text = b"<robot name='r'><link name='a'/></robot>"
    >>> read_xml("r.urdf", content=text).all("link")[0].attributes
    {'name': 'a'}
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
            raise FileError(
                here(),
                "XML",
                got=Words("more elements, or deeper ones"),
                expected=f"at most {limits.elements}, {limits.depth} inside each other",
            )
        element = XmlElement(tag, attributes, here(), [])
        open_[-1].children.append(element)
        open_.append(element)

    def characters(text: str) -> None:
        if len(open_[-1].text) < _LONGEST_TEXT:
            open_[-1].text += text

    def refuse_doctype(*_: object) -> None:
        raise FileError(
            here(),
            "document type",
            got=Words("<!DOCTYPE"),
            expected="none: robot descriptions need no document type, and no entities",
        )

    parser.StartElementHandler, parser.EndElementHandler = start, lambda _: open_.pop()
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = characters, refuse_doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        place = Location(file, error.lineno, error.offset + 1)
        words = Words(expat.ErrorString(error.code))
        raise FileError(place, "XML", got=words, expected="a well-formed document") from None
    return top.children[0]
