"""Robots of other programs: description files with side files, and objects in Python."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robostiff.errors import FileError, InputError, Words
from robostiff.extras import READERS, entry_points_of, is_offered, load_extra
from robostiff.robots.shipped import robot_file, shipped_linkages

if TYPE_CHECKING:
    from robostiff.io.document import Document
    from robostiff.io.model_file.symbols import Symbols
    from robostiff.io.rigid_tree import Reader, RigidTree
    from robostiff.linkage import Linkage

MODELS = (".yaml", ".yml", ".json")
"""Endings of model files, side files, snapshots and networks."""
_URDF = (".urdf", ".xacro", ".xml")


def endings() -> tuple[str, ...]:
    """Endings of files that are robot descriptions."""
    return (
        *_URDF,
        *(name for name in entry_points_of(READERS) if name[0] == "." and name not in _URDF),
    )


def is_description(path: str | Path) -> bool:
    """Whether a file is a robot description, by its ending."""
    ending = Path(path).suffix.lower() if isinstance(path, str | Path) else ""
    return ending in _URDF or (ending not in ("", *MODELS) and is_offered(READERS, ending))


def names_description(document: Document) -> bool:
    """Whether a document is a side file that names the robot description it is about."""
    return (
        isinstance(document.data, dict)
        and "robostiff" in document.data
        and ("robot" in document.data)
    )


def is_side_file(document: Document) -> bool:
    """Whether a document has joints by name, and none of the bodies or legs that they are in."""
    data = document.data
    if not isinstance(data, dict):
        return False
    parts = {"legs", "cables", "modules", "robot"}
    return isinstance(data.get("joints"), dict) and not parts & data.keys()


def describes_bodies(path: str | Path) -> bool:
    """Whether `load_linkage` takes a file: a description, or a side file that names one."""
    from robostiff.io.document import read_document

    if path in shipped_linkages() or is_description(path):
        return True
    return Path(path).is_file() and names_description(read_document(path))


def description_of(
    value: Any, side: str | Path | None = None, *, allow_xacro: bool = False
) -> tuple[RigidTree, Document]:
    """The tree and the side file of a description, of a side file that names one, or of an object.

    The side file of a description is the one beside it when left out.
    """
    from robostiff.io.document import Document
    from robostiff.io.rigid_tree import read_side

    if isinstance(value, Document):
        return _tree(_description_of(value, allow_xacro)), value
    reader = reader_of(value)
    if reader is None:
        if (ending := Path(value).suffix.lower()) not in _URDF:
            load_extra(READERS, ending)  # without it the name of the side file is not known
        # The side file first: it is the one that is likely to be missing.
        document = read_side(value, side)
        return _tree(value), document
    if side is None:
        raise InputError(
            f"stiffness of {reader.kind}",
            got=Words("no side file"),
            expected="side='NAME.stiffness.yaml', the file that has it",
            hint="an object has no folder in which the side file could be looked for",
        )
    document = read_side("robot", side)
    return reader.read(value), document


def load_linkage(
    path: Any,
    parameters: Mapping[str, str | float] | None = None,
    *,
    symbols: Symbols = (),
    side: str | Path | None = None,
    allow_xacro: bool = False,
) -> Linkage:
    """A robot description with its side file as a linkage, to be placed at any joint coordinates.

    `robostiff.load` makes the robot of it, or a network at home. A linkage is a network at every
    configuration: ``network_at(linkage, {"crank": 0.3})``.

    Parameters
    ----------
    path : str, path, or object
        URDF, xacro or MJCF; a side file that names its description under ``robot:``; the name of a
        shipped linkage; or a model of another program, as `robostiff.load` takes it.
    parameters : mapping of str to (str or float), optional
        Other values for some of the side file's parameters.
    symbols : iterable of str
        Parameters of stiffnesses that stay SymPy symbols of the same name, for
        ``rs.compile(linkage, parameters=...)``.
    side : str or path, optional
        The side file; the one beside the description when left out.
    allow_xacro : bool
        Whether a side file may name a xacro, which runs Python; see `robostiff.load`.

    Raises
    ------
    InputError
        When there is no side file; a `FileError`, with the place, when a file cannot be used.
    """
    from robostiff.io.document import read_document
    from robostiff.io.rigid_tree import linkage_of_tree

    if isinstance(path, str) and path in shipped_linkages():
        path = robot_file(path)
    if reader_of(path) is not None or is_description(path):
        return linkage_of_tree(*description_of(path, side), parameters, symbols)
    if not isinstance(path, str | os.PathLike):
        expected = "a name, a path, or an object of yourdfpy, MuJoCo or Pinocchio"
        raise InputError("linkage", got=path, expected=expected)
    document = read_document(path)
    if not names_description(document):
        got = Words("a file that is no robot description")
        expected = "URDF, xacro or MJCF, or a side file with robot: FILE"
        raise FileError(document.location(), "linkage", got=got, expected=expected)
    tree, side_file = description_of(document, allow_xacro=allow_xacro)
    return linkage_of_tree(tree, side_file, parameters, symbols)


def _description_of(document: Document, allow_xacro: bool) -> Path:
    """The file that a side file names, beside it."""
    written = document.data["robot"]
    place = document.location(("robot",))
    if not isinstance(written, str) or not is_description(written):
        raise FileError(
            place, "robot", got=written, expected=f"a file with the ending {', '.join(endings())}"
        )
    path = Path(document.file).parent / written
    if "\0" in written or not path.is_file():
        raise FileError(place, "robot", got=written, expected="a file, seen from the side file")
    if path.suffix.lower() == ".xacro" and not allow_xacro:
        raise FileError(
            place,
            "robot",
            got=written,
            expected="URDF or MJCF: xacro runs Python that is written in it",
            hint=f"if you trust that file, load {path} itself with this one as side file, or write "
            "allow_xacro=True, --allow-xacro on the command line",
        )
    return path


def _tree(path: str | Path) -> RigidTree:
    ending = Path(path).suffix.lower()
    if ending == ".xacro":
        from robostiff.io.urdf import expand_xacro, read_urdf

        return read_urdf(path, expand_xacro(path))
    is_urdf = ending == ".urdf"
    if ending == ".xml":
        from robostiff.io.rigid_tree.tree import read_xml

        is_urdf = read_xml(path).tag == "robot"
    if is_urdf:
        from robostiff.io.urdf import read_urdf

        return read_urdf(path)
    return load_extra(READERS, ending).read(path)


def refuse_symbols(name: str, symbols: Symbols, expected: str) -> None:
    """Raise an InputError where parameters are named that cannot be symbols."""
    from robostiff.io.model_file.symbols import ParameterChoice

    if symbols and not isinstance(symbols, ParameterChoice):
        got = list(symbols) if isinstance(symbols, list | tuple) else symbols
        hint = "write symbols=(), --symbols none on the command line"
        raise InputError(f"symbols of {name!r}", got=got, expected=f"none: {expected}", hint=hint)


def reader_of(value: Any) -> Reader | None:
    """What reads an object of another program; None for anything else.

    The package of the object is not imported to find that out.
    """
    if isinstance(value, str | os.PathLike | None):
        return None
    for kind in type(value).__mro__:
        package = kind.__module__.partition(".")[0].removesuffix("_pywrap_default")
        name = f"{package}.{kind.__name__}"
        if name == "yourdfpy.URDF":
            from robostiff.io.rigid_tree import Reader
            from robostiff.io.urdf import read_urdf

            def read(urdf: Any) -> RigidTree:
                name = f"URDF of yourdfpy {urdf.robot.name!r}"
                return read_urdf(name, urdf.write_xml_string())

            return Reader("a URDF of yourdfpy", read)
        if is_offered(READERS, name):
            return load_extra(READERS, name)
    return None
