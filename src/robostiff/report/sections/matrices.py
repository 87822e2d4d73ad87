"""Stiffness and compliance with units, rank and free motions."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.result_tables import (
    compliance_matrix,
    free_motion_table,
    stiffness_matrix,
)
from robostiff.elastostatics import Status
from robostiff.markup import Bullets, Tone, Words
from robostiff.plot.free_motion_screws import free_motions_picture
from robostiff.report.contents import ReportContents
from robostiff.report.figures import one_figure
from robostiff.report.section import Part, Section, SideBySide, section

_TITLE = "Stiffness and compliance"


def matrices_section(contents: ReportContents) -> Section:
    """K and C, and what they mean."""
    result = contents.stiffness
    parts: list[Part | None] = []
    if np.all(result.answered):
        K, C = stiffness_matrix(result), compliance_matrix(result)
        parts.append(SideBySide((K,) if C is None else (K, C)))
        if C is None:
            parts.append(Words("K is singular: there is no compliance matrix."))
    else:
        parts.append(Words(f"There is no stiffness matrix: status {result.status}."))
    if Status.UNREACHABLE in result.status:
        return section("stiffness", _TITLE, parts)
    parts.append(Words(f"Rank {int(result.rank)} of {result.space.size}: {_meaning(contents)}."))
    parts.append(free_motion_table(result))
    if result.free_motions and contents.snapshot is not None:
        caption = "What the platform can do without meeting stiffness."
        picture = free_motions_picture(result, contents.snapshot)
        parts.append(one_figure("free-motions", caption, picture))
    lost = tuple(f"redundant passive joint: {name}" for name in result.redundant_joints)
    parts.append(Bullets(lost) if lost else None)
    parts.append(Words(f"Rank decided by {result.decision}.", Tone.QUIET))
    return section("stiffness", _TITLE, parts)


def _meaning(contents: ReportContents) -> str:
    motions = len(contents.stiffness.free_motions)
    if not motions:
        return "the platform is held in every direction"
    moves = "one way" if motions == 1 else f"{motions} ways"
    return f"the platform is free to move in {moves}"
