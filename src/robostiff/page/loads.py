"""Equilibria, critical loads, natural vibrations and loaded networks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np

from robostiff.analysis import PartShare
from robostiff.elastostatics import Status
from robostiff.markup import (
    COMPLIANCE_UNITS,
    STIFFNESS_UNITS,
    Block,
    Bullets,
    Cell,
    Facts,
    LabelledMatrix,
    Number,
    Page,
    Paragraph,
    Table,
    Tone,
    number,
    percent,
    row,
)
from robostiff.network import NetworkResponse
from robostiff.page.of_result import UNDER_LOAD, attributes, attributes_of, order
from robostiff.page.stiffness import energy_table, load_table, named_values
from robostiff.statics import CriticalLoad, Equilibrium, Modes

if TYPE_CHECKING:
    import xarray

    from robostiff.statics.equations.newton import FoundEquilibrium

_OF_PATH = ("factor", "displacement", "stable")
KNOWN = 1e-9  # of the largest: what is smaller is rounding
_CANCELLED = 1e-15  # of the largest entry, rotations in lengths of the robot
_COORDINATES = 1e-15  # of the size: so far apart may be what rests in one place


def equilibrium_page(
    result: Equilibrium, critical: CriticalLoad | None = None, curve: xarray.Dataset | None = None
) -> Page:
    """An equilibrium, with the critical load of its wrench and a curve of `load_path`."""
    known = result.has_answer
    has_K, has_C = result.status.has_stiffness, not result.status & Status.FREE_MOTIONS
    data: dict[str, Any] = {
        "order": order(result.space),
        "units": UNDER_LOAD,
        "stable": result.stable,
        "critical_factor": result.critical_factor,
        **attributes(result, "wrench displacement pose point energy margin", known),
        **attributes(result, "K K_sym K_total", has_K),
        "compliance": result.compliance if known and has_C else None,
        "margins": dict(result.margins),
        "divisions": dict(result.divisions),
        "reactions": result.reactions if known else [],
        "parts": attributes_of(
            result.parts if known else (), "leg part number of wrench point motion load energy"
        ),
        "springs": attributes_of(
            result.springs if known else (), "name points length tension energy"
        ),
    }
    blocks = _equilibrium_blocks(result) if known else []
    if critical is not None:
        page = critical_page(critical)
        blocks += page.blocks
        data["critical_load"] = {"status": critical.status, **page.data}
    if curve is not None:
        # null in its data where there is no equilibrium
        columns = [curve[name].values for name in ("factor", "displacement", "status_code")]
        rows: list[list[Cell]] = []
        for factor, moved, code in zip(*columns, strict=True):
            words = "none" if np.isnan(moved).any() else row(moved)
            rows.append([Number(float(factor)), words, str(Status(int(code)))])
        moved = f"displacement ({' '.join(result.space.twist_order)}) [m, rad]"
        blocks.append(Table(("factor", moved, "status"), rows))
        data["load_path"] = {
            "factors": columns[0],
            "displacement": [None if np.isnan(twist).any() else twist for twist in columns[1]],
            "stable": curve["stable"].values,
            "status": [Status(int(code)) for code in columns[2]],
            **{f"path_{name}": curve[f"path_{name}"].values for name in _OF_PATH},
        }
    return Page(
        result.name,
        f" under load, about ({row(result.point)}) m, world axes" if known else " under load",
        result.status,
        blocks,
        result.advice,
        data,
    )


def _equilibrium_blocks(result: Equilibrium) -> list[Block | None]:
    """Displacement, stability, K under load, energy, springs and drives."""
    space = result.space
    moved, least, is_strained = result.displacement, 0.0, True
    if result.found is not None and result.status.has_stiffness:  # beyond rounding
        length, d = result.found.problem.length, space.translations
        least = _COORDINATES * min(length, 1.0)
        of_rounding = np.abs(result.K[:d, :d]).max() * (_COORDINATES * length) ** 2
        is_strained = bool(result.energy > of_rounding)
    least = max(KNOWN * np.abs(moved).max(initial=0.0), least)
    words = ", ".join(f"{name} into {n} elements" for name, n in result.divisions.items())
    divided = [("beams that bend far, divided", words)] if words else []
    blocks: list[Block | None] = [
        load_table(space, result.wrench, np.where(np.abs(moved) < least, 0.0, moved)),
        Facts((("pose", f"[{row(result.pose)}] (m, rad)"), *divided)),
    ]
    if result.critical is None or not result.stable:
        blocks.append(Paragraph(stability_in_words(result)))
    blocks.append(matrix_under_load(result))
    if result.energy > 0 and is_strained:
        blocks.append(energy_table(result.shares, result.energy))
    if result.springs:
        are_cables = all(spring.is_cable for spring in result.springs)
        rows = [
            [s.name, Number(s.tension, "N"), Number(s.length, "m"), Number(s.energy, "J")]
            for s in result.springs
        ]
        title = "cables:" if are_cables else "springs between bodies:"
        blocks.append(Table(["spring", "tension", "length", "energy"], rows, title))
    # what elastic drives and locks carry; rounding is shown as zero
    loads = [p for p in result.parts if p.load is not None and (p.energy > 0 or p.load)]
    largest = max((abs(p.load or 0.0) for p in loads), default=0.0)
    drives = {}
    for p in loads:
        load = float(p.load or 0.0)
        drives[f"{p.leg}/{p.part}"] = (load if abs(load) > KNOWN * largest else 0.0, p.unit)
    if drives and is_strained:
        rows = [[name, Number(*value)] for name, value in drives.items()]
        blocks.append(Table(["elastic drive", "load"], rows))
    return blocks


def stability_in_words(result: Equilibrium) -> str:
    """Whether the robot stays where it is, and its margin."""
    words = "stable" if result.stable else "not stable"
    return f"{words}, margin {number(result.margin)} of 1 without load"


def matrix_under_load(result: Equilibrium) -> LabelledMatrix | None:
    """K under load; the compliance where a direction is rigid, none beside a free motion."""
    F, t = result.space.wrench_order, result.space.twist_order
    if result.status.has_stiffness:
        # zero where terms of the size of the largest entry cancel up to rounding
        K, scale = result.K, cast("FoundEquilibrium", result.found).problem.scale
        sizes = np.abs(K) / np.outer(scale, scale)
        K = np.where(sizes > _CANCELLED * sizes.max(initial=0.0), K, 0.0)
        return LabelledMatrix("K under load", K, F, t, STIFFNESS_UNITS)
    if result.status & Status.FREE_MOTIONS:
        return None
    return LabelledMatrix("C under load", result.compliance, t, F, COMPLIANCE_UNITS)


def critical_page(critical: CriticalLoad) -> Page:
    """The factor of the wrench at which a robot loses its stability, and how."""
    if critical.is_found:
        factor = number(critical.factor)
        lines = [f"critical load: {factor} times the wrench", f"there {critical.mode}"]
    elif critical.searched_to > 0:
        lines = [f"no critical load up to {number(critical.searched_to)} times the wrench"]
    elif critical.status & Status.FREE_MOTIONS:
        lines = ["no critical load is determined: hold the free motions of the platform"]
    else:
        lines = ["no critical load: there is no stable equilibrium to start from"]
    return Page(
        critical.name,
        " under a growing load",
        critical.status,
        [Bullets(tuple(lines))],
        critical.advice,
        {
            **attributes(critical, "factor mode leg is_limit", critical.is_found),
            "searched_to": critical.searched_to,
        },
    )


_MOST = 10  # modes, or parts of a network, in a list
_SHARES = 3  # parts with the most energy, of each mode


def modes_page(result: Modes, masses: Any = None, in_words: tuple[str, ...] = ()) -> Page:
    """Natural vibrations, slowest first, and the masses of the model as `check` has them."""
    pairs = zip(attributes_of(result, "frequency growth twist words"), result, strict=True)
    rows: list[list[Cell]] = []
    for i, mode in enumerate(result.each[:_MOST], start=1):
        most = [part for part in mode.shares[:_SHARES] if part.share >= 0.005]
        shares = [f"{part.name} {percent(part.share, 0)}" for part in most]
        rate: Cell = Number(mode.frequency, "Hz")
        if mode.growth != 0:
            rate = f"grows by {number(mode.growth)} /s"
        rows.append([str(i), rate, mode.words, ", ".join(shares) or "none"])
    table = Table(["mode", "frequency", "motion", "most energy in"], rows)
    more = len(result) - _MOST
    rest = Paragraph(f"{more} more at higher frequencies", Tone.QUIET) if more > 0 else None
    return Page(
        result.name,
        "",
        result.status,
        [table, rest, Bullets(in_words)] if result.each else [],
        result.status.advice,
        {
            "order": order(result.space),
            "units": {"length": "m", "angle": "rad", "frequency": "Hz", "growth": "1/s"},
            "modes": [
                {**facts, "shares": attributes_of(mode.shares, "leg part share")}
                for facts, mode in pairs
            ],
            "masses": masses,
        },
        before="natural vibrations of ",
    )


_SECTION = ("N", "Vy", "Vz", "T", "My", "Mz")


def response_page(result: NetworkResponse) -> Page:
    """How the nodes of a network move under loads, and what its supports and beams carry."""
    network, space = result.network, result.network.space
    d = space.translations
    turns = space.size - d
    twists, shifts = (_without_rounding(motions, d) for motions in (result.twists, result.shifts))
    reactions = _without_rounding(result.reactions, d)
    moved = [(n, named_values(space.twist_order, 1e6 * t, "µm", "µrad")) for n, t in twists.items()]
    for name in result.free_nodes:
        words = "can move freely"
        if name in shifts:
            shift = named_values(space.twist_order[:d], 1e6 * shifts[name], "µm", "µrad")
            words = f"{shift}; it spins freely"
        moved.append((name, words))
    supports = [(n, named_values(space.wrench_order, F, "N", "N m")) for n, F in reactions.items()]
    supports += [(n, "statically indeterminate") for n in network.fixed if n not in reactions]
    blocks: list[Block | None] = [
        Table(("node", "displacement [µm, µrad]"), moved),
        Table(("support", "reaction [N, N m]"), supports),
    ]
    sections = {name: attributes(beam, "start end") for name, beam in result.beams.items()}
    if sections:
        ends = {f"{name}, {end}": F for name, beam in sections.items() for end, F in beam.items()}
        forces = _without_rounding(ends, 3).items()
        rows = [[name, *(Number(float(x)) for x in F)] for name, F in forces]
        title = "forces in beams, start and end [N, N m], N > 0 in tension:"
        blocks.append(Table(["", *_SECTION], rows, title))
    energies = sorted(result.loads.energies, key=lambda part: -part[2])
    whole = sum(energy for *_, energy in energies) or 1.0
    shares = [PartShare(of, part, energy, energy / whole) for of, part, energy in energies]
    blocks.append(energy_table(shares, result.energy))
    displacements = {
        node.name: [*result.shifts[node.name], *[None] * turns]
        if node.name in result.shifts
        else None
        for node in network.nodes
    }
    return Page(
        network.name,
        " under load",
        result.status,
        blocks,
        data={
            "network": network.name,
            "order": order(space),
            "units": UNDER_LOAD,
            "displacements": displacements | result.twists,
            "reactions": {name: result.reactions.get(name) for name in network.fixed},
            "beams": {
                name: {end: dict(zip(_SECTION, F.tolist(), strict=True)) for end, F in beam.items()}
                for name, beam in sections.items()
            },
            "energies": [
                {"part": part, "of": of, "energy": J} for of, part, J in result.loads.energies
            ],
            "energy": result.energy,
        },
    )


def _without_rounding(rows: dict[str, np.ndarray], split: int) -> dict[str, np.ndarray]:
    """Zero in place of what is rounding beside the largest of its kind."""
    if not rows:
        return {}
    sizes = np.split(np.abs([*rows.values()]), [split], axis=1)
    largest = np.concatenate([np.full(size.shape[1], size.max(initial=0.0)) for size in sizes])
    return {n: np.where(np.abs(x) > KNOWN * largest, x, 0.0) for n, x in rows.items()}
