"""The sections of a report as one page of HTML that needs nothing else."""

from __future__ import annotations

from importlib.resources import files
from string import Template

from robostiff.elastostatics import Status
from robostiff.markup import element, escaped, listing
from robostiff.model import Robot
from robostiff.plot.extra import plot_extra
from robostiff.report.contents import ReportContents
from robostiff.report.figures import Figure, figures_json
from robostiff.report.section import Section
from robostiff.report.sections import (
    bending_section,
    formula_section,
    map_section,
    matrices_section,
    method_section,
    robot_section,
    weakest_section,
)
from robostiff.version import __version__


def report_html(contents: ReportContents) -> str:
    """A report as one page of HTML: style, script and figures are inside, nothing is fetched.

    Parameters
    ----------
    contents : ReportContents

    Raises
    ------
    InputError
        When Plotly is missing.
    """
    with plot_extra():
        from plotly.offline import get_plotlyjs
    sections = report_sections(contents)
    links = (
        element("a", escaped(section.title), href=f"#{section.anchor}") for section in sections
    )
    return Template(_resource("page.html")).substitute(
        title=escaped(report_title(contents)),
        lead=_lead(contents),
        version=__version__,
        links="\n".join(links),
        sections="\n".join(map(_section_html, sections)),
        figures=figures_json([figure for section in sections for figure in section.figures]),
        style=_resource("page.css"),
        script=_resource("page.js"),
        plotly=get_plotlyjs(),
    )


def report_title(contents: ReportContents) -> str:
    """Name of the robot, and what it is."""
    robot = contents.robot
    words = robot.title if isinstance(robot, Robot) else robot.description
    return f"{robot.name}: {words}" if words else robot.name


def report_sections(contents: ReportContents) -> list[Section]:
    """The sections in which there is something to tell."""
    sections = (
        robot_section(contents),
        matrices_section(contents),
        weakest_section(contents),
        bending_section(contents),
        map_section(contents),
        formula_section(contents),
        method_section(contents),
    )
    return [section for section in sections if section is not None]


def _lead(contents: ReportContents) -> str:
    """Status, and what to know before reading on."""
    result = contents.stiffness
    status, advice = result.status, result.advice
    if contents.deflection is not None:
        status, advice = contents.deflection.status, contents.deflection.advice
    kind = "bad" if status.is_bad else "note" if status else "ok"
    word = element("span", escaped(status), class_=f"status-{kind}")
    rank = ""
    if Status.UNREACHABLE not in result.status:
        rank = f", rank {int(result.rank)} of {result.space.size}"
    lead = element("p", f"At this pose: status {word}{rank}.", class_="lead")
    return lead + (element("div", listing(advice), class_="advice") if advice else "")


def _section_html(section: Section) -> str:
    parts = [part.html if isinstance(part, Figure) else part for part in section.parts]
    heading = element("h2", escaped(section.title))
    return element("section", "\n".join([heading, *parts]), id=section.anchor)


def _resource(name: str) -> str:
    return files("robostiff.report").joinpath(name).read_text(encoding="utf-8")
