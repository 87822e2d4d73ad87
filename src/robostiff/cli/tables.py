"""Results as tables on a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from robostiff.analysis import Deflection, RobotStiffness
from robostiff.analysis.parts_at_home import part_in_words
from robostiff.cli.output import BAR, shown
from robostiff.elastostatics import Status
from robostiff.io.results.text import about, named, named_parts, shown_loads, shown_twist
from robostiff.markup import STIFFNESS_UNITS, number, row, shown_matrix

_MOST_PARTS = 12


def print_facts(facts: Mapping[str, Any]) -> None:
    """The parts of a robot."""
    console = Console(soft_wrap=True)
    console.print(_text(f"{facts['name']}: {facts['kind']}, {facts['space']}", style="bold"))
    for line in _fact_lines(facts):
        console.print(_text(line))
    for leg, parts in facts.get("parts", {}).items():
        console.print(_text(f"{leg} at home, from base to platform", style="italic"))
        for part in parts:
            console.print(_text(f"  {part_in_words(part)}"))
    for line in _home_lines(facts):
        console.print(_text(line))


def _fact_lines(facts: Mapping[str, Any]) -> Iterator[str]:
    for key in ("title", "source"):
        if facts[key]:
            yield f"{key}: {' '.join(facts[key].split())}"
    if facts["coordinates"]:
        yield f"free coordinates: {' '.join(facts['coordinates'])}"
    for leg in facts["legs"]:
        freedoms = f"{leg['passive_freedoms']} passive, {leg['actuated_freedoms']} actuated"
        yield f"{leg['name']}: {', '.join(leg['elements'])}; {freedoms}"
    if "platform" in facts:
        platform = facts["platform"]
        held = ", ".join(f"{leg} at {node}" for leg, node in platform["legs"].items())
        parts = ", ".join(platform["parts"])
        yield f"flexible platform: {parts}; tool at {platform['tool']}, {held}"
    yield from mass_lines(facts)
    if facts["kind"] == "cable robot":
        yield f"cables: {', '.join(facts['cables'])}"
    if facts["kind"] == "network":
        counted = ("bodies", "beams", "springs", "joints", "passive_freedoms", "elastic_freedoms")
        yield ", ".join(f"{facts[key]} {key.replace('_', ' ')}" for key in counted)


def _home_lines(facts: Mapping[str, Any]) -> Iterator[str]:
    mobility = facts.get("mobility")
    if mobility and mobility["freedoms"] != len(facts["coordinates"]):
        count, free = mobility["freedoms"], " ".join(mobility["coordinates"])
        yield f"this platform has {count} freedoms at home: {free}; poses outside are unreachable"
    home = facts["home"]
    yield f"at home: rank {home['rank']}, status {home['status']}"
    yield from (f"free: {motion}" for motion in home["free_motions"])
    yield from (f"advice: {advice}" for advice in home["advice"])
    if "picture" in facts:
        yield f"picture: {facts['picture']}"


def mass_lines(facts: Mapping[str, Any]) -> list[str]:
    """Masses of a robot at home, equal ones of several legs together, and its gravity."""
    lines = []
    if "masses" in facts:
        masses = facts["masses"]
        count: dict[tuple[str, str], int] = {}
        for name, value in masses["parts"].items():
            leg, _, part = name.partition("/")
            called = name if leg == "platform" else part
            key = (called, f"{value:.4g} kg")
            count[key] = count.get(key, 0) + 1
        parts = [f"{n} x {part} {m}" if n > 1 else f"{part} {m}" for (part, m), n in count.items()]
        lines.append(f"masses: {', '.join(parts)}; {masses['total']:.4g} kg in all")
        if "centre" in masses:
            lines[-1] += f" at ({row(np.array(masses['centre']))}) m"
    if "gravity" in facts:
        lines.append(f"gravity: ({row(np.array(facts['gravity']))}) m/s^2")
    for own in facts.get("springs", ()):
        lines.append(
            f"spring {own['name']} between {' and '.join(own['bodies'])}: "
            f"{own['stiffness']:.4g} N/m, {own['length']:.4g} m long at home, "
            f"tension {own['tension']:.4g} N; under finite loads alone"
        )
    return lines


def print_stiffness(result: RobotStiffness) -> None:
    """K with labels, then rank, free motions, redundant joints and decision."""
    console = Console()
    _print_head(console, result, result.status)
    if np.all(result.answered):
        console.print()
        console.print(_text(f"K_C [{STIFFNESS_UNITS}]", style="italic"))
        console.print(_matrix_table(result))
        console.print()
    if Status.UNREACHABLE not in result.status:
        console.print(_text(f"rank {int(result.rank)} of {result.space.size}", style="bold"))
        for motion in result.free_motions:
            console.print(_text(f"  free: {motion}"))
        for name in result.redundant_joints:
            console.print(_text(f"  redundant passive joint: {name}"))
        for wrench in result.rigid_directions:
            console.print(_text(f"  rigid direction: {row(wrench)}"))
        console.print(_text(f"decided by: {result.decision}", style="dim"))
    console.print(_text(f"method: {result.method.name}, {result.method.equation}", style="dim"))
    _print_advice(console, result.advice)


def print_deflection(result: Deflection) -> None:
    """The deflection, then the elastic energy of parts and the loads of actuators."""
    console, answer = Console(), result.stiffness
    _print_head(console, answer, result.status)
    console.print(
        _text(f"load:       {named(answer.space.wrench_order, result.wrench, 'N', 'N m')}")
    )
    if result.has_answer:
        shown = shown_twist(result)
        words = named(answer.space.twist_order, shown, "um", "urad")
        console.print(_text(f"deflection: {words}", style="bold"))
        for motion in answer.free_motions:
            console.print(_text(f"  free: {motion}"))
        title = f"elastic energy {result.energy:.4g} J, by part"
        if result.energy > 0:
            console.print()
            console.print(_text(title, style="italic"))
            console.print(_parts_table(result))
        if result.actuators:
            console.print()
            console.print(_text("load on the actuators", style="italic"))
            console.print(_actuator_table(result))
    _print_advice(console, result.advice)


def _print_head(console: Console, result: RobotStiffness, status: Status) -> None:
    console.print(_text(result.name, style="bold"), _text(about(result)))
    style = "bold red" if status.is_bad else "yellow" if status else "green"
    console.print(_text("status:"), _text(str(status), style=style))


def _print_advice(console: Console, advice: tuple[str, ...]) -> None:
    for sentence in advice:
        console.print(_text(f"advice: {sentence}", style="yellow"))


def _matrix_table(result: RobotStiffness) -> Table:
    table = Table(box=None, pad_edge=False)
    table.add_column("")
    for name in result.space.twist_order:
        table.add_column(name, justify="right", no_wrap=True)
    for name, values in zip(result.space.wrench_order, shown_matrix(result.K), strict=True):
        cells = [_text(number(v), style="" if v else "dim") for v in values]
        table.add_row(_text(name, style="bold"), *cells)
    return table


def _parts_table(result: Deflection) -> Table:
    table = Table(box=None, pad_edge=False)
    table.add_column("share", justify="right")
    table.add_column("part")
    table.add_column("")
    named_ones, rest = named_parts(result.parts, _MOST_PARTS)
    for part in named_ones:
        bar = BAR * round(30 * part.share)
        table.add_row(f"{100 * part.share:.2f} %", _text(f"{part.leg}/{part.part}"), bar)
    if rest:
        table.add_row(f"{100 * sum(p.share for p in rest):.2f} %", f"{len(rest)} more parts", "")
    return table


def _actuator_table(result: Deflection) -> Table:
    table = Table(box=None, pad_edge=False)
    table.add_column("N or N m", justify="right")
    table.add_column("actuator")
    for load, actuator in zip(shown_loads(result), result.actuators, strict=True):
        table.add_row(number(load), _text(f"{actuator.leg}/{actuator.joint}"))
    return table


def _text(words: str, style: str = "") -> Text:
    """Text without markup."""
    return Text(shown(words), style=style)
