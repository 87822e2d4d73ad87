"""The sections of a report, one a file, each from the contents to HTML and figures."""

from robostiff.report.sections.bending import bending_section
from robostiff.report.sections.formula import formula_section
from robostiff.report.sections.map_slices import map_section
from robostiff.report.sections.matrices import matrices_section
from robostiff.report.sections.method import method_section
from robostiff.report.sections.the_robot import robot_section
from robostiff.report.sections.weakest import weakest_section

__all__ = [
    "bending_section",
    "formula_section",
    "map_section",
    "matrices_section",
    "method_section",
    "robot_section",
    "weakest_section",
]
