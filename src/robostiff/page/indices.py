"""Stiffness indices."""

from __future__ import annotations

import numpy as np

from robostiff.analysis import Stiffness
from robostiff.analysis.free_motion import FreeMotion, direction_in_words
from robostiff.analysis.indices import (
    Centre,
    CollinearStiffness,
    PrincipalStiffnesses,
    StiffnessIndices,
)
from robostiff.analysis.indices.overview import INDEX_NAMES
from robostiff.elastostatics import Status
from robostiff.markup import Block, Bullets, Cell, Number, Page, Table, number, row
from robostiff.page.of_result import order
from robostiff.page.stiffness import posed_page, stiffness_page

_SMALL = 1e-9


def indices_page(answer: StiffnessIndices | Stiffness) -> Page:
    """The indices at a pose; of a stiffness, which has none without a matrix, that it has none."""
    indices, result = (None, answer) if isinstance(answer, Stiffness) else (answer, answer.result)
    blocks = stiffness_page(result).blocks if indices is None else _blocks(indices)
    return posed_page(
        result,
        blocks,
        {
            "pose": result.pose,
            "reference_point": result.reference_point,
            "order": order(result.space),
            "length": None if indices is None else indices.length,
            "indices": None if indices is None else {n: getattr(indices, n) for n in INDEX_NAMES},
        },
    )


def _blocks(indices: StiffnessIndices) -> list[Block | None]:
    condition, work, status = indices.condition, indices.virtual_work, indices.status
    screws = indices.eigenscrews
    wrenches = []
    for wrench in screws.wrenches:
        screw, words = wrench.screw, f"translation along {direction_in_words(wrench.direction)}"
        if screw is not None and screw.point is not None:
            line = f"along {direction_in_words(screw.axis)} through ({_place(screw.point)}) m"
            pitch = f", {number(1e3 * (screw.pitch or 0.0))} N mm per N"
            # of a wrench a rotation is a pitch of zero
            words = f"force {line}" if screw.is_rotation else f"wrench {line}{pitch}"
        wrenches.append(_entry(wrench.stiffness, "N/m", words))
    twists = [
        _entry(twist.stiffness, "N m/rad", str(FreeMotion(np.zeros(6), twist.screw)))
        for twist in screws.twists
    ]
    along = [
        [
            direction_in_words(axis.direction),
            *(Number(float(k)) for k in (axis.free, axis.held)),
            "moves freely" if Status.UNBALANCED in axis.status else "",
        ]
        for axis in indices.along_axes
    ]
    scaled = zip(indices.eigenstiffness.values, indices.eigenstiffness.motions, strict=True)
    return [
        Table(["stiffness along world axes [N/m]", "free", "held", ""], along),
        principal_table(indices),
        _stationary("collinear stiffness", indices.collinear),
        worst_table(indices),
        ratios(indices),
        Table(("", ""), [*wrenches, *twists], f"eigenscrews: {screws.about}"),
        centres(indices),
        Table(
            ("", ""),
            [_entry(k, "N/m", str(motion)) for k, motion in scaled],
            f"rotations multiplied by the characteristic length {number(indices.length)} m:",
        ),
        Bullets(
            (
                f"condition number: {_known(condition.two_norm, status)} (two-norm), "
                f"{_known(condition.frobenius, status)} (Frobenius); "
                f"isotropy {number(condition.isotropy)}",
                f"virtual work of unit loads: {_known(work.worst, status)} J/N^2 at worst, "
                f"{_known(work.mean, status)} J/N^2 in the mean",
            )
        ),
    ]


_Row = tuple[str, Cell]  # what a value is of, and the value or a word in its place


def principal_table(indices: StiffnessIndices) -> Table:
    """Principal stiffnesses with their directions, the smallest first."""
    return _stationary("principal stiffness", indices.principal)


def worst_table(indices: StiffnessIndices) -> Table:
    """The largest deflections of unit loads."""
    worst, status = indices.worst_deflection, indices.status
    unit_force = f"along {direction_in_words(worst.translational_direction)}"
    unit_moment = f"about {direction_in_words(worst.rotational_direction)}"
    rows = [
        _worst(worst.translational, "m/N", unit_force, status),
        _worst(worst.rotational, "rad/(N m)", unit_moment, status),
    ]
    return Table(("", ""), rows, f"worst deflection {worst.about}")


def ratios(indices: StiffnessIndices) -> Bullets:
    """How much deflections differ by direction."""
    ratio, status = indices.anisotropy, indices.status
    displacements = f"{_known(ratio.translational, status)} of displacements"
    return Bullets(
        (f"anisotropy: {displacements}, {_known(ratio.rotational, status)} of rotations",)
    )


def centres(indices: StiffnessIndices) -> Bullets:
    """Compliant axes and centres."""
    axes = (
        f"compliant axis: {direction_in_words(axis.direction)} through ({_place(axis.point)}) m"
        for axis in indices.eigenscrews.compliant_axes
    )
    return Bullets(
        (
            *axes,
            f"centre of stiffness:  {_centre(indices.centre_of_stiffness)}",
            f"centre of compliance: {_centre(indices.centre_of_compliance)}",
        )
    )


def _stationary(name: str, result: PrincipalStiffnesses | CollinearStiffness) -> Table:
    rows = [
        _entry(k, unit, f"{load} {direction_in_words(u)}", result.status)
        for load, unit, values, directions in (
            ("force along", "N/m", result.translational, result.translational_directions),
            ("moment about", "N m/rad", result.rotational, result.rotational_directions),
        )
        for k, u in zip(values, directions, strict=True)
    ]
    return Table(("", ""), rows, f"{name}: {result.about}")


def _entry(value: float, unit: str, words: str, status: Status = Status.FREE_MOTIONS) -> _Row:
    if value == 0:
        words = f"{'free' if Status.FREE_MOTIONS in status else 'less than rounding'}: {words}"
    return words, Number(float(value), unit)


def _worst(value: float | None, unit: str, words: str, status: Status) -> _Row:
    if value is None and Status.FREE_MOTIONS not in status:
        return f"{words}, as the compliance is below rounding", "unknown"
    if value is None:
        return f"{words}, a free motion", "infinite"
    return words, Number(float(value), unit)


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
