"""Stiffness indices as tables, for notebooks and reports."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from robostiff.analysis.result_tables import head_html
from robostiff.elastostatics import Status
from robostiff.markup import Cell, Number, Table, block_html, element, number, row

if TYPE_CHECKING:
    from robostiff.analysis.indices.overview import StiffnessIndices


def indices_html(found: StiffnessIndices) -> str:
    """Principal stiffnesses, worst deflections, ratios and centres."""
    tables = block_html(principal_table(found)) + block_html(ratio_table(found))
    return element("div", head_html(found.result, found.status) + tables)


def principal_table(found: StiffnessIndices) -> Table:
    """Principal stiffnesses with their directions, the smallest first."""
    return Table(["load", "stiffness", "direction"], list(_principal(found)))


def ratio_table(found: StiffnessIndices) -> Table:
    """Worst deflections, ratios and centres."""
    return Table(["", "value"], list(_ratios(found)))


def _principal(found: StiffnessIndices) -> Iterator[list[Cell]]:
    principal = found.principal
    forces = zip(principal.translational, principal.translational_directions, strict=True)
    moments = zip(principal.rotational, principal.rotational_directions, strict=True)
    for kind, unit, pairs in (("force", "N/m", forces), ("moment", "N m/rad", moments)):
        for value, direction in pairs:
            meets = Number(float(value), unit) if value else _free(found)
            yield [kind, meets, f"({row(np.asarray(direction))})"]


def _ratios(found: StiffnessIndices) -> Iterator[list[Cell]]:
    worst, ratio = found.worst_deflection, found.anisotropy
    yield ["largest displacement of a unit force", _with_unit(worst.translational, "m/N", found)]
    yield ["largest rotation of a unit moment", _with_unit(worst.rotational, "rad/(N m)", found)]
    yield ["largest over smallest displacement", _with_unit(ratio.translational, "", found)]
    yield [
        f"condition number, rotations times {number(found.length)} m",
        _with_unit(found.condition.two_norm, "", found),
    ]
    for name, centre in (
        ("centre of stiffness", found.centre_of_stiffness),
        ("centre of compliance", found.centre_of_compliance),
    ):
        where = "none" if centre.point is None else f"({row(np.asarray(centre.point))}) m"
        yield [name, where]


def _with_unit(value: float | None, unit: str, found: StiffnessIndices) -> Cell:
    if value is not None:
        return Number(float(value), unit)
    return "unlimited" if Status.FREE_MOTIONS in found.status else "unknown: below rounding"


def _free(found: StiffnessIndices) -> str:
    return "free" if Status.FREE_MOTIONS in found.status else "less than rounding"
