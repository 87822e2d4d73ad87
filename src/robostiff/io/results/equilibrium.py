"""Equilibria, critical loads, natural vibrations and loaded networks as text and as plain data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis.deflection_under_load import part_name
from robostiff.elastostatics import Status
from robostiff.io.results.stiffness import (
    head,
    load_line,
    matrix_lines,
    named,
    order,
    picked,
    plain,
    share_lines,
)
from robostiff.markup import number, row, text_of
from robostiff.network import Network, NetworkResponse
from robostiff.statics import CriticalLoad, Equilibrium, Modes
from robostiff.statics.result_tables import matrix_under_load
from robostiff.version import __version__

if TYPE_CHECKING:
    import xarray


_MOST = 10  # parts or modes in a list
_SHOWN = 1e-9  # of the largest: smaller is rounding
_COORDINATES = 1e-15  # of the size: so far apart may be what rests in one place


def equilibrium_text(result: Equilibrium, critical: CriticalLoad | None) -> str:
    """An equilibrium, and the critical load of the same wrench, as lines of text."""
    lines = [f"{result.name} under load", f"status: {result.status}"]
    if result.has_answer:
        space = result.space
        lines[0] += f", about ({row(result.point)}) m, world axes"
        lines.append(f"wrench:       {named(space.wrench_order, result.wrench, 'N', 'N m')}")
        moved, least, is_strained = result.displacement, 0.0, True
        if result.problem is not None and result.status.has_stiffness:  # beyond rounding
            length, d = result.problem.length, space.translations
            least = _COORDINATES * min(length, 1.0)
            of_rounding = np.abs(result.K[:d, :d]).max() * (_COORDINATES * length) ** 2
            is_strained = bool(result.energy > of_rounding)
        least = max(_SHOWN * np.abs(moved).max(initial=0.0), least)
        moved = np.where(np.abs(moved) < least, 0.0, 1e6 * moved)
        lines.append(f"displacement: {named(space.twist_order, moved, 'um', 'urad')}")
        lines.append(f"pose:         [{row(result.pose)}] (m, rad)")
        if result.critical is None or not result.stable:
            words = "stable" if result.stable else "not stable"
            lines.append(f"{words}, margin {result.margin:.4g} of 1 without load")
        matrix = matrix_under_load(result)
        if matrix is not None:
            lines += ["", f"{matrix.symbol} [{matrix.units}]:"]
            lines += matrix_lines(matrix.values, matrix.rows, matrix.columns)
        of_parts = sum(share.energy for share in result.shares)
        if of_parts > 0 and is_strained:
            lines += share_lines(of_parts, result.shares, _MOST)
        if result.springs:
            are_cables = all(own.is_cable for own in result.springs)
            lines += ["", "cables:" if are_cables else "springs between bodies:"]
            lines += [
                f"  {own.name}: tension {own.tension:.5g} N, length {own.length:.5g} m, "
                f"energy {own.energy:.4g} J"
                for own in result.springs
            ]
        drives = _drives(result)
        if drives and is_strained:
            lines += ["", "load on elastic drives:"]
            lines += [load_line(load, unit, name) for name, (load, unit) in drives.items()]
    if critical is not None:
        lines += ["", *_critical_lines(critical)]
    lines += [f"advice: {advice}" for advice in result.advice]
    return text_of(lines)


def _critical_lines(critical: CriticalLoad) -> list[str]:
    if not critical.is_found and critical.searched_to == 0:
        if critical.status & Status.FREE_MOTIONS:
            return ["no critical load is determined: hold the free motions of the platform"]
        return ["no critical load: there is no stable equilibrium to start from"]
    if not critical.is_found:
        return [f"no critical load up to {critical.searched_to:g} times the wrench"]
    return [f"critical load: {critical.factor:.6g} times the wrench", f"there {critical.mode}"]


def _drives(result: Equilibrium) -> dict[str, tuple[float, str]]:
    """What elastic drives and locks carry, with its unit; rounding is shown as zero."""
    loads = {
        f"{part.leg}/{part.part}": (part.load, part.unit)
        for part in result.parts
        if part.load is not None and (part.energy > 0 or part.load != 0)
    }
    largest = max((abs(v) for v, _ in loads.values()), default=0.0)
    return {k: (v if abs(v) > _SHOWN * largest else 0.0, u) for k, (v, u) in loads.items()}


def equilibrium_data(
    result: Equilibrium, critical: CriticalLoad | None = None, curve: xarray.Dataset | None = None
) -> dict[str, Any]:
    """An equilibrium, with the critical load of its wrench and a curve of `load_path`, as data.

    JSON-ready; null where there is no equilibrium, or no critical load up to where it was searched.
    """
    known = result.has_answer
    data: dict[str, Any] = {
        **head(result.name, result),
        "order": order(result.space),
        "units": {"length": "m", "angle": "rad", "force": "N", "moment": "N m", "energy": "J"},
        "stable": result.stable,
        "critical_factor": result.critical_factor,
    }
    names = ("wrench", "displacement", "pose", "point", "energy", "margin")
    data |= {n: plain(getattr(result, n)) if known else None for n in names}
    has_K, has_C = result.status.has_stiffness, not result.status & Status.FREE_MOTIONS
    data |= {n: plain(getattr(result, n)) if has_K else None for n in ("K", "K_sym", "K_total")}
    data["compliance"] = plain(result.compliance) if known and has_C else None
    data["margins"] = dict(result.margins)
    data["reactions"] = [own.tolist() for own in result.reactions] if known else []
    parts, springs = (result.parts, result.springs) if known else ((), ())
    data["parts"] = picked(parts, "leg part number of wrench point motion load energy")
    data["springs"] = picked(springs, "name points length tension energy")
    if critical is not None:
        data["critical_load"] = {
            "status": str(critical.status),
            **{
                name: getattr(critical, name) if critical.is_found else None
                for name in ("factor", "mode", "leg", "is_limit")
            },
            "searched_to": critical.searched_to,
        }
    if curve is not None:
        data["load_path"] = curve_data(curve)
    return data


def curve_data(curve: xarray.Dataset) -> dict[str, Any]:
    """A force-deflection curve as plain data; null where there is no equilibrium."""
    moved = [
        None if np.isnan(own).any() else own.tolist() for own in curve["displacement"].to_numpy()
    ]
    return {
        "factors": curve["factor"].to_numpy().tolist(),
        "displacement": moved,
        "stable": curve["stable"].to_numpy().tolist(),
        "status": [str(Status(int(code))) for code in curve["status_code"].to_numpy()],
        "path_factor": curve["path_factor"].to_numpy().tolist(),
        "path_displacement": curve["path_displacement"].to_numpy().tolist(),
        "path_stable": curve["path_stable"].to_numpy().tolist(),
    }


_SHARES = 3  # parts with the most energy, of each mode


def modes_text(found: Modes) -> str:
    """Natural vibrations, slowest first, as lines of text."""
    lines = [f"natural vibrations of {found.name}", f"status: {found.status}"]
    for i, mode in enumerate(found.each[:_MOST], start=1):
        lines.append(f"{i:3}. {mode}")
        most = [own for own in mode.shares[:_SHARES] if own.share >= 0.005]
        if most:
            shares = ", ".join(f"{own.name} {own.share:.0%}" for own in most)
            lines.append(f"     elastic energy: {shares}")
    if len(found) > _MOST:
        lines.append(f"{len(found) - _MOST} more at higher frequencies")
    lines += [f"advice: {advice}" for advice in found.status.advice]
    return text_of(lines)


def modes_data(found: Modes) -> dict[str, Any]:
    """Natural vibrations, slowest first, as plain data, JSON-ready; none without an equilibrium."""
    return {
        "robostiff": __version__,
        "robot": found.name,
        "status": str(found.status),
        "advice": list(found.status.advice),
        "order": order(found.space),
        "units": {"length": "m", "angle": "rad", "frequency": "Hz", "growth": "1/s"},
        "modes": [
            {**own, "shares": picked(mode.shares, "leg part share")}
            for own, mode in zip(picked(found, "frequency growth twist words"), found, strict=True)
        ],
    }


_SECTION = ("N", "Vy", "Vz", "T", "My", "Mz")


def response_text(network: Network, result: NetworkResponse) -> str:
    """The result of `network_response` of a network, as lines of text."""
    space, d = network.space, network.space.translations
    lines = [f"{network.name} under load", f"status: {result.status}", ""]
    lines.append("displacement of nodes [um, urad]:")
    twists = _without_rounding(result.twists, d)
    lines += [
        f"  {n}: {named(space.twist_order, 1e6 * t, 'um', 'urad')}" for n, t in twists.items()
    ]
    moved = _without_rounding(result.shifts, d)
    for name in result.free_nodes:
        if name in moved:
            shift = named(space.twist_order[:d], 1e6 * moved[name], "um", "urad")
            lines.append(f"  {name}: {shift}; it spins freely")
        else:
            lines.append(f"  {name}: can move freely")
    lines += ["", "reaction of supports [N, N m]:"]
    reactions = _without_rounding(result.reactions, d)
    lines += [f"  {n}: {named(space.wrench_order, F, 'N', 'N m')}" for n, F in reactions.items()]
    left_out = [name for name in network.fixed if name not in reactions]
    lines += [f"  {name}: statically indeterminate" for name in left_out]
    if result.beams:
        lines += ["", "forces in beams, start and end [N, N m], N > 0 in tension:"]
        lines.append(" " * 24 + "".join(f"{name:>12}" for name in _SECTION))
    ends = {f"{n}, {end}": getattr(own, end) for n, own in result.beams.items() for end in _ENDS}
    for name, F in _without_rounding(ends, 3).items():
        lines.append(f"  {name:22}" + "".join(f"{number(x):>12}" for x in F))
    lines += ["", f"elastic energy {result.energy:.4g} J, by part:"]
    whole = sum(energy for *_, energy in result.loads.energies) or 1.0
    for before, after, energy in sorted(result.loads.energies, key=lambda part: -part[2])[:_MOST]:
        lines.append(f"{100 * energy / whole:7.2f} %  {part_name(before, after)}")
    return text_of(lines)


_ENDS = ("start", "end")


def _without_rounding(rows: dict[str, np.ndarray], split: int) -> dict[str, np.ndarray]:
    """Zero in place of what is rounding beside the largest of its kind."""
    if not rows:
        return {}
    every = np.abs(np.array(list(rows.values())))
    largest = np.empty(every.shape[1])
    largest[:split] = every[:, :split].max(initial=0.0)
    largest[split:] = every[:, split:].max(initial=0.0)
    return {n: np.where(np.abs(own) > _SHOWN * largest, own, 0.0) for n, own in rows.items()}


def response_data(network: Network, result: NetworkResponse) -> dict[str, Any]:
    """The result of `network_response` of a network, as plain data.

    JSON-ready; null where a displacement or reaction has no value.
    """
    free: Any = [None] * (network.space.size - network.space.translations)
    shifts = {node.name: result.shifts.get(node.name) for node in network.nodes}
    moved = {n: None if own is None else [*plain(own), *free] for n, own in shifts.items()}
    return {
        "robostiff": __version__,
        "network": network.name,
        "status": str(result.status),
        "order": order(network.space),
        "units": {"length": "m", "angle": "rad", "force": "N", "moment": "N m", "energy": "J"},
        "displacements": moved | {n: plain(twist) for n, twist in result.twists.items()},
        "reactions": {n: plain(result.reactions.get(n)) for n in network.fixed},
        "beams": {
            n: {end: dict(zip(_SECTION, getattr(own, end).tolist(), strict=True)) for end in _ENDS}
            for n, own in result.beams.items()
        },
        "energies": [
            {"part": after, "of": before, "energy": energy}
            for before, after, energy in result.loads.energies
        ],
        "energy": result.energy,
    }
