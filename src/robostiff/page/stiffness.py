"""Stiffness, deflection and verification of robots and of cable robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis import Stiffness
from robostiff.elastostatics import Status
from robostiff.markup import (
    COMPLIANCE_UNITS,
    STIFFNESS_UNITS,
    Block,
    Facts,
    LabelledMatrix,
    Number,
    Page,
    Paragraph,
    Table,
    number,
    row,
)
from robostiff.page.of_result import UNDER_LOAD, attributes, attributes_of, order, page_data
from robostiff.spatial import Space

if TYPE_CHECKING:
    from robostiff.analysis import CableResponse, CableStiffness, CableTensions, Deflection
    from robostiff.analysis.deflection_under_load import PartShare
    from robostiff.analysis.verification import Verification


MOST_PARTS = 10
_NAMED = 5e-5  # of the energy: a smaller part would read 0.00 %
_NOTHING = 1e-12  # of the energy: rounding


def stiffness_page(result: Stiffness) -> Page:
    """The stiffness of a robot at a single pose."""
    reached, answered = Status.UNREACHABLE not in result.status, bool(np.all(result.answered))
    rank, blocks, facts = None, [], []
    if answered:
        blocks.append(replace(stiffness_matrix(result), symbol="K_C"))
    if reached:
        rank = int(result.rank)
        blocks += [Paragraph(f"rank {rank} of {result.space.size}"), free_motion_table(result)]
        facts += [("redundant passive joint", name) for name in result.redundant_joints]
        for wrench in result.rigid_directions:  # a unit force, or a moment where there is no force
            force, moment = np.split(wrench, [result.space.translations])
            size = np.linalg.norm(force)
            pulls = size * float(result.length) > 1e-9 * np.linalg.norm(moment)
            unit = wrench / (size if pulls else np.linalg.norm(moment))
            unit = np.round(unit * np.sign(unit[np.argmax(np.abs(unit))]), 9) + 0.0
            words = named_values(result.space.wrench_order, unit, "N", "N m")
            facts.append(("rigid direction", words))
        facts.append(("decided by", str(result.decision)))
    facts.append(("method", f"{result.method.name}, {result.method.equation}"))
    return posed_page(
        result,
        [*blocks, Facts(tuple(facts))],
        {
            **_posture_data(result),
            "units": {
                "length": "m",
                "angle": "rad",
                "stiffness": asdict(STIFFNESS_UNITS),
                "compliance": asdict(COMPLIANCE_UNITS),
            },
            "stiffness": result.K if answered else None,
            "compliance": result.compliance,
            "rank": rank,
            "free_motions": result.free_motions,
            "rigid_directions": result.rigid_directions if reached else [],
            "redundant_joints": result.redundant_joints if reached else [],
            "method": result.method.name,
            "equation": result.method.equation,
            "decided_by": str(result.decision) if reached else None,
        },
        posture=_posture(result),
    )


def deflection_page(result: Deflection) -> Page:
    """The deflection of a robot at a pose."""
    answer = result.stiffness
    reached = Status.UNREACHABLE not in answer.status
    load = named_values(answer.space.wrench_order, result.wrench, "N", "N m")
    if result.work_of_loads:  # none of springs between bodies
        load = f"{'' if load == 'none' else f'{load}; '}forces or weights at bodies"
    blocks: list[Block | None] = []
    if result.work_of_loads or not result.has_answer:
        blocks.append(Facts((("load", load),)))
    if result.has_answer:
        blocks += [displacement_table(result), free_motion_table(answer)]
        if result.energy > 0:
            blocks.append(energy_table(result.parts, result.energy))
        blocks.append(actuator_table(result))
    return posed_page(
        answer,
        blocks,
        {
            **_posture_data(answer),
            "units": UNDER_LOAD,
            "wrench": result.wrench,
            "deflection": result.twist if result.has_answer else None,
            "energy": result.energy if result.has_answer else None,
            "parts": attributes_of(result.parts, "leg part energy share"),
            "actuators": attributes_of(result.actuators, "leg joint load travel unit"),
            "reactions": attributes_of(result.reactions, "leg joint wrench point"),
            "free_motions": [str(motion) for motion in answer.free_motions] if reached else [],
        },
        result,
        posture=_posture(answer),
    )


def verification_page(result: Verification) -> Page:
    """Every method with its distance from the reference, and whether all agree."""
    reference = result.reference
    rank, size, form = int(reference.rank), reference.space.size, reference.method
    rows = []
    for comparison in result.comparisons:
        distance = "" if comparison.distance is None else Number(comparison.distance)
        rows.append([comparison.method, distance, comparison.outcome.value, comparison.reason])
    verdict = "agree" if result.agree else "DISAGREE"
    compared = attributes_of(result.comparisons, "method outcome distance rank reason")
    return Page(
        reference.name,
        place_of(reference),
        f"{reference.status}, rank {rank} of {size}",
        [
            Facts((("compared with", f"{form.name}, {form.equation}"),)),
            Table(["method", "distance", "outcome", ""], rows),
            Paragraph(f"methods {verdict} (largest distance allowed {number(result.agreement)})"),
        ],
        data={
            "pose": reference.pose,
            "status": reference.status,
            "rank": rank,
            "compared_with": form.name,
            "comparisons": [{**entry, "outcome": entry["outcome"].value} for entry in compared],
            "agreement": result.agreement,
            "agree": result.agree,
        },
    )


def posed_page(
    result: Stiffness | CableStiffness | CableTensions,
    blocks: Sequence[Block | None],
    data: Mapping[str, Any],
    answer: Any = None,
    posture: str = "",
) -> Page:
    """The page of a result at a pose, with status and advice of what is answered there."""
    of, place = result if answer is None else answer, place_of(result)
    return Page(result.name, place, of.status, blocks, of.advice, data, posture=posture)


def place_of(result: Stiffness | CableStiffness | CableTensions) -> str:
    """Pose, reference point and axes, behind a name."""
    point = f"about ({row(result.reference_point)}) m, world axes"
    if result.pose is None:
        return f", snapshot {point}"
    return f", pose [{row(result.pose)}] (m, rad) {point}"


def _posture(result: Stiffness) -> str:
    """Joint coordinates of a robot with one leg, which a pose may not determine.

    With passive joints those of the drives, by name.
    """
    if len(result.joint_coordinates) != 1 or Status.UNREACHABLE in result.status:
        return ""
    ((leg, q),) = result.joint_coordinates.items()
    names = result.details().joint_names.get(leg, [leg] * len(q))
    drives = [
        f"{name}={value}"
        for name, value in zip(names, row(q).split(", "), strict=True)
        if f"{leg}/{name}" not in result.details().passive_joint_names
    ]
    if len(drives) == len(q):
        return f"joints [{row(q)}] (m, rad)"
    return f"drives at {', '.join(drives)} (m, rad)" if drives else ""


def _posture_data(answer: Stiffness) -> dict[str, object]:
    """Where a robot is, and the order of what follows."""
    return {
        "pose": answer.pose,
        "joint_coordinates": dict(answer.joint_coordinates),
        "joint_names": dict(answer.details().joint_names),
        "reference_point": answer.reference_point,
        "order": order(answer.space),
    }


def stiffness_matrix(result: Stiffness | CableStiffness) -> LabelledMatrix:
    """K_C."""
    space = result.space
    return LabelledMatrix("K", result.K, space.wrench_order, space.twist_order, STIFFNESS_UNITS)


def free_motion_table(result: Stiffness | CableStiffness) -> Table | None:
    """Free motions in words, with their twists; None where there are none."""
    motions = result.free_motions
    if not motions:
        return None
    rows = [[str(motion), f"({row(motion.twist)})"] for motion in motions]
    return Table(["free motion", f"twist ({', '.join(result.space.twist_order)})"], rows)


def shown_twist(result: Deflection) -> np.ndarray:
    """Displacement (n,) [m, rad]; rounding errors are shown as zero."""
    length = float(result.stiffness.length)
    return result.stiffness.space.without_rounding(result.twist, length)


def displacement_table(result: Deflection) -> Table:
    """Load and displacement, axis by axis."""
    return load_table(result.stiffness.space, result.wrench, shown_twist(result))


def load_table(space: Space, wrench: np.ndarray, moved: np.ndarray) -> Table:
    """A wrench (n,) [N, N m] and a twist (n,) [m, rad], axis by axis."""
    rows = [
        [force, Number(float(F), unit), motion, small_motion(motion, t)]
        for force, F, unit, motion, t in zip(
            space.wrench_order, wrench, space.wrench_units, space.twist_order, moved, strict=True
        )
    ]
    return Table(["load", "", "displacement", ""], rows)


def small_motion(motion: str, value: float) -> Number:
    """One component of a twist [m, rad] in millionths."""
    return Number(1e6 * float(value), "µrad" if motion.startswith("r") else "µm")


def energy_table(parts: Sequence[PartShare], energy: float, most: int | None = MOST_PARTS) -> Table:
    """The parts with the largest share of the elastic energy [J]; all where most is None."""
    listed = [part for part in parts[:most] if most is None or part.share >= _NAMED]
    if len(listed) == len(parts) - 1:  # a single one has a name rather than a count
        listed = list(parts)
    shown = [(part.name, part.share) for part in listed]
    if rest := parts[len(listed) :]:
        shown.append((f"{len(rest)} more parts", sum(part.share for part in rest)))
    return Table(
        ["part", "share of the elastic energy"],
        [[name, Number(100 * share if share > _NOTHING else 0.0, "%")] for name, share in shown],
        f"elastic energy {number(energy)} J, by part:",
    )


def actuator_table(result: Deflection) -> Table | None:
    """Loads and deflections of the actuators; None where there are none.

    What is rounding beside them and the forces in joints is shown as zero.
    """
    if not result.actuators:
        return None
    length = float(result.stiffness.length)
    sizes = [abs(a.load) / (length if a.unit == "N m" else 1.0) for a in result.actuators]
    forces = (float(np.linalg.norm(reaction.wrench[:3])) for reaction in result.reactions)
    least = 1e-9 * max([*sizes, *forces], default=0)
    rows = []
    for a, size in zip(result.actuators, sizes, strict=True):
        load, travel = (float(a.load), 1e6 * a.travel) if size > least else (0.0, 0.0)
        unit = "µrad" if a.unit == "N m" else "µm"
        rows.append([a.name, Number(load, a.unit), Number(travel, unit)])
    return Table(["actuator", "load", "deflection"], rows)


def named_values(names: Sequence[str], values: np.ndarray, unit: str, angular: str) -> str:
    """Values with their names and units, zeros left out."""
    parts = [
        f"{name} {number(value)} {angular if name[0] in 'Mr' else unit}"
        for name, value in zip(names, values, strict=True)
        if value != 0
    ]
    return ", ".join(parts) or "none"


def cable_tensions_page(result: CableTensions) -> Page:
    """Tensions of a cable robot at a single pose."""
    blocks = [*_wrench_beside_weight(result), tension_table(result) if result.feasible else None]
    data = attributes(result, "pose reference_point wrench cable_names values rule")
    return posed_page(result, [*blocks, Facts((("tensions", result.rule),))], data)


def cable_stiffness_page(result: CableStiffness) -> Page:
    """Tensions and stiffness of a cable robot at a single pose."""
    answered = bool(np.all(result.answered))
    blocks = _wrench_beside_weight(result)
    if answered:
        blocks += [tension_table(result), Facts((("tensions", result.rule),))]
        blocks += [stiffness_matrix(result), *_rank_and_motions(result)]
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
            **attributes(result, "elastic geometric of_forces missing_wrench", answered),
        },
    )


def cable_response_page(response: CableResponse) -> Page:
    """A cable robot under a load: where it rests, tensions, and stiffness there."""
    before, after, event = response.before, response.after, response.first_slack
    load = named_values(before.space.wrench_order, response.load, "N", "N m")
    blocks = _wrench_beside_weight(before)
    if response.has_answer:
        blocks += cable_load_blocks(response)
    else:
        blocks.append(Facts((("load", load),)))
        if np.all(before.answered):
            carried = f"{number(response.carried)} of the load"
            facts = (("tensions", before.rule), ("carried", carried), *_first_slack(response))
            blocks += [tension_table(before), Facts(facts)]
    return posed_page(
        before,
        blocks,
        {
            "order": order(before.space),
            "units": UNDER_LOAD,
            "load": response.load,
            "carried": response.carried,
            "displacement": response.displacement,
            "slack": response.slack if response.has_answer else None,
            "first_slack": None if event is None else asdict(event),
            "before": page_data(cable_stiffness_page(before)),
            "after": None if after is None else page_data(cable_stiffness_page(after)),
        },
        response,
    )


def cable_load_blocks(response: CableResponse) -> list[Block]:
    """A load that cables carry: displacement, tensions, the first slack cable, K of taut cables."""
    before, after = response.before, response.after
    if after is None or response.displacement is None:
        return []
    length = float(before.placed.characteristic_length)
    moved = before.space.without_rounding(response.displacement, length)
    slack = ", ".join(response.slack) or "none"
    return [
        load_table(before.space, response.load, moved),
        tension_table(before, after),
        Facts((("tensions", before.rule), ("slack", slack), *_first_slack(response))),
        replace(stiffness_matrix(after), symbol="K under the load, of the taut cables"),
        *_rank_and_motions(after),
    ]


def tension_table(
    result: CableStiffness | CableTensions, after: CableStiffness | None = None
) -> Table:
    """Length, stiffness and tension of every cable, and its tension under a load."""
    columns: dict[str, Any] = {"cable": result.cable_names, "length [m]": result.placed.lengths}
    if (axial := getattr(result, "axial", None)) is not None:
        columns["stiffness [N/m]"] = axial
    columns["tension [N]"] = result.tensions
    if after is not None:
        columns["under load [N]"] = after.tensions
    rows = zip(*columns.values(), strict=True)
    return Table(list(columns), [[name, *map(Number, map(float, own))] for name, *own in rows])


def _wrench_beside_weight(result: CableStiffness | CableTensions) -> list[Block | None]:
    """The wrench beside the weight that the cables balance."""
    words = named_values(result.placed.space.wrench_order, result.wrench, "N", "N m")
    return [Facts((("balanced", words),))] if np.any(result.wrench) else []


def _first_slack(response: CableResponse) -> tuple[tuple[str, str], ...]:
    event = response.first_slack
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
