"""Stiffness indices as plain data, ready for JSON."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from robostiff.analysis import RobotStiffness
from robostiff.analysis.free_motion import FreeMotion
from robostiff.analysis.indices import StiffnessIndices
from robostiff.elastostatics import Status
from robostiff.io.results.data import order
from robostiff.version import __version__


def indices_data(result: RobotStiffness, found: StiffnessIndices | None) -> dict[str, Any]:
    """What `indices` answered at a single pose, as plain data.

    Parameters
    ----------
    result : RobotStiffness
        Of a single pose.
    found : StiffnessIndices or None
        None where the pose has no stiffness matrix.

    Returns
    -------
    dict
        JSON-ready; an entry for each index, with its status and unit; null where there is no value.
    """
    return {
        "robot": result.name,
        "status": str(result.status),
        "advice": list(result.advice),
        "pose": None if result.pose is None else result.pose.tolist(),
        "reference_point": result.reference_point.tolist(),
        "order": order(result.space),
        "length": None if found is None else found.length,
        "indices": None if found is None else _indices(found),
        "robostiff": __version__,
    }


def _indices(found: StiffnessIndices) -> dict[str, Any]:
    names = [field.name for field in fields(found) if field.name not in {"result", "length"}]
    return {name: _plain(getattr(found, name)) for name in names}


def _plain(value: Any) -> Any:
    if isinstance(value, FreeMotion):
        return {"description": str(value), "twist": value.twist.tolist()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Status):
        return str(value)
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if is_dataclass(value):
        data = {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
        for fact in ("about", "unit", "units"):  # what the whole class says of itself
            if hasattr(type(value), fact):
                data[fact] = _plain(getattr(value, fact))
        return data
    return value
