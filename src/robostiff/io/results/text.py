"""Results as text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.analysis import Deflection, RobotStiffness
from robostiff.elastostatics import Status
from robostiff.markup import number, row, shown_matrix
from robostiff.spatial import Space


def stiffness_text(result: RobotStiffness) -> str:
    """What `stiffness` answered at a single pose, as lines of text.

    Parameters
    ----------
    result : RobotStiffness
        Of a single pose.
    """
    lines = [f"{result.name}, {about(result)}", f"status: {result.status}"]
    if np.all(result.answered):
        lines += ["", "K_C [N/m, N/rad, N m/rad]:"]
        lines += matrix_lines(result.K, result.space.wrench_order, result.space.twist_order)
    if Status.UNREACHABLE not in result.status:
        lines += ["", f"rank {int(result.rank)} of {result.space.size}"]
        lines += [f"free: {motion}" for motion in result.free_motions]
        lines += [f"redundant passive joint: {name}" for name in result.redundant_joints]
        lines += [f"rigid direction: {row(wrench)}" for wrench in result.rigid_directions]
        lines.append(f"decided by: {result.decision}")
    lines.append(f"method: {result.method.name}, {result.method.equation}")
    lines += [f"advice: {advice}" for advice in result.advice]
    return "\n".join(lines)


def deflection_text(result: Deflection, most: int = 10) -> str:
    """What `deflection` answered, as lines of text.

    Parameters
    ----------
    result : Deflection
    most : int
        How many parts to list, those with the largest energy first.
    """
    answer = result.stiffness
    lines = [f"{answer.name}, {about(answer)}", f"status: {result.status}"]
    lines.append(f"load:       {named(answer.space.wrench_order, result.wrench, 'N', 'N m')}")
    if result.has_answer:
        shown = shown_twist(result.twist, answer.space)
        lines.append(f"deflection: {named(answer.space.twist_order, shown, 'um', 'urad')}")
        lines += [f"free:       {motion}" for motion in answer.free_motions]
        if result.energy > 0:
            lines += ["", f"who bends (elastic energy {result.energy:.4g} J):"]
            lines += [f"{100 * p.share:7.2f} %  {p.leg}/{p.part}" for p in result.parts[:most]]
            if len(result.parts) > most:
                rest = sum(p.share for p in result.parts[most:])
                lines.append(f"{100 * rest:7.2f} %  {len(result.parts) - most} more parts")
        if result.actuators:
            lines += ["", "load on the actuators [N or N m]:"]
            lines += [f"{a.load:12.5g}  {a.leg}/{a.joint}" for a in result.actuators]
    lines += [f"advice: {advice}" for advice in result.advice]
    return "\n".join(lines)


def about(result: RobotStiffness) -> str:
    """Where the answer holds, in words."""
    point = f"about ({row(result.reference_point)}) m, world axes"
    if result.pose is None:
        return f"snapshot {point}"
    return f"pose [{row(result.pose)}] (m, rad) {point}"


def shown_twist(twist: np.ndarray, space: Space) -> np.ndarray:
    """Twist in micrometres and microradians; what is rounding beside the others is zero."""
    shown = 1e6 * twist
    for part in (slice(None, space.translations), slice(space.translations, None)):
        largest = np.max(np.abs(shown[part]))
        shown[part] = np.where(np.abs(shown[part]) < 1e-9 * largest, 0.0, shown[part])
    return shown


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
