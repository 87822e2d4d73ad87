"""Results as plain data, which JSON can hold, and as a file of MATLAB."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis import RobotStiffness
from robostiff.analysis.free_motion import FreeMotion
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.markup import COMPLIANCE_UNITS, STIFFNESS_UNITS
from robostiff.spatial import Space
from robostiff.version import __version__

if TYPE_CHECKING:
    from robostiff.analysis import Deflection


def stiffness_data(result: RobotStiffness) -> dict[str, Any]:
    """The result of `stiffness` at a single pose, as plain data.

    Parameters
    ----------
    result : RobotStiffness
        Of a single pose.

    Returns
    -------
    dict
        JSON-ready. ``stiffness`` and ``compliance`` are null where there is none; ``status`` joins
        what happened with ``+``, and is ``ok`` for a plain answer.
    """
    reached = Status.UNREACHABLE not in result.status
    compliance = result.compliance
    answered = bool(np.all(result.answered))
    return {
        **head(result.name, result),
        "pose": plain(result.pose),
        "joint_coordinates": {leg: q.tolist() for leg, q in result.joint_coordinates.items()},
        "reference_point": result.reference_point.tolist(),
        "order": order(result.space),
        "units": {
            "length": "m",
            "angle": "rad",
            "stiffness": asdict(STIFFNESS_UNITS),
            "compliance": asdict(COMPLIANCE_UNITS),
        },
        "stiffness": result.K.tolist() if answered else None,
        "compliance": plain(compliance),
        "rank": int(result.rank) if reached else None,
        "free_motions": plain(tuple(result.free_motions)),
        "rigid_directions": result.rigid_directions.tolist() if reached else [],
        "redundant_joints": list(result.redundant_joints) if reached else [],
        "method": result.method.name,
        "equation": result.method.equation,
        "decided_by": str(result.decision) if reached else None,
    }


def deflection_data(result: Deflection) -> dict[str, Any]:
    """The result of `deflection`, as plain data.

    Returns
    -------
    dict
        JSON-ready; ``deflection`` is null where there is none.
    """
    answer = result.stiffness
    reached = Status.UNREACHABLE not in answer.status
    return {
        **head(answer.name, result),
        "pose": plain(answer.pose),
        "joint_coordinates": {leg: q.tolist() for leg, q in answer.joint_coordinates.items()},
        "reference_point": answer.reference_point.tolist(),
        "order": order(answer.space),
        "units": {"length": "m", "angle": "rad", "force": "N", "moment": "N m", "energy": "J"},
        "wrench": result.wrench.tolist(),
        "deflection": result.twist.tolist() if result.has_answer else None,
        "energy": result.energy if result.has_answer else None,
        "parts": picked(result.parts, "leg part energy share"),
        "actuators": picked(result.actuators, "leg joint load travel unit"),
        "reactions": picked(result.reactions, "leg joint wrench point"),
        "free_motions": [str(motion) for motion in answer.free_motions] if reached else [],
    }


def head(name: str, result: Any) -> dict[str, Any]:
    """How a result begins: the version, the robot, what happened, and advice."""
    status, advice = str(result.status), list(result.advice)
    return {"robostiff": __version__, "robot": name, "status": status, "advice": advice}


def picked(parts: Iterable[Any], names: str) -> list[dict[str, Any]]:
    """Attributes of some parts, by their names with blanks between them."""
    return [{name: plain(getattr(own, name)) for name in names.split()} for own in parts]


def plain(value: Any) -> Any:
    """A result or a part of it as data for JSON: arrays and tuples as lists, statuses in words."""
    if isinstance(value, FreeMotion):
        return {"description": str(value), "twist": value.twist.tolist()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Status):
        return str(value)
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    if is_dataclass(value):
        data = {field.name: plain(getattr(value, field.name)) for field in fields(value)}
        for fact in ("about", "unit", "units"):  # class attributes
            if hasattr(type(value), fact):
                data[fact] = plain(getattr(value, fact))
        return data
    return value


def order(space: Space) -> dict[str, list[str]]:
    """Names of the coordinates of twists and wrenches, in order."""
    return {"twist": list(space.twist_order), "wrench": list(space.wrench_order)}


_LONGEST = 63  # letters of a name of MATLAB
_LEFT_OUT = ("equation", "decided_by")


def write_matlab(path: Path, result: RobotStiffness) -> None:
    """Write the stiffness of a robot at a single pose as a .mat file.

    Its variables are those of ``robostiff stiffness --json`` (`stiffness`, `compliance`, `pose`,
    `rank`, ...), and ``transform``, the platform as a 4 x 4 matrix. Twists have translations first.
    What there is none of is an empty array; names of legs become names of MATLAB.

    Parameters
    ----------
    path : Path
        Replaced if it is there.
    result : RobotStiffness

    Raises
    ------
    InputError
        When the name does not end in .mat.
    """
    from scipy.io import savemat

    if path.suffix.lower() != ".mat":
        raise InputError("file for MATLAB", got=str(path), expected="a name that ends in .mat")
    data = {key: value for key, value in stiffness_data(result).items() if key not in _LEFT_OUT}
    transform = result.transform
    if transform is not None:
        data["transform"] = transform.as_matrix()
    savemat(path, _for_matlab(data), long_field_names=True, oned_as="row")


def _for_matlab(value: Any) -> Any:
    if value is None:
        return np.zeros((0, 0))
    if isinstance(value, dict):
        names: dict[str, Any] = {}
        for key, own in value.items():
            names[_name(key, names)] = _for_matlab(own)
        return names
    if isinstance(value, list) and any(isinstance(own, str | dict) for own in value):
        cells = np.empty(len(value), dtype=object)
        cells[:] = [_for_matlab(own) for own in value]
        return cells
    return value if isinstance(value, str) else np.asarray(value, dtype=float)


def _name(key: str, taken: dict[str, Any]) -> str:
    """A name of MATLAB: letters, digits and underscores, and none twice."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", key)
    plain = (plain if plain[:1].isalpha() else f"x{plain}")[:_LONGEST]
    name, number = plain, 2
    while name in taken:
        name = f"{plain[: _LONGEST - 4]}_{number}"
        number += 1
    return name
