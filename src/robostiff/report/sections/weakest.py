"""Where the robot gives way most easily."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robostiff.analysis.indices import StiffnessIndices
from robostiff.elastostatics import Status
from robostiff.markup import Cell, Number, Table, Words, number, row
from robostiff.plot.ellipsoids import Quality, ellipsoid_picture
from robostiff.report.contents import ReportContents
from robostiff.report.figures import one_figure
from robostiff.report.section import Part, Section, section


def weakest_section(contents: ReportContents) -> Section | None:
    """Principal stiffnesses, worst directions and ratios; nothing where there is no matrix."""
    found = contents.indices
    if found is None:
        return None
    words = Words(
        "A force that may turn the platform as well meets these stiffnesses along its principal "
        "directions, and so does a moment that may move it; the first of each is the weakest."
    )
    parts: list[Part | None] = [
        words,
        Table(["load", "stiffness", "direction"], list(_principal(found))),
        Table(["", "value"], list(_ratios(found))),
    ]
    if found.result.space.translations == 3 and found.result.about_reference.invertible:
        picture = ellipsoid_picture(found.result, Quality.COMPLIANCE, contents.snapshot)
        caption = "Displacements under unit forces from all sides (compliance ellipsoid)."
        parts.append(one_figure("ellipsoid", caption, picture))
    return section("weakest", "Where it is soft", parts)


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
    return "without limit" if Status.FREE_MOTIONS in found.status else "unknown: no digit holds"


def _free(found: StiffnessIndices) -> str:
    return "free" if Status.FREE_MOTIONS in found.status else "less than rounding"
