"""Natural frequencies of the masses of the model, and how the robot moves in its modes."""

from __future__ import annotations

from robostiff.markup import Cell, Number, Paragraph, Table, Tone
from robostiff.plot.loaded_robot import mode_picture
from robostiff.report.contents import ReportContents
from robostiff.report.figures import Figure, Level
from robostiff.report.section import Section, section

_LISTED, _DRAWN = 8, 4


def vibrations_section(contents: ReportContents) -> Section | None:
    """The slowest modes, listed and animated; nothing of a robot without masses."""
    found = contents.modes
    if found is None:
        return None
    words = (
        "Small vibrations without load, of the masses of the model: parts, platform and what it "
        "carries. Drives are held at their coordinates by their own stiffness."
    )
    rows: list[list[Cell]] = []
    for i, mode in enumerate(found.each[:_LISTED], start=1):
        most = mode.shares[0] if mode.shares else None
        part = "none" if most is None else f"{most.leg}/{most.part}, {100 * most.share:.0f} %"
        rows.append([str(i), Number(mode.frequency, "Hz"), mode.words, part])
    levels = tuple(
        Level(
            f"mode {i}: {mode.frequency:.4g} Hz",
            mode_picture(found, i),
            mode_picture(found, i, -1.0),
        )
        for i, mode in enumerate(found.each[:_DRAWN], start=1)
    )
    figure = Figure("modes", "The slowest modes, displacements exaggerated.", levels)
    table = Table(["mode", "frequency", "motion", "most energy in"], rows)
    more = len(found) - len(rows)
    rest = Paragraph(f"{more} faster modes are not listed.", Tone.QUIET) if more > 0 else None
    return section("vibrations", "Natural frequencies", [Paragraph(words), table, rest, figure])
