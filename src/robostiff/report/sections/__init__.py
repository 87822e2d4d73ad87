"""The sections of a report, one a file, each from the contents to blocks and figures."""

from __future__ import annotations

from robostiff.markup import Section
from robostiff.report.contents import ReportContents
from robostiff.report.sections.findings import findings_section
from robostiff.report.sections.map_slices import map_section
from robostiff.report.sections.results import (
    bending_section,
    comparison_section,
    finite_load_section,
    matrices_section,
    vibrations_section,
    weakest_section,
)
from robostiff.report.sections.the_robot import (
    formula_section,
    inputs_section,
    method_section,
    robot_section,
)

__all__ = ["report_sections"]


def report_sections(contents: ReportContents) -> list[Section]:
    """The sections that have content."""
    sections = (
        findings_section(contents),
        robot_section(contents),
        matrices_section(contents),
        weakest_section(contents),
        bending_section(contents),
        finite_load_section(contents),
        vibrations_section(contents),
        comparison_section(contents),
        map_section(contents),
        inputs_section(contents),
        method_section(contents),
        formula_section(contents),
    )
    return [section for section in sections if section is not None]
