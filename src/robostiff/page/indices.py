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


def indices_page(asked: StiffnessIndices | Stiffness) -> Page:
    """The indices at a pose; of a stiffness, which has none without a matrix, that it has none."""
    found, result = (None, asked) if isinstance(asked, Stiffness) else (asked, asked.result)
    blocks = stiffness_page(result).blocks if found is None else _blocks(found)
    return posed_page(
        result,
        blocks,
        {
            "pose": result.pose,
            "reference_point": result.reference_point,
            "order": order(result.space),
            "length": None if found is None else found.length,
            "indices": None if found is None else {n: getattr(found, n) for n in INDEX_NAMES},
        },
    )


def _blocks(found: StiffnessIndices) -> list[Block | None]:
    condition, work, status = found.condition, found.virtual_work, found.status
    screws = found.eigenscrews
    wrenches = []
    for own in screws.wrenches:
        screw, words = own.screw, f"translation along {direction_in_words(own.direction)}"
        if screw is not None and screw.point is not None:
            line = f"along {direction_in_words(screw.axis)} through ({_place(screw.point)}) m"
            pitch = f", {number(1e3 * (screw.pitch or 0.0))} N mm per N"
            # of a wrench a rotation is a pitch of zero
            words = f"force {line}" if screw.is_rotation else f"wrench {line}{pitch}"
        wrenches.append(_entry(own.stiffness, "N/m", words))
    motions = [FreeMotion(np.zeros(6), own.screw) for own in screws.twists]
    twists = [
        _entry(own.stiffness, "N m/rad", str(motion))
        for own, motion in zip(screws.twists, motions, strict=True)
    ]
    along = [
        [
            direction_in_words(own.direction),
            *(Number(float(k)) for k in (own.free, own.held)),
            "moves freely" if Status.UNBALANCED in own.status else "",
        ]
        for own in found.along_axes
    ]
    scaled = zip(found.eigenstiffness.values, found.eigenstiffness.motions, strict=True)
    return [
        Table(["stiffness along world axes [N/m]", "free", "held", ""], along),
        principal_table(found),
        _stationary("collinear stiffness", found.collinear),
        worst_table(found),
        ratios(found),
        Table(("", ""), [*wrenches, *twists], f"eigenscrews: {screws.about}"),
        centres(found),
        Table(
            ("", ""),
            [_entry(k, "N/m", str(motion)) for k, motion in scaled],
            f"rotations multiplied by the characteristic length {number(found.length)} m:",
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


def principal_table(found: StiffnessIndices) -> Table:
    """Principal stiffnesses with their directions, the smallest first."""
    return _stationary("principal stiffness", found.principal)


def worst_table(found: StiffnessIndices) -> Table:
    """The largest deflections of unit loads."""
    worst, status = found.worst_deflection, found.status
    unit_force = f"along {direction_in_words(worst.translational_direction)}"
    unit_moment = f"about {direction_in_words(worst.rotational_direction)}"
    rows = [
        _worst(worst.translational, "m/N", unit_force, status),
        _worst(worst.rotational, "rad/(N m)", unit_moment, status),
    ]
    return Table(("", ""), rows, f"worst deflection {worst.about}")


def ratios(found: StiffnessIndices) -> Bullets:
    """How much deflections differ by direction."""
    ratio, status = found.anisotropy, found.status
    displacements = f"{_known(ratio.translational, status)} of displacements"
    return Bullets(
        (f"anisotropy: {displacements}, {_known(ratio.rotational, status)} of rotations",)
    )


def centres(found: StiffnessIndices) -> Bullets:
    """Compliant axes and centres."""
    axes = (
        f"compliant axis: {direction_in_words(axis.direction)} through ({_place(axis.point)}) m"
        for axis in found.eigenscrews.compliant_axes
    )
    return Bullets(
        (
            *axes,
            f"centre of stiffness:  {_centre(found.centre_of_stiffness)}",
            f"centre of compliance: {_centre(found.centre_of_compliance)}",
        )
    )


def _stationary(name: str, found: PrincipalStiffnesses | CollinearStiffness) -> Table:
    rows = [
        _entry(k, unit, f"{load} {direction_in_words(u)}", found.status)
        for load, unit, values, directions in (
            ("force along", "N/m", found.translational, found.translational_directions),
            ("moment about", "N m/rad", found.rotational, found.rotational_directions),
        )
        for k, u in zip(values, directions, strict=True)
    ]
    return Table(("", ""), rows, f"{name}: {found.about}")


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
