"""Xacro, the macros of ROS, expanded to a URDF."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from robostiff.errors import InputError, Location
from robostiff.io.child_process import answer_of
from robostiff.io.rigid_tree.xml_text import XmlLimits, parse_xml, read_bytes
from robostiff.io.suggest import Words

_TASK = Path(__file__).with_name("expand_in_child.py")
_LIMITS = XmlLimits()


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
    parse_xml(read_bytes(source, _LIMITS), file, _LIMITS)
    if find_spec("xacrodoc") is None or find_spec("xacro") is None:
        raise InputError(
            "xacro",
            got=Words("no xacrodoc, which expands it"),
            expected="the extra urdf",
            hint="pip install 'robostiff[urdf]'",
        )
    request = {"file": file, "limits": vars(_LIMITS)}
    return answer_of(_TASK, request, Location(file), "xacro", "xacro")["text"].encode()
