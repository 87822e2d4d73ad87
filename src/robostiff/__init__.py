"""Cartesian stiffness of robots with elastic links, elastic actuators and passive joints.

    import robostiff as rs

    robot = rs.load("gough-stewart-b")
    result = rs.stiffness(robot, [0, 0, 0.8, 0, 0, 0])
    result.K, result.rank, result.free_motions, result.status

Names are imported when they are first used, so that the command line starts at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from robostiff.version import __version__

_HOMES = {
    "robostiff.analysis": (
        "Deflection",
        "RobotStiffness",
        "compliance",
        "deflection",
        "stiffness",
    ),
    "robostiff.errors": ("FileError", "InputError", "NoAnswerError", "RobostiffError"),
    "robostiff.kinematics": ("JointCoordinates", "find_posture"),
    "robostiff.model": ("Elbow", "Robot", "Snapshot"),
    "robostiff.robots": ("load", "shipped_robots"),
    "robostiff.elastostatics": (
        "Block",
        "IndexRules",
        "Recursive",
        "SaddlePoint",
        "Status",
        "Tolerance",
        "WrenchBasis",
        "chain_stiffness",
    ),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "Block",
    "Deflection",
    "Elbow",
    "FileError",
    "IndexRules",
    "InputError",
    "JointCoordinates",
    "NoAnswerError",
    "Recursive",
    "RobostiffError",
    "Robot",
    "RobotStiffness",
    "SaddlePoint",
    "Snapshot",
    "Status",
    "Tolerance",
    "WrenchBasis",
    "__version__",
    "chain_stiffness",
    "compliance",
    "deflection",
    "find_posture",
    "load",
    "shipped_robots",
    "stiffness",
]

if TYPE_CHECKING:
    from robostiff.analysis import (
        Deflection,
        RobotStiffness,
        compliance,
        deflection,
        stiffness,
    )
    from robostiff.elastostatics import (
        Block,
        IndexRules,
        Recursive,
        SaddlePoint,
        Status,
        Tolerance,
        WrenchBasis,
        chain_stiffness,
    )
    from robostiff.errors import FileError, InputError, NoAnswerError, RobostiffError
    from robostiff.kinematics import JointCoordinates, find_posture
    from robostiff.model import Elbow, Robot, Snapshot
    from robostiff.robots import load, shipped_robots


def __getattr__(name: str) -> Any:
    if name in _HOME_OF:
        value = getattr(import_module(_HOME_OF[name]), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'robostiff' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
