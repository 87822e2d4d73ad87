"""The robot at the pose, all that was given, how its stiffness was computed, and the formula."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from importlib.metadata import version
from typing import Any

import numpy as np

from robostiff.analysis import CableStiffness
from robostiff.analysis.parts_at_home import parts_at_home
from robostiff.markup import Cell, Facts, Heading, Number, Paragraph, Table, Tone, number, row
from robostiff.model import Actuated, Robot
from robostiff.model.cable import CableRobot
from robostiff.model.in_words import elements_in_words, placed_in_words
from robostiff.network import Network, SpringElement
from robostiff.plot.posed_robot import Colouring, picture_of_posed
from robostiff.report.contents import ReportContents, Reported
from robostiff.report.section import (
    Folded,
    FormulaBlock,
    Part,
    Section,
    Verbatim,
    one_figure,
    section,
)
from robostiff.version import __version__


def robot_section(contents: ReportContents) -> Section:
    """Source, legs or cables, and a picture of the robot at the pose."""
    robot, posed = contents.robot, contents.posed
    parts: list[Part | None] = []
    if contents.source:
        parts.append(Paragraph(f"Source: {contents.source}"))
    if isinstance(robot, Robot | CableRobot):
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


_UNITS = ("N/m", "N m/rad")


def inputs_section(contents: ReportContents) -> Section:
    """All values that the results follow from, so that they can be checked and computed again."""
    robot, known = contents.robot, contents.described_by
    parts: list[Part | None] = []
    if known is not None and known.parameters:
        parts += [Heading("Parameters"), _parameters(known.parameters, known.changed)]
    numeric = robot.numeric if isinstance(robot, Robot) else robot
    if isinstance(numeric, CableRobot):
        parts += _cables(numeric)
    elif isinstance(numeric, Network):
        words = "Beams, elastic parts and joints, in world axes [m]"
        parts.append(Folded(words, tuple(_network(numeric))))
    else:
        words = "Joints and elastic parts of every leg in the home configuration, in world axes [m]"
        every = parts_at_home(numeric).items()
        tables: list[Any] = list(
            _parts_of([{**own, "name": f"{leg}/{own['name']}"} for leg, of in every for own in of])
        )
        if isinstance(numeric, Robot) and numeric.is_coupled:
            tables += [Heading("Coupled joints"), _couplings(numeric)]
        parts.append(Folded(words, tuple(tables)))
    if not isinstance(numeric, CableRobot):
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
        heads = ["elastic part", "end", "forces x y z [N/m]", "moments x y z [N m/rad]", "length"]
        rows = [_elastic(part) for part in elastic]
        width = len(heads) if any("length" in part for part in elastic) else -1
        yield Table(heads[:width], [cells[:width] for cells in rows])


def _couplings(robot: Robot) -> Table:
    """Sums of joint coordinates, what they are at home, and what holds them."""
    rows: list[list[Cell]] = []
    for leg in robot.legs:
        own = leg.chain.transmission
        for i, one in () if own is None else own.sums.items():
            place = leg.chain.own_places[i]
            turns = leg.chain.freedoms[place].turns
            k = one.role.stiffness
            rows.append(
                [
                    f"{leg.name}/{one.name}",
                    one.in_words,
                    Number(float(leg.chain.home[place]), "rad" if turns else "m"),
                    "actuated" if isinstance(one.role, Actuated) else "locked",
                    "rigid" if k is None else Number(float(k), _UNITS[bool(turns)]),
                ]
            )
    return Table(["coupling", "sum", "at home", "role", "stiffness"], rows)


def _network(network: Network) -> Iterator[Table]:
    if network.beams:
        rows: list[list[Cell]] = [
            [
                beam.name,
                f"{beam.a}, {beam.b}",
                f"({row(beam.start)})",
                f"({row(beam.end)})",
                Number(float(np.linalg.norm(beam.end - beam.start)), "m"),
            ]
            for beam in network.beams
        ]
        yield Table(["beam", "between", "start", "end", "length"], rows)
    elastic = [spring for spring in network.springs if np.any(spring.elasticity.compliance)]
    if elastic:
        rows = [
            [spring.name, f"{spring.a}, {spring.b}", f"({row(spring.point)})", _softness(spring)]
            for spring in elastic
        ]
        yield Table(["elastic part", "between", "end", "compliance along its axes"], rows)
    rows = []
    for joint in network.joints:
        for freedom in joint.freedoms:
            stiffness: Cell = "" if freedom.is_passive else "rigid"
            if freedom.stiffness is not None:
                stiffness = Number(float(freedom.stiffness), _UNITS[bool(freedom.turns)])
            place = [f"({row(np.asarray(own))})" for own in (freedom.point, freedom.axis)]
            name = f"{joint.name}/{freedom.name}" if freedom.name != joint.name else joint.name
            driven = "actuated" if isinstance(freedom.role, Actuated) else "locked"
            role = "passive" if freedom.is_passive else driven
            motion = f"{'turns' if freedom.turns else 'slides'}, {role}"
            rows.append([name, f"{joint.a}, {joint.b}", motion, *place, stiffness])
    if rows:
        yield Table(["joint", "between", "motion", "point", "axis", "stiffness"], rows)


def _softness(spring: SpringElement) -> str:
    """Compliance of each direction alone, in its own axes."""
    C = np.diag(spring.elasticity.compliance)
    return f"{row(C[:3])} m/N; {row(C[3:])} rad/(N m)"


def _cables(robot: CableRobot) -> Iterator[Part]:
    rows: list[list[Cell]] = [
        [
            cable.name,
            f"({row(cable.exit_point)})",
            f"({row(cable.attachment)})",
            "rigid" if cable.EA is None else Number(float(cable.EA), "N"),
            "rigid" if cable.winch_stiffness is None else Number(cable.winch_stiffness, "N/m"),
            f"{number(cable.least_tension)} to {number(cable.greatest_tension)}",
        ]
        for cable in robot.cables
    ]
    heads = ["cable", "exit point [m]", "attachment on the platform [m]", "EA", "winch"]
    yield Table([*heads, "tension limits [N]"], rows)
    if robot.weight is not None:
        force, point = row(robot.weight.force), row(robot.weight.point)
        yield Paragraph(f"Weight ({force}) N at ({point}) m of the platform.")


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
    return [
        part["name"],
        f"({row(part['point'])})",
        _alone(part["translation"]),
        _alone(part["rotation"]),
        Number(part["length"], "m") if "length" in part else "",
    ]


def _alone(values: list[float | None]) -> str:
    """Load over displacement in each direction alone."""
    return ", ".join("rigid" if v is None else "free" if v == 0 else f"{v:.5g}" for v in values)
