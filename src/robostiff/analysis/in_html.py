"""Results in HTML, as notebooks and reports show them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robostiff.elastostatics import Status
from robostiff.markup import (
    COMPLIANCE_UNITS,
    STIFFNESS_UNITS,
    element,
    escaped,
    labelled_matrix,
    listing,
    number_html,
    row,
    table,
)

if TYPE_CHECKING:
    from robostiff.analysis.deflection_under_load import Deflection
    from robostiff.analysis.result import RobotStiffness

_MOST_PARTS = 10


def stiffness_html(result: RobotStiffness) -> str:
    """K with labels and units, rank, free motions and advice; of a batch, how many have K."""
    if result.batch_shape:
        return element("p", escaped(repr(result)))
    parts = [head(result, result.status)]
    if np.all(result.answered):
        parts.append(stiffness_matrix(result))
    if Status.UNREACHABLE not in result.status:
        parts.append(element("p", f"rank {int(result.rank)} of {result.space.size}"))
        parts.append(free_motion_table(result))
    parts.append(listing(result.advice))
    return element("div", "".join(parts), class_="robostiff-stiffness")


def deflection_html(result: Deflection) -> str:
    """Displacement under the load, and the parts that bend most."""
    answer = result.stiffness
    parts = [head(answer, result.status)]
    if result.has_answer:
        parts.append(displacement_table(result))
        if result.energy > 0:
            parts.append(energy_table(result))
    parts.append(listing(result.advice))
    return element("div", "".join(parts), class_="robostiff-deflection")


def head(result: RobotStiffness, status: Status) -> str:
    """Name, where it holds, and status."""
    place = f"about ({row(result.reference_point)}) m, world axes"
    if result.pose is not None:
        place = f"pose [{row(result.pose)}] (m, rad) {place}"
    name = element("b", escaped(result.name))
    return element("p", f"{name}, {escaped(place)}; status {element('b', escaped(status))}")


def stiffness_matrix(result: RobotStiffness) -> str:
    """K_C, labelled."""
    space = result.space
    return labelled_matrix("K", result.K, space.wrench_order, space.twist_order, STIFFNESS_UNITS)


def compliance_matrix(result: RobotStiffness) -> str:
    """The compliance, labelled; nothing where there is none."""
    C = result.compliance
    if C is None:
        return ""
    space = result.space
    return labelled_matrix("C", C, space.twist_order, space.wrench_order, COMPLIANCE_UNITS)


def free_motion_table(result: RobotStiffness) -> str:
    """Free motions in words, with their twists; nothing where there are none."""
    motions = result.free_motions
    if not motions:
        return ""
    rows = [[escaped(motion), escaped(f"({row(motion.twist)})")] for motion in motions]
    twist = ", ".join(result.space.twist_order)
    return table(["free motion", escaped(f"twist ({twist})")], rows)


def displacement_table(result: Deflection) -> str:
    """Load and displacement, axis by axis."""
    space = result.stiffness.space
    names = zip(space.wrench_order, result.wrench, space.twist_order, result.twist, strict=True)
    rows = [
        [
            escaped(force),
            f"{number_html(F)} {'N m' if force.startswith('M') else 'N'}",
            escaped(motion),
            f"{number_html(1e6 * t)} {'µrad' if motion.startswith('r') else 'µm'}",
        ]
        for force, F, motion, t in names
    ]
    return table(["load", "", "displacement", ""], rows)


def energy_table(result: Deflection, most: int = _MOST_PARTS) -> str:
    """Who bends: the parts with the largest share of the elastic energy."""
    rows = [
        [escaped(f"{part.leg}/{part.part}"), f"{100 * part.share:.2f} %"]
        for part in result.parts[:most]
    ]
    rest = result.parts[most:]
    if rest:
        share = 100 * sum(part.share for part in rest)
        rows.append([f"{len(rest)} more parts", f"{share:.2f} %"])
    return table(["part", "share of the elastic energy"], rows)
