"""Stiffness indices as text, and as plain data for JSON."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from robostiff.analysis import Stiffness
from robostiff.analysis.free_motion import FreeMotion, direction_in_words
from robostiff.analysis.indices import (
    Centre,
    CollinearStiffness,
    Eigenwrench,
    PrincipalStiffnesses,
    StiffnessIndices,
)
from robostiff.elastostatics import Status
from robostiff.io.results.stiffness import about, head, order, plain
from robostiff.markup import number, row, text_of


def indices_data(result: Stiffness, found: StiffnessIndices | None) -> dict[str, Any]:
    """The result of `indices` at a pose, as plain data; `found` is None where there is no matrix.

    JSON-ready; an entry for each index, with its status and unit; null where there is no value.
    """
    names = [own.name for own in fields(StiffnessIndices) if own.name not in {"result", "length"}]
    return {
        **head(result.name, result),
        "pose": plain(result.pose),
        "reference_point": result.reference_point.tolist(),
        "order": order(result.space),
        "length": None if found is None else found.length,
        "indices": None if found is None else {n: plain(getattr(found, n)) for n in names},
    }


_SMALL = 1e-9


def indices_text(found: StiffnessIndices) -> str:
    """The result of `indices`, as lines of text."""
    result = found.result
    worst, ratio = found.worst_deflection, found.anisotropy
    lines = [f"{result.name}, {about(result)}", f"status: {result.status}"]
    lines += ["", "stiffness along world axes [N/m]     free        held"]
    for along in found.along_axes:
        moves = "  moves freely" if Status.UNBALANCED in along.status else ""
        values = f"{number(along.free):>14}{number(along.held):>12}{moves}"
        lines.append(f"  {direction_in_words(along.direction):<25}{values}")
    lines += ["", f"principal stiffness: {found.principal.about}"]
    lines += _loads(found.principal)
    lines += ["", f"collinear stiffness: {found.collinear.about}"]
    lines += _loads(found.collinear)
    lines += ["", f"worst deflection {worst.about}"]
    along, axis = worst.translational_direction, worst.rotational_direction
    words = f"along {direction_in_words(along)}", f"about {direction_in_words(axis)}"
    lines.append(_worst(worst.translational, "m/N", words[0], found.status))
    lines.append(_worst(worst.rotational, "rad/(N m)", words[1], found.status))
    lines.append(
        f"anisotropy: {_known(ratio.translational, found.status)} of displacements, "
        f"{_known(ratio.rotational, found.status)} of rotations"
    )
    lines += ["", f"eigenscrews: {found.eigenscrews.about}"]
    lines += [_line(w.stiffness, "N/m", _wrench(w)) for w in found.eigenscrews.wrenches]
    lines += [
        _line(t.stiffness, "N m/rad", str(FreeMotion(np.zeros(6), t.screw)))
        for t in found.eigenscrews.twists
    ]
    lines += [
        f"compliant axis: {direction_in_words(axis.direction)} through ({_place(axis.point)}) m"
        for axis in found.eigenscrews.compliant_axes
    ]
    lines.append(f"centre of stiffness:  {_centre(found.centre_of_stiffness)}")
    lines.append(f"centre of compliance: {_centre(found.centre_of_compliance)}")
    lines += ["", f"rotations multiplied by the characteristic length {number(found.length)} m:"]
    lines += [
        _line(k, "N/m", str(motion))
        for k, motion in zip(found.eigenstiffness.values, found.eigenstiffness.motions, strict=True)
    ]
    condition, work = found.condition, found.virtual_work
    lines.append(
        f"condition number: {_known(condition.two_norm, found.status)} (two-norm), "
        f"{_known(condition.frobenius, found.status)} (Frobenius); "
        f"isotropy {number(condition.isotropy)}"
    )
    lines.append(
        f"virtual work of unit loads: {_known(work.worst, found.status)} J/N^2 at worst, "
        f"{_known(work.mean, found.status)} J/N^2 in the mean"
    )
    lines += [f"advice: {advice}" for advice in result.advice]
    return text_of(lines)


def _loads(found: PrincipalStiffnesses | CollinearStiffness) -> Iterator[str]:
    forces = zip(found.translational, found.translational_directions, strict=True)
    moments = zip(found.rotational, found.rotational_directions, strict=True)
    for k, u in forces:
        yield _line(k, "N/m", f"force along {direction_in_words(u)}", found.status)
    for k, w in moments:
        yield _line(k, "N m/rad", f"moment about {direction_in_words(w)}", found.status)


def _line(value: float, unit: str, words: str, status: Status = Status.FREE_MOTIONS) -> str:
    if value == 0:
        words = f"{'free' if Status.FREE_MOTIONS in status else 'less than rounding'}: {words}"
    return f"  {number(value):>11} {unit:<9}{words}"


def _worst(value: float | None, unit: str, words: str, status: Status) -> str:
    if value is None and Status.FREE_MOTIONS not in status:
        return f"      unknown {unit:<9} {words}, as the compliance is below rounding"
    if value is None:
        return f"     infinite {unit:<9} {words}, a free motion"
    return f"  {number(value):>11} {unit:<9} {words}"


def _wrench(found: Eigenwrench) -> str:
    screw = found.screw
    if screw is None or screw.point is None:
        return f"translation along {direction_in_words(found.direction)}"
    line = f"along {direction_in_words(screw.axis)} through ({_place(screw.point)}) m"
    if screw.is_rotation:  # of a wrench: a pitch of zero
        return f"force {line}"
    return f"wrench {line}, {1e3 * (screw.pitch or 0.0):.4g} N mm per N"


def _centre(centre: Centre) -> str:
    if centre.point is None or centre.coupling is None:
        return "none"
    where = f"({_place(centre.point)}) m"
    if centre.line is not None:
        where += f" and along {direction_in_words(centre.line)}"
    rest = "decoupled" if centre.is_decoupled else f"coupling {number(centre.coupling)}"
    return f"{where}, {rest}"


def _place(point: np.ndarray) -> str:
    return row(np.where(np.abs(point) < _SMALL, 0.0, point))


def _known(value: float | None, status: Status) -> str:
    if value is not None:
        return number(value)
    return "infinite" if Status.FREE_MOTIONS in status else "unknown"
