"""Results as plain data, which JSON can hold."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis import RobotStiffness
from robostiff.analysis.free_motion import FreeMotion
from robostiff.elastostatics import Status
from robostiff.markup import COMPLIANCE_UNITS, STIFFNESS_UNITS
from robostiff.spatial import Space
from robostiff.version import __version__

if TYPE_CHECKING:
    from robostiff.analysis import Deflection, RobotStiffness


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
        "joint_names": {leg: list(names) for leg, names in result.joint_names.items()},
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
        "robostiff": __version__,
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
        "joint_names": {leg: list(names) for leg, names in answer.joint_names.items()},
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
        "robostiff": __version__,
    }


def head(name: str, result: Any) -> dict[str, Any]:
    """How a result begins: the robot, what happened, and advice."""
    return {"robot": name, "status": str(result.status), "advice": list(result.advice)}


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
