"""Shipped robots, one model file each, and loading of any robot by name or file."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, overload

from robostiff.errors import FileError, InputError, Words, warn_of_slip
from robostiff.robots import descriptions
from robostiff.robots.shipped import RobotInfo as RobotInfo
from robostiff.robots.shipped import describe as describe
from robostiff.robots.shipped import robot_file as robot_file
from robostiff.robots.shipped import shipped_cable_robots as shipped_cable_robots
from robostiff.robots.shipped import shipped_linkages as shipped_linkages
from robostiff.robots.shipped import shipped_names as shipped_names
from robostiff.robots.shipped import shipped_robots as shipped_robots
from robostiff.robots.shipped import unknown_robot

if TYPE_CHECKING:
    from robostiff.io.model_file.symbols import Symbols
    from robostiff.model import Robot
    from robostiff.model.cable import CableRobot


ShippedRobot: TypeAlias = Literal[
    "3-prs",
    "3-puu",
    "3-rpr",
    "3-rpr-beams",
    "3-rps",
    "3-rrr",
    "3-upu",
    "agile-eye",
    "capaman",
    "delta",
    "gantry-tau",
    "gough-stewart-a",
    "gough-stewart-a-beams",
    "gough-stewart-b",
    "gough-stewart-b-beams",
    "h4",
    "hexa",
    "hexaglide",
    "hexapod",
    "hexapod-pus",
    "orthoglide",
    "planar-link",
    "scara",
    "six-joint-arm",
    "t3r1",
    "tripteron",
    "two-link-arm",
    "us-ups",
]
ShippedCableRobot: TypeAlias = Literal[
    "cable-3-suspended", "cable-4-planar", "cable-8", "cable-8-suspended"
]


@overload
def load(
    name_or_path: ShippedRobot,
    parameters: Mapping[str, str | float] | None = None,
    *,
    symbols: Symbols = (),
) -> Robot: ...
@overload
def load(
    name_or_path: ShippedCableRobot, parameters: Mapping[str, str | float] | None = None
) -> CableRobot: ...
@overload
def load(
    name_or_path: Any,
    parameters: Mapping[str, str | float] | None = None,
    *,
    symbols: Symbols = (),
    side: str | Path | None = None,
    allow_xacro: bool = False,
) -> Any: ...  # the file decides; write robot: rs.Robot = rs.load("arm.yaml")
def load(
    name_or_path: Any,
    parameters: Mapping[str, str | float] | None = None,
    *,
    symbols: Symbols = (),
    side: str | Path | None = None,
    allow_xacro: bool = False,
) -> Any:
    """A robot by its name, from a file, or from an object of another program.

    Parameters
    ----------
    name_or_path : str or path, yourdfpy.URDF, mujoco.MjModel or pinocchio.Model
        A name of `shipped_robots`, or a file: a model (YAML with ``robostiff: 1``) or a snapshot
        (JSON or YAML, by legs or as a graph); a robot description (URDF, xacro, MJCF) with a side
        file; ``-`` for standard input. Or an object of another program that describes a robot,
        with `side`.
    parameters : mapping of str to (str or float), optional
        Other values for some of the model's parameters, such as ``{"h": "750 mm"}``.
    symbols : iterable of str, or ALL_PARAMETERS
        Parameters of the model that stay SymPy symbols of the same name; a mapping such as
        ``{"cylinder": "c"}`` keeps all of them, some under another name. ``robot.nominal`` has
        the values of the symbols.
    side : str or path, optional
        Side file of a robot description; ``arm.stiffness.yaml`` beside
        ``arm.urdf`` when left out. Objects of other programs need it.
    allow_xacro : bool
        Whether a side file may name a xacro under ``robot:``. Xacro runs Python that is written in
        it; a xacro that is named here itself is trusted.

    Returns
    -------
    Robot, Snapshot, Network or CableRobot

    Raises
    ------
    InputError
        When there is no such robot or file; a `FileError`, with the place, when it cannot be used.

    Examples
    --------
    >>> robot = load("gough-stewart-b", {"h": "750 mm"})
    >>> len(robot.legs), float(robot.home.p[2])
    (6, 0.75)
    >>> load("gough-stewart-b", symbols=("r", "h")).legs[0].attachment.p
    array([r/2, sqrt(3)*r/2, 0], dtype=object)
    """
    from robostiff.io.document import read_document

    reader = descriptions.reader_of(name_or_path)
    if reader is not None:
        return _of_description(reader.kind, name_or_path, parameters, symbols, side)
    if not isinstance(name_or_path, str | os.PathLike):
        expected = "a name, a path, or an object of yourdfpy, MuJoCo or Pinocchio"
        raise InputError("robot", got=name_or_path, expected=expected)
    name = str(name_or_path)
    shipped = isinstance(name_or_path, str) and name in shipped_names()
    if not shipped and name != "-" and not os.path.exists(name):  # False where it is too long
        is_file = isinstance(name_or_path, os.PathLike) or descriptions.is_description(name)
        if is_file or Path(name).suffix.lower() in descriptions.MODELS:
            raise InputError("robot", got=name, expected="a file that exists")
        files = (name + ending for ending in (*descriptions.MODELS, ".urdf", ".xacro"))
        hint = next((f"did you mean {file}?" for file in files if os.path.isfile(file)), None)
        raise unknown_robot(name, "a file, or the name of a shipped robot", hint)
    if not shipped and descriptions.is_description(name):
        return _of_description(name, name, parameters, symbols, side)
    if side is not None:
        expected = "none: only robot descriptions (URDF, xacro, MJCF) have one"
        raise InputError(f"side file of {name!r}", got=str(side), expected=expected)
    document = read_document(robot_file(name) if shipped else name_or_path)
    if descriptions.names_description(document):
        return _of_description(name, document, parameters, symbols, allow_xacro=allow_xacro)
    is_model = isinstance(document.data, dict) and "robostiff" in document.data
    if not is_model:  # for a model, what reads snapshots need not be imported
        from robostiff.io.snapshot import is_snapshot

        is_model = not is_snapshot(document)
    if is_model:
        if descriptions.is_side_file(document):
            raise FileError(
                document.key_location(("joints",)),
                f"robot of {name!r}",
                got=Words("a side file, which adds stiffnesses to a robot description"),
                expected="the description itself, such as arm.urdf beside arm.stiffness.yaml",
                hint="or name it here: robot: arm.urdf",
            )
        if isinstance(document.data, dict) and "cables" in document.data:
            numeric = "a cable robot is computed with numbers, not formulas"
            descriptions.refuse_symbols(name, symbols, numeric)
            symbols = ()
        return _of_model(document, parameters, symbols)
    frozen = "this is a snapshot, frozen at one pose, and not a model"
    descriptions.refuse_symbols(name, symbols, frozen)
    if parameters:
        raise InputError(
            f"parameters of {name!r}", got=dict(parameters), expected=f"none: {frozen}"
        )
    from robostiff.io.snapshot import is_graph, network_from_document, snapshot_from_document

    return (
        network_from_document(document) if is_graph(document) else snapshot_from_document(document)
    )


def _of_model(document: Any, parameters: Any, symbols: Symbols) -> Any:
    """The robot of a model file, with a warning of parameters that nothing in the file uses."""
    from robostiff.io.model_file import model_from_document

    def shipped_model(module: str) -> Path | None:
        return robot_file(module) if module in shipped_robots() else None

    from robostiff.analysis.left_out_shear import softer_by_shear

    robot = model_from_document(document, parameters, symbols=symbols, shipped=shipped_model)
    words = Counter(re.findall(r"\w+", str([document.data, *(parameters or {}).values()])))
    for unused in (x for x in document.data.get("parameters") or () if words[x] == 1):
        place = document.location(("parameters", unused))
        warn_of_slip(f"{place}: nothing in the file uses {unused!r}")
    if (more := softer_by_shear(robot)) > _SHEAR:
        warn_of_slip(
            f"{document.location(())}: shear, which its beams leave out, makes this robot up to "
            f"{more:.0%} softer at home; write theory: timoshenko at the short beams, or theory: "
            "euler-bernoulli to leave it out"
        )
    return robot


_SHEAR = 0.1  # of the compliance of a robot; what is less is within the errors of its numbers


def _of_description(
    name: str, value: Any, parameters: Any, symbols: Symbols, side: Any = None, **options: bool
) -> Any:
    from robostiff.io.rigid_tree import robot_of_tree

    descriptions.refuse_symbols(name, symbols, "the dimensions of a robot description are decimals")
    return robot_of_tree(*descriptions.description_of(value, side, **options), parameters)


def robot_of_legs(loaded: Any, name: str) -> Robot:
    """What was loaded, where formulas can be derived of it; an InputError otherwise."""
    from robostiff import model

    if isinstance(loaded, model.Robot):
        return loaded
    expected = "a robot of legs: a model file, or the description of an arm"
    hint = "snapshots, networks, linkages and cable robots have numbers alone"
    raise InputError("robot of a formula", got=name, expected=expected, hint=hint)
