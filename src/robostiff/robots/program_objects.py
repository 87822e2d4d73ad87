"""Robots from objects of other programs: a URDF of yourdfpy, models of MuJoCo and Pinocchio."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robostiff.errors import InputError
from robostiff.io.suggest import Words

if TYPE_CHECKING:
    from robostiff.io.rigid_tree import RigidTree
    from robostiff.model import Robot
    from robostiff.network import Network

_KINDS = {
    ("yourdfpy", "URDF"): "a URDF of yourdfpy",
    ("mujoco", "MjModel"): "a model of MuJoCo",
    ("pinocchio", "Model"): "a model of Pinocchio",
}


def kind_of(value: Any) -> str | None:
    """What an object of another program is, in words; None for anything else.

    No package is imported to find that out.

    Examples
    --------
    >>> kind_of("hexapod") is None
    True
    """
    for kind in type(value).__mro__:
        package = kind.__module__.partition(".")[0].removesuffix("_pywrap_default")
        if (package, kind.__name__) in _KINDS:
            return _KINDS[package, kind.__name__]
    return None


def load_object(
    value: Any,
    parameters: Mapping[str, str | float] | None = None,
    *,
    side: str | Path | None = None,
) -> Robot | Network:
    """The robot of an object of another program and a side file; see `robostiff.load`."""
    from robostiff.io.rigid_tree import read_side, robot_of_tree

    if side is None:
        raise InputError(
            f"stiffness of {kind_of(value)}",
            got=Words("no side file"),
            expected="side='NAME.stiffness.yaml', the file that has it",
            hint="an object has no folder in which the side file could be looked for",
        )
    document = read_side("robot", side)
    return robot_of_tree(_tree(value), document, parameters)


def _tree(value: Any) -> RigidTree:
    kind = kind_of(value)
    if kind == _KINDS["yourdfpy", "URDF"]:
        from robostiff.io.urdf import read_urdf

        return read_urdf(f"URDF of yourdfpy {value.robot.name!r}", value.write_xml_string())
    if kind == _KINDS["mujoco", "MjModel"]:
        from robostiff.io.mjcf import tree_of_mujoco

        return tree_of_mujoco(value)
    from robostiff.io.pinocchio import tree_of_pinocchio

    return tree_of_pinocchio(value)
