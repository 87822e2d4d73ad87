"""How the robot gives way under the load, and which part bends."""

from __future__ import annotations

from robostiff.analysis.result_tables import actuator_table, displacement_table, energy_table
from robostiff.markup import Bullets, Heading, Tone, Words
from robostiff.plot.energy_bars import energy_picture
from robostiff.plot.posed_robot import robot_picture
from robostiff.report.contents import ReportContents
from robostiff.report.figures import one_figure
from robostiff.report.section import Folded, Part, Section, section

_TITLE = "Under the load"


def bending_section(contents: ReportContents) -> Section | None:
    """Displacement, shares of the elastic energy, loads on actuators; nothing without a load."""
    bent = contents.deflection
    if bent is None:
        return None
    if not bent.has_answer:
        words = Words(f"There is no deflection: status {bent.status}.")
        return section("load", _TITLE, [words, Bullets(tuple(bent.advice), Tone.WARNING)])
    parts: list[Part | None] = [displacement_table(bent)]
    if bent.energy > 0 and contents.snapshot is not None:
        caption = "The robot under the load; colours tell which leg takes up the elastic energy."
        parts.append(one_figure("deformed", caption, robot_picture(contents.snapshot, bent)))
        caption = "Who bends: the elastic energy of each leg, part by part."
        parts.append(one_figure("energy", caption, energy_picture(bent)))
        every = energy_table(bent, most=len(bent.parts))
        parts.append(Folded(f"{len(bent.parts)} parts, one by one", (every,)))
    actuators = actuator_table(bent)
    if actuators is not None:
        parts += [Heading("Actuators"), actuators]
    return section("load", _TITLE, parts)
