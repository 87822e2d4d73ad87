"""How the robot gives way under the load, and which part bends."""

from __future__ import annotations

from robostiff.analysis.in_html import displacement_table, energy_table
from robostiff.markup import element, escaped, listing, number_html, table
from robostiff.plot.energy_bars import energy_picture
from robostiff.plot.posed_robot import robot_picture
from robostiff.report.contents import ReportContents
from robostiff.report.figures import Figure, one_figure
from robostiff.report.section import Section, section


def bending_section(contents: ReportContents) -> Section | None:
    """Displacement, shares of the elastic energy, loads on actuators; nothing without a load."""
    bent = contents.deflection
    if bent is None:
        return None
    title = "Under the load"
    if not bent.has_answer:
        advice = element("div", listing(bent.advice), class_="advice")
        return section("load", title, element("p", "There is no deflection."), advice)
    parts: list[str | Figure] = [element("div", displacement_table(bent), class_="wide")]
    if bent.energy > 0 and contents.snapshot is not None:
        caption = "The deformed shape, exaggerated; colours tell who takes up the elastic energy."
        parts.append(one_figure("deformed", caption, robot_picture(contents.snapshot, bent)))
        parts.append(one_figure("energy", "Who bends.", energy_picture(bent)))
        whole = element("summary", "every part") + energy_table(bent, most=len(bent.parts))
        parts.append(element("details", whole))
    if bent.actuators:
        rows = [
            [escaped(f"{a.leg}/{a.joint}"), number_html(a.load), number_html(a.travel)]
            for a in bent.actuators
        ]
        parts.append(
            element("h3", "Actuators")
            + table(["actuator", "load [N or N m]", "gives way by [m or rad]"], rows)
        )
    return section("load", title, *parts)
