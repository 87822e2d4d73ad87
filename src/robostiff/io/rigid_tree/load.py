"""Loading a tree with its side file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from robostiff.errors import FileError, InputError
from robostiff.io.document import Document, read_document
from robostiff.io.model_file.place import Place, top_place
from robostiff.io.model_file.verify import verified
from robostiff.io.model_file.written_robot import VERSION
from robostiff.io.rigid_tree.build import build_linkage
from robostiff.io.rigid_tree.build_joints import undecided_mimics
from robostiff.io.rigid_tree.tree import RigidTree
from robostiff.io.rigid_tree.written_side import WrittenSide
from robostiff.io.suggest import Words, listing
from robostiff.io.validation import validate
from robostiff.linkage import Linkage, close, essential, robot_of
from robostiff.linkage.network_at import network_of
from robostiff.model import Coordinate, Robot
from robostiff.model.chain import is_elastic
from robostiff.network import Network


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
    written, top = _read(side, parameters)
    _, linkage = _linkages(written, top, tree)
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
        robot = robot_of(linkage, found)
    if robot is None:
        return network_of(linkage, found)
    return _with_coordinates(robot, written, top)


def linkage_of_tree(
    tree: RigidTree, side: Document, parameters: Mapping[str, str | float] | None = None
) -> Linkage:
    """The linkage that a tree and a side file describe, for any configuration.

    Raises
    ------
    FileError
        At the place in the side file or in the description that is to blame.
    """
    written, top = _read(side, parameters)
    return _linkages(written, top, tree)[0]


def _read(
    side: Document, parameters: Mapping[str, str | float] | None
) -> tuple[WrittenSide, Place]:
    written = validate(WrittenSide, side)
    return written, top_place(side, written.parameters, parameters or {})


def _linkages(written: WrittenSide, top: Place, tree: RigidTree) -> tuple[Linkage, Linkage]:
    """The whole linkage, and the part of it between base and platform, checked."""
    linkage = build_linkage(top, written, tree)
    with (top / "tool").complaints():
        part = essential(linkage)
    felt = {joint.name for joint in part.joints}
    following = [name for name in undecided_mimics(written, tree, top) if name in felt]
    if following:
        raise (top / "joints").error(
            f"joint {sorted(following)[0]!r}",
            got=Words("a joint that follows another one"),
            expected="its role, as if it were a joint of its own",
            hint=f"write {sorted(following)[0]}: {{role: locked}}, or {{stiffness: ...}} of what "
            "makes it follow",
        )
    if not any(is_elastic(c.element) for c in part.connections):
        raise (top / "joints").error(
            f"robot {linkage.name!r}",
            got=Words("no compliance at all"),
            expected="the stiffness of at least one joint or link",
            hint=_hint(part),
        )
    return linkage, part


def _hint(part: Linkage) -> str:
    names = [joint.name for joint in part.joints]
    if not names:
        return "write links: {NAME: {type: beam, material: steel, section: ...}}"
    return (
        f"write joints: {{{names[0]}: {{stiffness: 1e4 N m/rad}}}} or the like; its joints are "
        f"{listing(names, 12)}"
    )


def _with_coordinates(robot: Robot, written: WrittenSide, top: Place) -> Robot:
    """The robot with the coordinates of its platform that are written, or fitting ones."""
    chosen = written.coordinates is not None
    if written.coordinates is not None:
        coordinates = tuple(map(Coordinate, written.coordinates))
        if len(set(coordinates)) < len(coordinates):
            raise (top / "coordinates").error(
                "coordinates", got=written.coordinates, expected="each one once"
            )
        if robot.is_serial:
            raise (top / "coordinates").error(
                "coordinates of a serial arm", expected="none: its joints pose it", key=True
            )
        robot = replace(robot, coordinates=coordinates)
    return verified(robot, top, [top] * len(robot.legs), chosen=chosen)


_ENDINGS = (".xacro", ".urdf", ".xml", ".mjcf")
_EXAMPLE = (
    "write robostiff: 1, source: where the numbers come from, tool: the name of a link, joints: "
    '{"*": {stiffness: 1e4 N m/rad}}, or the like'
)


def side_file_of(description: Path) -> Path:
    """Default path of the side file of a robot description.

    Examples
    --------
    >>> side_file_of(Path("cell/arm.urdf.xacro")).name
    'arm.stiffness.yaml'
    """
    name = description.name
    for ending in _ENDINGS:
        name = name[: -len(ending)] if name.lower().endswith(ending) else name
    return description.with_name(f"{name}.stiffness.yaml")


def read_side(description: Path | str, side: Path | str | None = None) -> Document:
    """The side file of a robot description.

    Parameters
    ----------
    description : path or str
    side : path or str, optional
        The side file; the one beside the description when left out, which is called like it with
        the ending ``.stiffness.yaml``.

    Raises
    ------
    InputError
        When there is none; a `FileError` when it cannot be read or is no side file.
    """
    if side is None:
        found = side_file_of(Path(description))
        if not found.exists():
            raise InputError(
                f"stiffness of {str(description)!r}",
                got=Words("no side file"),
                expected=f"{found} beside it, or another file by side=, --side on the command line",
                hint=f"there {_EXAMPLE}",
            )
        side = found
    document = read_document(side)
    _check(document)
    return document


def _check(document: Document) -> None:
    """Raise unless the document begins as a side file of this version does."""
    data = document.data
    if not isinstance(data, dict) or "robostiff" not in data:
        raise FileError(
            document.location(), "side file", expected="robostiff: 1 at the top", hint=_EXAMPLE
        )
    version = data["robostiff"]
    if version != VERSION or isinstance(version, bool):
        raise FileError(
            document.location(("robostiff",)),
            "version of the side file",
            got=version,
            expected=str(VERSION),
            hint="this file needs a newer robostiff"
            if isinstance(version, int) and version > VERSION
            else None,
        )
    if "legs" in data:
        raise FileError(
            document.key_location(("legs",)),
            "side file",
            got=Words("a model file with legs of its own"),
            expected="a side file of a robot description",
            hint=_EXAMPLE,
        )
