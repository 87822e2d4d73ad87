"""What a report says first: the name of the robot, where it stands, and how that went."""

from __future__ import annotations

from dataclasses import dataclass

from robostiff.elastostatics import Status
from robostiff.markup import row
from robostiff.model import Robot
from robostiff.report.contents import ReportContents


@dataclass(frozen=True)
class Verdict:
    """How it went.

    Attributes
    ----------
    place : str
        The pose, or that there is none.
    status : Status
    kind : str
        ok, note or bad.
    rank : str
        In words; empty where there is none.
    advice : tuple of str
    """

    place: str
    status: Status
    kind: str
    rank: str
    advice: tuple[str, ...]


def report_title(contents: ReportContents) -> str:
    """Name of the robot, and what it is."""
    robot = contents.robot
    words = robot.title if isinstance(robot, Robot) else robot.description
    return f"{robot.name}: {words}" if words else robot.name


def verdict_of(contents: ReportContents) -> Verdict:
    """Status of the stiffness, and of the deflection where there is a load, with all advice."""
    result, bent = contents.stiffness, contents.deflection
    status = contents.status
    advice = [*result.advice, *(() if bent is None else bent.advice)]
    reached = Status.UNREACHABLE not in result.status
    place = "As it stands" if result.pose is None else f"At the pose [{row(result.pose)}] (m, rad)"
    return Verdict(
        place=place,
        status=status,
        kind="bad" if status.is_bad else "note" if status else "ok",
        rank=f", rank {int(result.rank)} of {result.space.size}" if reached else "",
        advice=tuple(dict.fromkeys(advice)),
    )
