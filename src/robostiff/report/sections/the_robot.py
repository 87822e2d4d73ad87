"""The robot at the pose, how its stiffness was computed, and the formula."""

from __future__ import annotations

import platform
from importlib.metadata import version

from robostiff.analysis import CableStiffness
from robostiff.markup import Facts, Paragraph, Table, row
from robostiff.model import Robot
from robostiff.model.cable import CableRobot
from robostiff.model.in_words import elements_in_words, placed_in_words
from robostiff.network import Network
from robostiff.plot.posed_robot import Colouring, picture_of_posed
from robostiff.report.contents import ReportContents, Reported
from robostiff.report.section import Folded, FormulaBlock, Part, Section, one_figure, section
from robostiff.version import __version__


def robot_section(contents: ReportContents) -> Section:
    """Source, legs or cables, and a picture of the robot at the pose."""
    robot, posed = contents.robot, contents.posed
    parts: list[Part | None] = []
    if isinstance(robot, Robot | CableRobot):
        if robot.source:
            parts.append(Paragraph(f"Source: {robot.source}"))
        free = ", ".join(coordinate.value for coordinate in robot.coordinates)
        if free:
            parts.append(Paragraph(f"Free coordinates of the platform: {free}."))
    if posed is not None:
        picture = picture_of_posed(posed, colouring=Colouring.NAMES)
        parts.append(one_figure("robot", "The robot at this pose.", picture))
    if contents.joints:
        parts.append(Table(["joint", "coordinate"], list(contents.joints.items())))
    parts.append(_legs(robot))
    return section("robot", "The robot", parts)


def _legs(robot: Reported) -> Part | None:
    """The legs, element by element; a network and a cable robot have none."""
    if isinstance(robot, Network | CableRobot):
        return None
    if isinstance(robot, Robot):
        legs = [(leg.name, ", ".join(elements_in_words(leg.chain))) for leg in robot.legs]
    else:
        legs = [(leg.name, ", ".join(placed_in_words(leg))) for leg in robot.legs]
    whole = Table(["leg", "from base to platform"], legs)
    return whole if len(legs) == 1 else Folded(f"{len(legs)} legs, element by element", (whole,))


_OF_PASSIVE_JOINTS = (
    "A. Pashkevich, A. Klimchik, S. Caro, D. Chablat: Cartesian stiffness matrix of manipulators "
    "with passive joints: analytical approach, 2011"
)
_OF_CABLES = (
    "S. Behzadipour, A. Khajepour: Stiffness of cable-based parallel manipulators with application "
    "to stability analysis, 2006"
)
_PACKAGES = ("numpy", "scipy", "sympy")


def method_section(contents: ReportContents) -> Section:
    """Method, point, conventions and versions."""
    result = contents.stiffness
    pose = "its own"
    if result.pose is not None:
        pose = f"[{row(result.pose)}] (m, rad): x, y, z and rotation vector of the platform"
    packages = ", ".join(f"{name} {version(name)}" for name in _PACKAGES)
    facts = {
        "method": (
            f"elastic and geometric stiffness of the cables; tensions by the rule {result.rule}"
            if isinstance(result, CableStiffness)
            else f"{result.method.name}: {result.method.equation}"
        ),
        "pose": pose,
        "reference point": f"({row(result.reference_point)}) m",
        "conventions": "F = K t in world axes; twist: displacement of the reference point, then "
        "rotation; wrench: force, then moment about the reference point; SI units",
        "theory": _OF_CABLES if isinstance(result, CableStiffness) else _OF_PASSIVE_JOINTS,
        "versions": f"robostiff {__version__}, Python {platform.python_version()}, {packages}",
    }
    found = contents.found
    if found is not None:
        poses = found.attrs.get("poses", "unknown")
        facts["map"] = f"{poses} poses, robostiff {found.attrs.get('robostiff_version', 'unknown')}"
    return section("method", "How it was computed", [Facts(tuple(facts.items()))])


def formula_section(contents: ReportContents) -> Section | None:
    """The derivation step by step, or why there is none; nothing of a network or of cables."""
    if isinstance(contents.robot, Network | CableRobot):
        return None
    derivation = contents.derivation
    title = "The formula"
    if derivation is None:
        return section(
            "formula", title, [Paragraph(f"There is no formula: {contents.no_derivation}.")]
        )
    words = "Derivation of the stiffness matrix in the home configuration, step by step"
    return section("formula", title, [Folded(words, (FormulaBlock(derivation),))])
