"""The task of the child process that expands a xacro file; imports nothing of this package."""

from __future__ import annotations

import hashlib
import os
import warnings
from typing import Any
from xml.parsers import expat

import xacro as _xacro
import yaml  # noqa: F401 - before the audit hook, which refuses what some imports do
from xacrodoc import packages

xacro: Any = _xacro  # a module without annotations


class _Refused(Exception):
    """A file that is included breaks the rules of the first one: what came, file and line."""


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """The URDF that a file expands to, or why there is none."""
    parse = xacro.parse
    files = {}

    def checked(source: Any, filename: str | None = None) -> Any:
        if source is None:
            content = _check(str(filename), request["limits"])
            files[os.path.realpath(str(filename))] = hashlib.sha256(content).hexdigest()
        return parse(source, filename)

    xacro.parse = checked
    try:
        warnings.simplefilter("ignore")  # of Python code inside macros
        packages.walk_up_from(request["file"])  # for $(find package)
        document: Any = xacro.process_file(request["file"])
        text = document.toxml()
    except _Refused as error:
        refusal, file, line = error.args
        return {"refusal": refusal, "file": file, "line": line}
    except (MemoryError, RecursionError):
        raise
    except Exception as error:  # macros may fail in any way
        return {"refusal": f"{type(error).__name__}: {error}"}
    if len(text) > request["limits"]["size"]:
        return {"refusal": f"macros that expand to more than {request['limits']['size']} bytes"}
    return {"text": text, "files": files}


def _check(file: str, limits: dict[str, int]) -> bytes:
    """The content of a file without document type, within the bounds of the first file."""
    with open(file, "rb") as stream:
        content = stream.read(limits["size"] + 1)
    if len(content) > limits["size"]:
        raise _Refused(f"more than {limits['size']} bytes", file, None)
    parser = expat.ParserCreate()
    count = depth = 0

    def start(*_: object) -> None:
        nonlocal count, depth
        count, depth = count + 1, depth + 1
        if count > limits["elements"] or depth > limits["depth"]:
            most, deepest = limits["elements"], limits["depth"]
            words = f"more than {most} elements, or than {deepest} inside each other"
            raise _Refused(words, file, parser.CurrentLineNumber)

    def end(*_: object) -> None:
        nonlocal depth
        depth -= 1

    def doctype(*_: object) -> None:
        raise _Refused("<!DOCTYPE", file, parser.CurrentLineNumber)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise _Refused(expat.ErrorString(error.code), file, error.lineno) from None
    return content
