"""Stiffness and compliance with units, rank and free motions."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.in_html import compliance_matrix, free_motion_table, stiffness_matrix
from robostiff.elastostatics import Status
from robostiff.markup import element, escaped, listing
from robostiff.plot.free_motion_screws import free_motions_picture
from robostiff.plot.matrix_cells import matrix_picture
from robostiff.report.contents import ReportContents
from robostiff.report.figures import Figure, one_figure
from robostiff.report.section import Section, section


def matrices_section(contents: ReportContents) -> Section:
    """K and C, what they mean, and what to know about them."""
    result = contents.stiffness
    parts: list[str | Figure] = []
    if np.all(result.answered):
        matrices = element("div", stiffness_matrix(result)) + element(
            "div", compliance_matrix(result)
        )
        parts.append(element("div", element("div", matrices, class_="side-by-side"), class_="wide"))
        caption = "Entries of K, shaded by their size beside the diagonal."
        parts.append(one_figure("matrix", caption, matrix_picture(result)))
    if Status.UNREACHABLE not in result.status:
        words = f"Rank {int(result.rank)} of {result.space.size}"
        words += (
            ": held in every direction." if not result.free_motions else ": free motions remain."
        )
        parts.append(element("p", words))
        parts.append(free_motion_table(result))
        if result.free_motions and contents.snapshot is not None:
            caption = "What the platform can do without meeting stiffness."
            picture = free_motions_picture(result, contents.snapshot)
            parts.append(one_figure("free-motions", caption, picture))
        lost = [f"redundant passive joint: {name}" for name in result.redundant_joints]
        parts.append(listing(lost))
        parts.append(element("p", element("small", f"Rank decided by {escaped(result.decision)}.")))
    return section("stiffness", "Stiffness and compliance", *parts)
