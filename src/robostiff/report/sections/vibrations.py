"""Natural frequencies of the masses of the model, and how the robot moves in its modes."""

from __future__ import annotations

from robostiff.markup import Paragraph
from robostiff.plot.loaded_robot import mode_picture
from robostiff.report.contents import ReportContents
from robostiff.report.figures import Figure, Level
from robostiff.report.section import Section, section
from robostiff.statics.result_tables import faster_modes, mode_table

_DRAWN = 4


def vibrations_section(contents: ReportContents) -> Section | None:
    """The slowest modes, listed and animated; nothing of a robot without masses."""
    found = contents.modes
    if found is None:
        return None
    words = (
        "Small vibrations without load, of the masses of the model: parts, platform and what it "
        "carries. Drives are held at their coordinates by their own stiffness."
    )
    levels = tuple(
        Level(
            f"mode {i}: {mode.frequency:.4g} Hz",
            mode_picture(found, i),
            mode_picture(found, i, -1.0),
        )
        for i, mode in enumerate(found.each[:_DRAWN], start=1)
    )
    figure = Figure("modes", "The slowest modes, displacements exaggerated.", levels)
    parts = [Paragraph(words), mode_table(found), faster_modes(found), figure]
    return section("vibrations", "Natural frequencies", parts)
