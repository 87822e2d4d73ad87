"""Results as tables and matrices, for notebooks and reports, and in HTML."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robostiff.elastostatics import Status
from robostiff.markup import (
    COMPLIANCE_UNITS,
    STIFFNESS_UNITS,
    Block,
    Bullets,
    Cell,
    LabelledMatrix,
    Number,
    Paragraph,
    Table,
    block_html,
    element,
    escaped,
    number,
    row,
)

if TYPE_CHECKING:
    from robostiff.analysis.cable_stiffness import CableResponse, CableStiffness
    from robostiff.analysis.deflection_under_load import Deflection, PartShare
    from robostiff.analysis.result import Stiffness
    from robostiff.analysis.verification import Verification
    from robostiff.spatial import Space


def stiffness_matrix(result: Stiffness | CableStiffness) -> LabelledMatrix:
    """K_C."""
    space = result.space
    return LabelledMatrix("K", result.K, space.wrench_order, space.twist_order, STIFFNESS_UNITS)


def compliance_matrix(result: Stiffness | CableStiffness) -> LabelledMatrix | None:
    """The compliance; None where there is none."""
    C = result.compliance
    if C is None:
        return None
    space = result.space
    return LabelledMatrix("C", C, space.twist_order, space.wrench_order, COMPLIANCE_UNITS)


def free_motion_table(result: Stiffness | CableStiffness) -> Table | None:
    """Free motions in words, with their twists; None where there are none."""
    motions = result.free_motions
    if not motions:
        return None
    rows = [[str(motion), f"({row(motion.twist)})"] for motion in motions]
    return Table(["free motion", f"twist ({', '.join(result.space.twist_order)})"], rows)


_ROUNDING = 1e-9  # of the largest


def shown_twist(result: Deflection) -> np.ndarray:
    """Displacement (n,) [m, rad]; rounding errors are shown as zero."""
    length = float(result.stiffness.length)
    return without_rounding(result.twist, result.stiffness.space, length)


def without_rounding(moved: np.ndarray, space: Space, length: float = 1.0) -> np.ndarray:
    """A twist (n,) with zero in place of what is rounding, rotations times a length [m]."""
    shifts = np.arange(space.size) < space.translations
    sizes = np.abs(moved) * np.where(shifts, 1.0, length)
    return np.where(sizes < _ROUNDING * np.max(sizes), 0.0, moved)


def shown_loads(result: Deflection) -> list[float]:
    """Loads on the actuators; what is rounding beside them and the forces in joints is zero."""
    length = float(result.stiffness.length)
    arms = [length if a.unit == "N m" else 1.0 for a in result.actuators]
    loads = [abs(a.load) / arm for a, arm in zip(result.actuators, arms, strict=True)]
    largest = max(
        [*loads, *(np.linalg.norm(own.wrench[:3]) for own in result.reactions)], default=0
    )
    own = zip(result.actuators, loads, strict=True)
    return [a.load if load > _ROUNDING * largest else 0.0 for a, load in own]


def displacement_table(result: Deflection) -> Table:
    """Load and displacement, axis by axis."""
    return load_table(result.stiffness.space, result.wrench, shown_twist(result))


def load_table(space: Space, wrench: np.ndarray, moved: np.ndarray) -> Table:
    """A wrench (n,) [N, N m] and a twist (n,) [m, rad], axis by axis."""
    names = zip(space.wrench_order, wrench, space.twist_order, moved, strict=True)
    rows = [
        [
            force,
            Number(float(F), "N m" if force.startswith("M") else "N"),
            motion,
            small_motion(motion, t),
        ]
        for force, F, motion, t in names
    ]
    return Table(["load", "", "displacement", ""], rows)


def small_motion(motion: str, value: float) -> Number:
    """One component of a twist [m, rad] in millionths."""
    return Number(1e6 * float(value), "µrad" if motion.startswith("r") else "µm")


def tension_table(result: CableStiffness) -> Table:
    """Tension and stiffness of every cable."""
    rows = [
        [name, Number(float(tension), "N"), Number(float(axial), "N/m")]
        for name, tension, axial in zip(
            result.cable_names, result.tensions, result.axial, strict=True
        )
    ]
    return Table(["cable", "tension", "stiffness"], rows)


def cable_load_blocks(found: CableResponse) -> list[Block]:
    """A load that cables carry: displacement, tensions, the first slack cable, K of taut cables."""
    before, after = found.before, found.after
    if after is None or found.displacement is None:
        return []
    length = float(before.placed.characteristic_length)
    moved = without_rounding(found.displacement, before.space, length)
    rows: list[list[Cell]] = [
        [name, Number(float(t), "N"), Number(float(now), "N") if now else "slack"]
        for name, t, now in zip(before.cable_names, before.tensions, after.tensions, strict=True)
    ]
    tensions = Table(["cable", "without the load", "under the load"], rows)
    blocks: list[Block] = [load_table(before.space, found.load, moved), tensions]
    if found.first_slack is not None:
        at = number(found.first_slack.factor)
        blocks.append(
            Paragraph(f"First slack cable: {found.first_slack.cable}, at {at} times the load.")
        )
    return [*blocks, replace(stiffness_matrix(after), symbol="K under load")]


def cable_load_html(found: CableResponse) -> str:
    """A load on a cable robot, as `cable_load_blocks`, with advice."""
    blocks = [*cable_load_blocks(found), Bullets(tuple(found.advice))]
    return element("div", head_html(found.before, found.status) + blocks_html(blocks))


def energy_table(parts: Sequence[PartShare], most: int) -> Table:
    """The parts with the largest share of the elastic energy."""
    most += len(parts) == most + 1  # a single one has a name rather than a count
    rows = [[part.name, Number(100 * part.share, "%")] for part in parts[:most]]
    rest = parts[most:]
    if rest:
        share = 100 * sum(part.share for part in rest)
        rows.append([f"{len(rest)} more parts", Number(share, "%")])
    return Table(["part", "share of the elastic energy"], rows)


def actuator_table(result: Deflection) -> Table | None:
    """Loads and deflections of the actuators; None where there are none."""
    if not result.actuators:
        return None
    rows = [
        [
            a.name,
            Number(float(load), a.unit),
            Number(1e6 * a.travel if load else 0.0, "µrad" if a.unit == "N m" else "µm"),
        ]
        for a, load in zip(result.actuators, shown_loads(result), strict=True)
    ]
    return Table(["actuator", "load", "deflection"], rows)


MOST_PARTS = 10


def stiffness_html(result: Stiffness | CableStiffness, more: Block | None = None) -> str:
    """K with labels and units, rank, free motions, `more` and advice; of a batch, how many."""
    if result.batch_shape:
        return element("p", escaped(repr(result)))
    blocks: list[Block | None] = []
    if np.all(result.answered):
        blocks.append(stiffness_matrix(result))
    if result.rank >= 0:
        blocks.append(Paragraph(f"rank {int(result.rank)} of {result.space.size}"))
        blocks.append(free_motion_table(result))
    blocks += [more, Bullets(tuple(result.advice))]
    return element("div", head_html(result, result.status) + blocks_html(blocks))


def deflection_html(result: Deflection) -> str:
    """Displacement under the load, and the parts with the most elastic energy."""
    blocks: list[Block | None] = []
    if result.has_answer:
        blocks.append(displacement_table(result))
        if result.energy > 0:
            blocks.append(energy_table(result.parts, MOST_PARTS))
    blocks.append(Bullets(tuple(result.advice)))
    return element("div", head_html(result.stiffness, result.status) + blocks_html(blocks))


def verification_html(result: Verification) -> str:
    """Every method with its distance from the reference, and whether all agree."""
    reference = result.reference
    rows = [
        [
            own.method,
            "" if own.distance is None else Number(own.distance),
            own.outcome.value,
            own.reason,
        ]
        for own in result.comparisons
    ]
    verdict = "The methods agree" if result.agree else "The methods do not agree"
    allowed = f"{verdict}; largest distance allowed: {result.agreement:g}."
    blocks: list[Block | None] = [
        Paragraph(f"compared with: {reference.method.name}, rank {int(reference.rank)}"),
        Table(["method", "distance", "outcome", ""], rows),
        Paragraph(allowed),
    ]
    return element("div", head_html(reference, reference.status) + blocks_html(blocks))


def blocks_html(blocks: Sequence[Block | None]) -> str:
    """Blocks one after the other; None is left out."""
    return "".join(block_html(block) for block in blocks if block is not None)


def head_html(result: Stiffness | CableStiffness, status: Status) -> str:
    """Name, pose, reference point and status."""
    place = f"about ({row(result.reference_point)}) m, world axes"
    if result.pose is not None:
        place = f"pose [{row(result.pose)}] (m, rad) {place}"
    name = element("b", escaped(result.name))
    return element("p", f"{name}, {escaped(place)}; status {element('b', escaped(status))}")
