"""The robot at the pose, all that was given, how its stiffness was computed, and the formula."""

from __future__ import annotations

import platform
from importlib.metadata import version
from typing import Any

from robostiff.analysis import CableStiffness
from robostiff.markup import (
    Block,
    Facts,
    Folded,
    Heading,
    Number,
    Paragraph,
    Section,
    Table,
    Tone,
    Verbatim,
    row,
)
from robostiff.model import Actuated
from robostiff.page.facts import JOINT_UNITS, leg_table, part_tables, parts_at_home
from robostiff.report.contents import ReportContents
from robostiff.report.figures import TypesetFormula
from robostiff.version import __version__


def robot_section(contents: ReportContents) -> Section | None:
    """Source, free coordinates, joints of a linkage, and legs; nothing where none is known."""
    robot = contents.robot
    free = ", ".join(own.value for own in robot.coordinates)
    facts = {"source": contents.source, "free coordinates of the platform": free}
    blocks: list[Block | None] = [Facts(tuple(own for own in facts.items() if own[1]))]
    if contents.joints:
        blocks.append(Table(["joint", "coordinate"], list(contents.joints.items())))
    legs = leg_table(robot)
    if legs is not None:
        title = f"{len(legs.rows)} legs, element by element"
        blocks.append(legs if len(legs.rows) == 1 else Folded(title, (legs,)))
    return Section("robot", "The robot", blocks) if any(facts.values()) or blocks[1:] else None


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
    pose = ", ".join(contents.given) or "its own"
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
    if contents.no_derivation:
        facts["formula"] = f"none: {contents.no_derivation}"
    return Section("method", "How it was computed", [Facts(tuple(facts.items()))])


def formula_section(contents: ReportContents) -> Section | None:
    """The derivation step by step; nothing where there is none."""
    if contents.derivation is None:
        return None
    words = "Derivation of the stiffness matrix in the home configuration, step by step"
    folded = Folded(words, (TypesetFormula(contents.derivation),))
    return Section("formula", "The formula", [folded])


def inputs_section(contents: ReportContents) -> Section:
    """All values that the results follow from, so that they can be checked and computed again."""
    robot, known = contents.robot, contents.described_by
    blocks: list[Block] = []
    if known is not None and known.parameters:
        changed, heads = known.changed, ["parameter", "value", "changed"]
        rows = [
            [name, str(changed.get(name, value)), f"instead of {value}" if name in changed else ""]
            for name, value in known.parameters.items()
        ]
        if not changed:
            heads, rows = heads[:2], [cells[:2] for cells in rows]
        blocks += [Heading("Parameters"), Table(heads, rows)]
    numeric: Any = robot.numeric
    tables: list[Block] = [*part_tables(parts_at_home(numeric))]
    if not robot.is_frozen and getattr(numeric, "is_coupled", False):
        rows = []  # sums of joint coordinates
        for leg in numeric.legs:
            own = leg.chain.transmission
            for i, one in () if own is None else own.sums.items():
                place = leg.chain.own_places[i]
                turns, k = leg.chain.freedoms[place].turns, one.role.stiffness
                rows.append(
                    [
                        f"{leg.name}/{one.name}",
                        one.in_words,
                        Number(float(leg.chain.home[place]), "rad" if turns else "m"),
                        "actuated" if isinstance(one.role, Actuated) else "locked",
                        "rigid" if k is None else Number(float(k), JOINT_UNITS[bool(turns)]),
                    ]
                )
        tables.append(Table(["coupling", "sum", "at home", "role", "stiffness"], rows))
    if hasattr(numeric, "cables"):
        blocks += tables
        if numeric.weight is not None:
            force, point = row(numeric.weight.force), row(numeric.weight.point)
            blocks.append(Paragraph(f"Weight ({force}) N at ({point}) m of the platform."))
    else:
        at = " in the home configuration" if hasattr(numeric, "legs") else ""
        blocks.append(Folded(f"Joints and elastic parts{at}, in world axes [m]", tuple(tables)))
        blocks.append(Paragraph("Parts that are not listed as elastic are rigid.", Tone.QUIET))
    if known is not None:
        blocks.append(Table(["file", "SHA-256"], list(known.files.items())))
        blocks.append(Folded(f"The file {known.name}", (Verbatim(known.text),)))
    return Section("inputs", "What was given", blocks)
