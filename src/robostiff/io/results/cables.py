"""Results of cable robots as text, and as plain data for JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from robostiff.analysis import CableResponse, CableStiffness
from robostiff.elastostatics.tolerance import scaling
from robostiff.io.results.stiffness import head, matrix_lines, named, order, plain
from robostiff.markup import STIFFNESS_UNITS, number, row, text_of


def cable_stiffness_data(result: CableStiffness) -> dict[str, Any]:
    """The result of `cable_stiffness` at a single pose, JSON-ready; what there is not is null."""
    answered = bool(np.all(result.answered))
    return {
        **head(result.name, result),
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
        **{
            name: getattr(result, name).tolist() if answered else None
            for name in ("elastic", "geometric", "of_forces")
        },
        "rank": int(result.rank) if answered else None,
        "rank_of_structure_matrix": int(result.held_rank) if answered else None,
        "free_motions": [str(motion) for motion in result.free_motions],
        "unstable_motions": [str(motion) for motion in result.unstable_motions],
        "missing_wrench": result.missing_wrench.tolist() if answered else None,
    }


def cable_response_data(result: CableResponse) -> dict[str, Any]:
    """The result of `cable_response`, as plain data."""
    event = result.first_slack
    moved = result.displacement
    return {
        **head(result.before.name, result),
        "order": order(result.before.space),
        "units": {"length": "m", "angle": "rad", "force": "N", "moment": "N m"},
        "load": result.load.tolist(),
        "carried": result.carried,
        "displacement": plain(moved),
        "slack": list(result.slack) if result.has_answer else None,
        "first_slack": None if event is None else {"cable": event.cable, "factor": event.factor},
        "before": cable_stiffness_data(result.before),
        "after": None if result.after is None else cable_stiffness_data(result.after),
    }


def cable_stiffness_text(result: CableStiffness) -> str:
    """The result of `cable_stiffness` at a single pose, as lines of text."""
    lines = [*_head(result, str(result.status)), *_tension_lines(result)]
    if np.all(result.answered):
        lines += ["", f"K [{STIFFNESS_UNITS}]:"]
        lines += matrix_lines(result.K, result.space.wrench_order, result.space.twist_order)
        lines += ["", *_rank_and_motions(result)]
    lines += [f"advice: {advice}" for advice in result.advice]
    return text_of(lines)


def cable_response_text(result: CableResponse) -> str:
    """The result of `cable_response`, as lines of text."""
    before = result.before
    space = before.space
    lines = _head(before, str(result.status))
    lines.append(f"load:       {named(space.wrench_order, result.load, 'N', 'N m')}")
    if result.after is not None and result.displacement is not None:
        lengths = result.displacement * scaling(before.placed.characteristic_length, before.space)
        kept = np.abs(lengths) > 1e-9 * np.abs(lengths).max()  # less is rounding
        shown = 1e6 * np.where(kept, result.displacement, 0.0)
        lines.append(f"moved by:   {named(space.twist_order, shown, 'um', 'urad')}")
        lines += _tension_lines(before, result.after)
        lines += ["", f"slack: {', '.join(result.slack) or 'none'}"]
    elif np.all(before.answered):
        lines += _tension_lines(before)
        lines += ["", f"carried: {number(result.carried)} of the load"]
    if result.first_slack is not None:
        event = result.first_slack
        lines.append(f"first slack: {event.cable}, at {number(event.factor)} times the load")
    if result.after is not None:
        lines += ["", f"K under the load, of the taut cables [{STIFFNESS_UNITS}]:"]
        lines += matrix_lines(result.after.K, space.wrench_order, space.twist_order)
        lines += ["", *_rank_and_motions(result.after)]
    lines += [f"advice: {advice}" for advice in result.advice]
    return text_of(lines)


def _head(result: CableStiffness, status: str) -> list[str]:
    where = f"about ({row(result.reference_point)}) m, world axes"
    lines = [f"{result.name}, pose [{row(result.pose)}] (m, rad) {where}", f"status: {status}"]
    if np.any(result.wrench):
        lines.append(f"balanced:   {named(result.space.wrench_order, result.wrench, 'N', 'N m')}")
    return lines


def _tension_lines(before: CableStiffness, after: CableStiffness | None = None) -> list[str]:
    if not np.all(before.answered):
        return []
    columns = ["length [m]", "stiffness [N/m]", "tension [N]"]
    values = [before.placed.lengths, before.axial, before.tensions]
    if after is not None:
        columns.append("under load [N]")
        values.append(after.tensions)
    width = max(5, *(len(name) for name in before.cable_names))
    lines = ["", f"{'cable':<{width}}" + "".join(f"{column:>17}" for column in columns)]
    for i, name in enumerate(before.cable_names):
        cells = "".join(f"{number(float(column[i])):>17}" for column in values)
        lines.append(f"{name:<{width}}{cells}")
    lines.append(f"tensions: {before.rule}")
    return lines


def _rank_and_motions(result: CableStiffness) -> list[str]:
    rank = f"rank {int(result.rank)} of {result.space.size}"
    return [
        f"{rank}, {int(result.held_rank)} by stretching of cables",
        *(f"free: {motion}" for motion in result.free_motions),
        *(f"unstable: {motion}" for motion in result.unstable_motions),
    ]
