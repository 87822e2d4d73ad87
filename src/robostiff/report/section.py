"""Sections of a report, and the paragraph before them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from robostiff.analysis import CableStiffness
from robostiff.analytic import RobotDerivation
from robostiff.cables import CableStatus
from robostiff.elastostatics import Status
from robostiff.markup import Block, row
from robostiff.model import Robot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.report.contents import ReportContents
from robostiff.report.figures import Figure


@dataclass(frozen=True)
class FormulaBlock:
    """A block with a derivation, typeset step by step."""

    derivation: RobotDerivation


@dataclass(frozen=True)
class Verbatim:
    """Text as it is, line by line."""

    text: str


@dataclass(frozen=True)
class Folded:
    """Blocks that are collapsed below a title; on paper they are shown."""

    title: str
    parts: tuple[Block | FormulaBlock | Verbatim, ...]


@dataclass(frozen=True)
class SideBySide:
    """Blocks beside each other if there is room."""

    blocks: tuple[Block, ...]


Part = Block | Figure | Folded | FormulaBlock | SideBySide | Verbatim


@dataclass(frozen=True)
class Section:
    """A part of the report.

    Attributes
    ----------
    anchor : str
        Name in links.
    """

    anchor: str
    title: str
    parts: tuple[Part, ...]

    @property
    def figures(self) -> list[Figure]:
        """Its figures."""
        return [part for part in self.parts if isinstance(part, Figure)]


def section(anchor: str, title: str, parts: Iterable[Part | None]) -> Section:
    """A section; parts that are None are left out."""
    return Section(anchor, title, tuple(part for part in parts if part is not None))


@dataclass(frozen=True)
class Verdict:
    """Place, status and advice of a report.

    Attributes
    ----------
    place : str
        The pose, or that there is none.
    kind : str
        ok, note or bad.
    rank : str
        In words; empty where there is none.
    """

    place: str
    status: Status | CableStatus
    kind: str
    rank: str
    advice: tuple[str, ...]


def report_title(contents: ReportContents) -> str:
    """Name and title of the robot."""
    robot = contents.robot
    words = robot.title if isinstance(robot, Robot | CableRobot) else robot.description
    return f"{robot.name}: {words}" if words else robot.name


def verdict_of(contents: ReportContents) -> Verdict:
    """Status of the stiffness and, under a load, of the deflection, with all advice."""
    result, bent = contents.stiffness, contents.deflection
    status = contents.status
    advice = [*result.advice, *(() if bent is None else bent.advice)]
    is_placed = isinstance(result, CableStiffness) or Status.UNREACHABLE not in result.status
    reached = is_placed and int(result.rank) >= 0
    kind = "network" if isinstance(contents.robot, Network) else "snapshot"
    if contents.joints:
        kind = "linkage at home"
    place = (
        f"At {', '.join(contents.given)}"
        if contents.given
        else f"At the pose of the {kind}"
        if result.pose is None
        else f"At the pose [{row(result.pose)}] (m, rad)"
    )
    return Verdict(
        place=place,
        status=status,
        kind="bad" if status.is_bad else "note" if status else "ok",
        rank=f", rank {int(result.rank)} of {result.space.size}" if reached else "",
        advice=tuple(dict.fromkeys(advice)),
    )
