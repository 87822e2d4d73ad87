"""What was given: parameters, joints and elastic parts of every leg, and the file itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from robostiff.analysis.parts_at_home import parts_at_home
from robostiff.markup import Cell, Heading, Number, Paragraph, Table, Tone, row
from robostiff.model import Robot
from robostiff.report.contents import ReportContents
from robostiff.report.section import Folded, Part, Section, Verbatim, section

_UNITS = ("N/m", "N m/rad")


def inputs_section(contents: ReportContents) -> Section:
    """All values that the results follow from, so that they can be checked and computed again."""
    robot, known = contents.robot, contents.described_by
    parts: list[Part | None] = []
    if known is not None and known.parameters:
        parts += [Heading("Parameters"), _parameters(known.parameters, known.changed)]
    numeric = robot.numeric if isinstance(robot, Robot) else robot
    legs = parts_at_home(numeric)
    words = "Joints and elastic parts of every leg in the home configuration, in world axes [m]"
    tables: list[Any] = []
    for leg, found in legs.items():
        tables += [Heading(leg), *_parts_of(found)]
    parts.append(Folded(words, tuple(tables)))
    parts.append(Paragraph("Parts that are not listed as elastic are rigid.", Tone.QUIET))
    if known is not None:
        parts.append(Paragraph(f"File {known.name}, SHA-256 {known.digest}.", Tone.QUIET))
        parts.append(Folded(f"The file {known.name}", (Verbatim(known.text),)))
    return section("inputs", "What was given", parts)


def _parameters(written: Any, changed: Any) -> Table:
    rows = []
    for name, value in written.items():
        own = str(changed[name]) if name in changed else str(value)
        rows.append([name, own, f"instead of {value}" if name in changed else ""])
    if not changed:
        return Table(["parameter", "value"], [cells[:2] for cells in rows])
    return Table(["parameter", "value", "changed"], rows)


def _parts_of(found: list[dict[str, Any]]) -> Iterator[Table]:
    joints = [part for part in found if part["kind"] == "joint"]
    elastic = [part for part in found if part["kind"] == "elastic"]
    if joints:
        yield Table(
            ["joint", "motion", "point", "axis", "stiffness", "limits"],
            [_joint(part) for part in joints],
        )
    if elastic:
        yield Table(
            ["elastic part", "end", "length", "forces x y z [N/m]", "moments x y z [N m/rad]"],
            [_elastic(part) for part in elastic],
        )


def _joint(part: dict[str, Any]) -> list[Cell]:
    stiffness: Cell = "" if part["role"] == "passive" else "rigid"
    if part["stiffness"] is not None:
        stiffness = Number(part["stiffness"], _UNITS[part["unit"] != "m"])
    limits = part.get("limits")
    reach = "" if limits is None else f"{limits[0]:.6g} to {limits[1]:.6g} {part['unit']}"
    motion = f"{part['motion']}, {part['role']}"
    return [
        part["name"],
        motion,
        f"({row(part['point'])})",
        f"({row(part['axis'])})",
        stiffness,
        reach,
    ]


def _elastic(part: dict[str, Any]) -> list[Cell]:
    length = Number(part["length"], "m") if "length" in part else ""
    return [
        part["name"],
        f"({row(part['point'])})",
        length,
        _alone(part["translation"]),
        _alone(part["rotation"]),
    ]


def _alone(values: list[float | None]) -> str:
    """Load over displacement in each direction alone."""
    return ", ".join("rigid" if v is None else "free" if v == 0 else f"{v:.5g}" for v in values)
