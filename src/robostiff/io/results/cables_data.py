"""Answers about cable robots as plain data, ready for JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from robostiff.analysis import CableResponse, CableStiffness
from robostiff.io.results.data import order
from robostiff.markup import STIFFNESS_UNITS
from robostiff.version import __version__


def cable_stiffness_data(result: CableStiffness) -> dict[str, Any]:
    """What `cable_stiffness` answered at a single pose, as plain data.

    Returns
    -------
    dict
        JSON-ready; what there is not is null.
    """
    answered = bool(np.all(result.answered))
    return {
        "robot": result.name,
        "status": str(result.status),
        "advice": list(result.advice),
        "pose": result.pose.tolist(),
        "reference_point": result.reference_point.tolist(),
        "order": order(result.space),
        "units": {
            "length": "m",
            "angle": "rad",
            "tension": "N",
            "stiffness": asdict(STIFFNESS_UNITS),
        },
        "wrench": result.wrench.tolist(),
        "cables": [
            {
                "name": name,
                "length": float(result.placed.lengths[i]),
                "tension": float(result.tensions[i]) if answered else None,
                "stiffness": float(result.axial[i]) if answered else None,
            }
            for i, name in enumerate(result.cable_names)
        ],
        "tensions_by": result.rule,
        "stiffness": result.K.tolist() if answered else None,
        "elastic": result.elastic.tolist() if answered else None,
        "geometric": result.geometric.tolist() if answered else None,
        "of_forces": result.of_forces.tolist() if answered else None,
        "rank": int(result.rank) if answered else None,
        "rank_of_structure_matrix": int(result.held_rank) if answered else None,
        "free_motions": [str(motion) for motion in result.free_motions],
        "unstable_motions": [str(motion) for motion in result.unstable_motions],
        "missing_wrench": result.missing_wrench.tolist() if answered else None,
        "robostiff": __version__,
    }


def cable_response_data(result: CableResponse) -> dict[str, Any]:
    """What `cable_response` answered, as plain data."""
    event = result.first_slack
    moved = result.displacement
    return {
        "robot": result.before.name,
        "status": str(result.status),
        "advice": list(result.advice),
        "load": result.load.tolist(),
        "carried": result.carried,
        "displacement": None if moved is None else moved.tolist(),
        "slack": list(result.slack) if result.has_answer else None,
        "first_slack": None if event is None else {"cable": event.cable, "factor": event.factor},
        "before": cable_stiffness_data(result.before),
        "after": None if result.after is None else cable_stiffness_data(result.after),
        "robostiff": __version__,
    }
