"""Results as plain data, ready for JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from robostiff.analysis import Deflection, RobotStiffness
from robostiff.elastostatics import Status
from robostiff.markup import COMPLIANCE_UNITS, STIFFNESS_UNITS
from robostiff.spatial import Space
from robostiff.version import __version__


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
        "robot": result.name,
        "status": str(result.status),
        "advice": list(result.advice),
        "pose": None if result.pose is None else result.pose.tolist(),
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
        "compliance": None if compliance is None else compliance.tolist(),
        "rank": int(result.rank) if reached else None,
        "free_motions": [
            {"description": str(motion), "twist": motion.twist.tolist()}
            for motion in result.free_motions
        ],
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
        "robot": answer.name,
        "status": str(result.status),
        "advice": list(result.advice),
        "pose": None if answer.pose is None else answer.pose.tolist(),
        "joint_coordinates": {leg: q.tolist() for leg, q in answer.joint_coordinates.items()},
        "reference_point": answer.reference_point.tolist(),
        "order": order(answer.space),
        "units": {"length": "m", "angle": "rad", "force": "N", "moment": "N m", "energy": "J"},
        "wrench": result.wrench.tolist(),
        "deflection": result.twist.tolist() if result.has_answer else None,
        "energy": result.energy if result.has_answer else None,
        "parts": [
            {"leg": p.leg, "part": p.part, "energy": p.energy, "share": p.share}
            for p in result.parts
        ],
        "actuators": [
            {"leg": a.leg, "joint": a.joint, "load": a.load, "travel": a.travel}
            for a in result.actuators
        ],
        "reactions": [
            {
                "leg": r.leg,
                "joint": r.joint,
                "wrench": r.wrench.tolist(),
                "point": r.point.tolist(),
            }
            for r in result.reactions
        ],
        "free_motions": [str(motion) for motion in answer.free_motions] if reached else [],
        "robostiff": __version__,
    }


def order(space: Space) -> dict[str, list[str]]:
    """Names of the coordinates of twists and wrenches, in order."""
    return {"twist": list(space.twist_order), "wrench": list(space.wrench_order)}
