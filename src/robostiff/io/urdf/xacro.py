"""Xacro, the macros of ROS, expanded to a URDF."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

from robostiff.errors import FileError, InputError, Location
from robostiff.io.rigid_tree.xml_text import parse_xml, read_bytes
from robostiff.io.suggest import Words


def expand_xacro(source: Path | str) -> bytes:
    """The URDF that a xacro file expands to.

    Xacro computes Python expressions and includes other files: expand no file that you would not
    run.

    Parameters
    ----------
    source : path or str

    Raises
    ------
    FileError
        When the file cannot be read or expanded.
    InputError
        When xacrodoc is not installed.
    """
    file = str(source)
    parse_xml(read_bytes(source), file)
    try:
        import xacro
        from xacrodoc import packages
    except ImportError:
        raise InputError(
            "xacro",
            got=Words("no xacrodoc, which expands it"),
            expected="the extra urdf",
            hint="pip install 'robostiff[urdf]'",
        ) from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of Python code inside macros
            packages.walk_up_from(file)  # for $(find package)
            document: Any = xacro.process_file(file)
            return document.toxml().encode()
    except Exception as error:  # macros may fail in any way
        raise FileError(
            Location(file),
            "xacro",
            got=Words(f"{type(error).__name__}: {error}"),
            expected="macros that expand to a URDF",
        ) from None
