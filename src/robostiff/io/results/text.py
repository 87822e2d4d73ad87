"""Results as lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from robostiff.analysis import RobotStiffness
from robostiff.analysis.result_tables import shown_loads, shown_twist
from robostiff.elastostatics import Status
from robostiff.markup import STIFFNESS_UNITS, number, row, shown_matrix, text_of

if TYPE_CHECKING:
    from robostiff.analysis import Deflection, PartShare, RobotStiffness


_NAMED = 5e-5  # of the energy: a smaller part would read 0.00 %


def stiffness_text(result: RobotStiffness) -> str:
    """The result of `stiffness` at a single pose, as lines of text.

    Parameters
    ----------
    result : RobotStiffness
        Of a single pose.
    """
    lines = [f"{result.name}, {about(result)}", *posture_lines(result), f"status: {result.status}"]
    if np.all(result.answered):
        lines += ["", f"K_C [{STIFFNESS_UNITS}]:"]
        lines += matrix_lines(result.K, result.space.wrench_order, result.space.twist_order)
    if Status.UNREACHABLE not in result.status:
        lines += ["", f"rank {int(result.rank)} of {result.space.size}"]
        lines += [f"free: {motion}" for motion in result.free_motions]
        lines += [f"redundant passive joint: {name}" for name in result.redundant_joints]
        lines += [f"rigid direction: {row(wrench)}" for wrench in result.rigid_directions]
        lines.append(f"decided by: {result.decision}")
    lines.append(f"method: {result.method.name}, {result.method.equation}")
    lines += [f"advice: {advice}" for advice in result.advice]
    return text_of(lines)


def deflection_text(result: Deflection, most: int = 10) -> str:
    """The result of `deflection`, as lines of text.

    Parameters
    ----------
    result : Deflection
    most : int
        How many parts to list, those with the largest energy first.
    """
    answer = result.stiffness
    lines = [f"{answer.name}, {about(answer)}", *posture_lines(answer), f"status: {result.status}"]
    load = named(answer.space.wrench_order, result.wrench, "N", "N m")
    if result.work_of_loads is not None:
        load = f"{'' if load == 'none' else f'{load}; '}forces or weights at bodies"
    lines.append(f"load:       {load}")
    if result.has_answer:
        shown = 1e6 * shown_twist(result)
        lines.append(f"deflection: {named(answer.space.twist_order, shown, 'um', 'urad')}")
        lines += [f"free:       {motion}" for motion in answer.free_motions]
        if result.energy > 0:
            lines += share_lines(result.energy, result.parts, most)
        if result.actuators:
            lines += ["", "load on the actuators:"]
            loads = zip(shown_loads(result), result.actuators, strict=True)
            lines += [load_line(load, a.unit, f"{a.leg}/{a.joint}") for load, a in loads]
    lines += [f"advice: {advice}" for advice in result.advice]
    return text_of(lines)


def about(result: RobotStiffness) -> str:
    """Pose, reference point and axes as text."""
    point = f"about ({row(result.reference_point)}) m, world axes"
    if result.pose is None:
        return f"snapshot {point}"
    return f"pose [{row(result.pose)}] (m, rad) {point}"


def posture_lines(result: RobotStiffness) -> list[str]:
    """Joint coordinates of a robot with one leg, which a pose may not determine.

    With passive joints those of the drives, by name.
    """
    if len(result.joint_coordinates) != 1 or Status.UNREACHABLE in result.status:
        return []
    ((leg, q),) = result.joint_coordinates.items()
    names = result.joint_names.get(leg, [leg] * len(q))
    drives = [
        f"{name}={value:.5g}"
        for name, value in zip(names, q, strict=True)
        if f"{leg}/{name}" not in result.passive_joint_names
    ]
    if len(drives) == len(q):
        return [f"joints [{row(q)}] (m, rad)"]
    return [f"drives at {', '.join(drives)} (m, rad)"] if drives else []


def named_parts(parts: Sequence[PartShare], most: int) -> tuple[list[PartShare], list[PartShare]]:
    """Parts to name, of parts with the largest energy first, and the rest."""
    named_ones = [part for part in parts[:most] if part.share >= _NAMED]
    if len(named_ones) == len(parts) - 1:  # a single one has a name rather than a count
        named_ones = list(parts)
    return named_ones, list(parts[len(named_ones) :])


def share_lines(energy: float, parts: Sequence[PartShare], most: int) -> list[str]:
    """The elastic energy, and how much of it each part has."""
    named_ones, rest = named_parts(parts, most)
    lines = ["", f"elastic energy {energy:.4g} J, by part:"]
    lines += [f"{100 * p.share:7.2f} %  {p.leg}/{p.part}" for p in named_ones]
    if rest:
        share = 100 * sum(p.share for p in rest)
        lines.append(f"{share:7.2f} %  {len(rest)} more parts")
    return lines


def load_line(load: float, unit: str, name: str) -> str:
    """A load with its unit and the drive that it is on."""
    return f"{load:12.5g} {unit:<4} {name}"


def matrix_lines(K: np.ndarray, rows: Sequence[str], columns: Sequence[str]) -> list[str]:
    """A labelled matrix, one line a row."""
    lines = ["    " + "".join(f"{name:>12}" for name in columns)]
    for name, values in zip(rows, shown_matrix(K), strict=True):
        lines.append(f"{name:>4}" + "".join(f"{number(value):>12}" for value in values))
    return lines


def named(names: Sequence[str], values: np.ndarray, unit: str, angular: str) -> str:
    """Values with their names and units, zeros left out."""
    parts = [
        f"{name} {value:.5g} {angular if name[0] in 'Mr' else unit}"
        for name, value in zip(names, values, strict=True)
        if value != 0
    ]
    return ", ".join(parts) or "none"
