"""Stiffness of cable robots, and loads that their cables carry."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

import numpy as np

from robostiff.markup import (
    STIFFNESS_UNITS,
    Block,
    Cell,
    Facts,
    Number,
    Page,
    Paragraph,
    Table,
    number,
)
from robostiff.page.data import UNDER_LOAD, order, page_data
from robostiff.page.stiffness import load_table, named, posed_page, stiffness_matrix

if TYPE_CHECKING:
    from robostiff.analysis import CableResponse, CableStiffness


def cable_stiffness_page(result: CableStiffness) -> Page:
    """Tensions and stiffness of a cable robot at a single pose."""
    answered = bool(np.all(result.answered))
    blocks = _balanced(result)
    if answered:
        blocks += [tension_table(result), Facts((("tensions", result.rule),))]
        blocks += [stiffness_matrix(result), *_rank_and_motions(result)]
    known = ("elastic", "geometric", "of_forces", "missing_wrench")
    return posed_page(
        result,
        blocks,
        {
            "pose": result.pose,
            "reference_point": result.reference_point,
            "order": order(result.space),
            "units": {
                "length": "m",
                "angle": "rad",
                "tension": "N",
                "stiffness": asdict(STIFFNESS_UNITS),
            },
            "wrench": result.wrench,
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
            "stiffness": result.K if answered else None,
            "rank": int(result.rank) if answered else None,
            "rank_of_structure_matrix": int(result.held_rank) if answered else None,
            "free_motions": [str(motion) for motion in result.free_motions],
            "unstable_motions": [str(motion) for motion in result.unstable_motions],
            **{name: getattr(result, name) if answered else None for name in known},
        },
    )


def cable_response_page(found: CableResponse) -> Page:
    """A cable robot under a load: where it rests, tensions, and stiffness there."""
    before, after, event = found.before, found.after, found.first_slack
    load = named(before.space.wrench_order, found.load, "N", "N m")
    blocks = _balanced(before)
    if found.has_answer:
        blocks += cable_load_blocks(found)
    else:
        blocks.append(Facts((("load", load),)))
        if np.all(before.answered):
            carried = f"{number(found.carried)} of the load"
            facts = (("tensions", before.rule), ("carried", carried), *_first_slack(found))
            blocks += [tension_table(before), Facts(facts)]
    return posed_page(
        before,
        blocks,
        {
            "order": order(before.space),
            "units": UNDER_LOAD,
            "load": found.load,
            "carried": found.carried,
            "displacement": found.displacement,
            "slack": found.slack if found.has_answer else None,
            "first_slack": None if event is None else asdict(event),
            "before": page_data(cable_stiffness_page(before)),
            "after": None if after is None else page_data(cable_stiffness_page(after)),
        },
        found,
    )


def cable_load_blocks(found: CableResponse) -> list[Block]:
    """A load that cables carry: displacement, tensions, the first slack cable, K of taut cables."""
    before, after = found.before, found.after
    if after is None or found.displacement is None:
        return []
    length = float(before.placed.characteristic_length)
    moved = before.space.without_rounding(found.displacement, length)
    table = load_table(before.space, found.load, moved)
    load = named(before.space.wrench_order, found.load, "N", "N m")
    lines = [f"load:       {load}", table.lines[0].replace("deflection:", "moved by:  ")]
    return [
        replace(table, lines=lines),
        tension_table(before, after),
        Facts(
            (
                ("tensions", before.rule),
                ("slack", ", ".join(found.slack) or "none"),
                *_first_slack(found),
            )
        ),
        replace(stiffness_matrix(after), symbol="K under the load, of the taut cables"),
        *_rank_and_motions(after),
    ]


def tension_table(result: CableStiffness, after: CableStiffness | None = None) -> Table:
    """Length, stiffness and tension of every cable, and its tension under a load."""
    header = ["cable", "length [m]", "stiffness [N/m]", "tension [N]"]
    columns = [result.placed.lengths, result.axial, result.tensions]
    if after is not None:
        header.append("under load [N]")
        columns.append(after.tensions)
    rows: list[list[Cell]] = [
        [name, *(Number(float(column[i])) for column in columns)]
        for i, name in enumerate(result.cable_names)
    ]
    return Table(header, rows)


def _balanced(result: CableStiffness) -> list[Block | None]:
    """The wrench beside the weight that the cables balance."""
    words = named(result.space.wrench_order, result.wrench, "N", "N m")
    return [Facts((("balanced", words),))] if np.any(result.wrench) else []


def _first_slack(found: CableResponse) -> tuple[tuple[str, str], ...]:
    event = found.first_slack
    if event is None:
        return ()
    return (("first slack", f"{event.cable}, at {number(event.factor)} times the load"),)


def _rank_and_motions(result: CableStiffness) -> list[Block]:
    rank = f"rank {int(result.rank)} of {result.space.size}"
    motions = [
        *(("free", str(motion)) for motion in result.free_motions),
        *(("unstable", str(motion)) for motion in result.unstable_motions),
    ]
    words = Paragraph(f"{rank}, {int(result.held_rank)} by stretching of cables")
    return [words, Facts(tuple(motions))] if motions else [words]
