"""Stiffness and compliance, the weakest directions, and the deflection under the load."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from robostiff.analysis import CableResponse, CableStiffness
from robostiff.analysis.indices.overview import principal_table, ratio_table
from robostiff.analysis.result_tables import (
    actuator_table,
    cable_load_blocks,
    compliance_matrix,
    displacement_table,
    energy_table,
    free_motion_table,
    stiffness_matrix,
    tension_table,
)
from robostiff.errors import NoAnswerError
from robostiff.markup import Bullets, Paragraph, Tone
from robostiff.plot.energy_bars import energy_picture
from robostiff.plot.posed_robot import picture_of_posed
from robostiff.plot.posture import surroundings
from robostiff.plot.stiffness_pictures import Quality, ellipsoid_picture, free_motions_picture
from robostiff.report.contents import ReportContents
from robostiff.report.section import Figure, Folded, Part, Section, SideBySide, one_figure, section

_TITLE = "Stiffness and compliance"


def matrices_section(contents: ReportContents) -> Section:
    """K and C with units, rank, free motions and decision."""
    result = contents.stiffness
    parts: list[Part | None] = []
    if np.all(result.answered):
        K, C = stiffness_matrix(result), compliance_matrix(result)
        parts.append(SideBySide((K,) if C is None else (K, C)))
        if C is None:
            parts.append(Paragraph("K is singular: there is no compliance matrix."))
    else:
        parts.append(Paragraph(f"There is no stiffness matrix: status {result.status}."))
    if int(result.rank) < 0:
        return section("stiffness", _TITLE, parts)
    count = len(result.free_motions)
    moves = "free to move in one way" if count == 1 else f"free to move in {count} ways"
    meaning = f"the platform is {moves if count else 'held in every direction'}"
    parts.append(Paragraph(f"Rank {int(result.rank)} of {result.space.size}: {meaning}."))
    parts.append(free_motion_table(result))
    if result.free_motions and contents.posed is not None:
        caption = "Free motions of the platform."
        picture = free_motions_picture(result, surroundings(contents.posed, result))
        parts.append(one_figure("free-motions", caption, picture))
    if isinstance(result, CableStiffness):
        return section("stiffness", _TITLE, [*parts, _ellipsoid(contents), tension_table(result)])
    lost = tuple(f"redundant passive joint: {name}" for name in result.redundant_joints)
    parts.append(Bullets(lost) if lost else None)
    parts.append(Paragraph(f"Rank decided by {result.decision}.", Tone.QUIET))
    return section("stiffness", _TITLE, parts)


def _ellipsoid(contents: ReportContents) -> Figure | None:
    """The ellipsoid of displacements; nothing where there is none."""
    result = contents.stiffness
    if result.space.translations < 3 or result.compliance is None:
        return None
    with suppress(NoAnswerError):
        around = surroundings(contents.posed, result)
        picture = ellipsoid_picture(result, Quality.COMPLIANCE, around)
        caption = "Displacements under unit forces in all directions (compliance ellipsoid)."
        return one_figure("ellipsoid", caption, picture)
    return None


def weakest_section(contents: ReportContents) -> Section | None:
    """Principal stiffnesses, worst directions and ratios; nothing where there is no matrix."""
    found = contents.indices
    if found is None:
        return None
    words = Paragraph(
        "The principal stiffnesses are those with all other displacements and rotations held. The "
        "largest displacement is with rotations free, the largest rotation with displacements free."
    )
    tables = SideBySide((principal_table(found), ratio_table(found)))
    return section("weakest", "Where it is soft", [words, tables, _ellipsoid(contents)])


_LOAD = "Under the load"


def bending_section(contents: ReportContents) -> Section | None:
    """Displacement, shares of the elastic energy, loads on actuators; nothing without a load."""
    bent = contents.deflection
    if bent is None:
        return None
    if isinstance(bent, CableResponse):
        return section("load", _LOAD, list(_cables_bent(contents, bent)))
    if not bent.has_answer:
        words = Paragraph(f"There is no deflection: status {bent.status}.")
        return section("load", _LOAD, [words, Bullets(tuple(bent.advice), Tone.WARNING)])
    loads = (displacement_table(bent), actuator_table(bent))
    parts: list[Part | None] = [SideBySide(tuple(table for table in loads if table is not None))]
    if bent.energy > 0 and contents.posed is not None:
        caption = "The robot under the load; colours show shares of the elastic energy."
        parts.append(one_figure("deformed", caption, picture_of_posed(contents.posed, bent)))
        of = "each leg, part by part" if len(bent.leg_wrenches) > 1 else "each part"
        caption = f"Elastic energy of {of}."
        parts.append(one_figure("energy", caption, energy_picture(bent)))
        every = energy_table(bent.parts, most=len(bent.parts))
        parts.append(Folded(f"{len(bent.parts)} parts, one by one", (every,)))
    return section("load", _LOAD, parts)


def _cables_bent(contents: ReportContents, bent: CableResponse) -> Iterator[Part]:
    """Displacement, the robot where it rests, tensions, and when the first cable is slack."""
    if bent.after is None or contents.posed is None:
        part = f"{100 * bent.carried:.4g} % of it are carried"
        yield Paragraph(f"The load is not carried: status {bent.status}; {part}.")
        yield Bullets(tuple(bent.advice), Tone.WARNING)
        return
    displacement, *rest = cable_load_blocks(bent)
    yield displacement
    caption = "The robot where it rests under the load, and without it in dashed lines."
    yield one_figure("deformed", caption, picture_of_posed(contents.posed, bent))
    yield from rest
