"""Equilibria, critical loads and natural vibrations as text and as plain data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.io.results.data import head, order, picked, plain
from robostiff.io.results.text import load_line, matrix_lines, named, share_lines
from robostiff.markup import row, text_of
from robostiff.statics import CriticalLoad, Equilibrium, EquilibriumStatus, Modes
from robostiff.statics.result_tables import matrix_under_load
from robostiff.version import __version__

if TYPE_CHECKING:
    import xarray

_MOST = 10  # parts or modes in a list
_SHOWN = 1e-9  # of the largest: smaller is rounding


def equilibrium_text(result: Equilibrium, critical: CriticalLoad | None) -> str:
    """An equilibrium, and the critical load of the same wrench, as lines of text."""
    lines = [f"{result.name} under load", f"status: {result.status}"]
    if result.has_answer:
        space = result.space
        lines[0] += f", about ({row(result.point)}) m, world axes"
        lines.append(f"wrench:       {named(space.wrench_order, result.wrench, 'N', 'N m')}")
        moved = 1e6 * result.displacement
        moved = np.where(np.abs(moved) < _SHOWN * np.abs(moved).max(initial=0.0), 0.0, moved)
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
        if of_parts > 0:
            lines += share_lines(of_parts, result.shares, _MOST)
        if result.springs:
            lines += ["", "springs between bodies:"]
            lines += [
                f"  {own.name}: tension {own.tension:.5g} N, length {own.length:.5g} m, "
                f"energy {own.energy:.4g} J"
                for own in result.springs
            ]
        drives = _drives(result)
        if drives:
            lines += ["", "load on elastic drives:"]
            lines += [load_line(load, unit, name) for name, (load, unit) in drives.items()]
    if critical is not None:
        lines += ["", *_critical_lines(critical)]
    lines += [f"advice: {advice}" for advice in result.advice]
    return text_of(lines)


def _critical_lines(critical: CriticalLoad) -> list[str]:
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
    has_K, has_C = result.status.has_stiffness, not result.status & EquilibriumStatus.FREE_MOTIONS
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
    return {**data, "robostiff": __version__}


def curve_data(curve: xarray.Dataset) -> dict[str, Any]:
    """A force-deflection curve as plain data; null where there is no equilibrium."""
    moved = [
        None if np.isnan(own).any() else own.tolist() for own in curve["displacement"].to_numpy()
    ]
    return {
        "factors": curve["factor"].to_numpy().tolist(),
        "displacement": moved,
        "stable": curve["stable"].to_numpy().tolist(),
        "status": [int(code) for code in curve["status_code"].to_numpy()],
        "path_factor": curve["path_factor"].to_numpy().tolist(),
        "path_displacement": curve["path_displacement"].to_numpy().tolist(),
        "path_stable": curve["path_stable"].to_numpy().tolist(),
    }


_SHARES = 3  # parts that bend most, of each mode


def modes_text(found: Modes) -> str:
    """Natural vibrations, slowest first, as lines of text."""
    lines = [f"natural vibrations of {found.name}", f"status: {found.status}"]
    for number, mode in enumerate(found.each[:_MOST], start=1):
        lines.append(f"{number:3}. {mode}")
        bending = [own for own in mode.shares[:_SHARES] if own.share >= 0.005]
        if bending:
            shares = ", ".join(f"{own.leg}/{own.part} {own.share:.0%}" for own in bending)
            lines.append(f"     bending: {shares}")
    if len(found) > _MOST:
        lines.append(f"{len(found) - _MOST} faster ones")
    lines += [f"advice: {advice}" for advice in found.status.advice]
    return text_of(lines)


def modes_data(found: Modes) -> dict[str, Any]:
    """Natural vibrations, slowest first, as plain data, JSON-ready; none without an equilibrium."""
    return {
        "robot": found.name,
        "status": str(found.status),
        "advice": list(found.status.advice),
        "order": order(found.space),
        "units": {"length": "m", "angle": "rad", "frequency": "Hz", "growth": "1/s"},
        "modes": [
            {**own, "shares": picked(mode.shares, "leg part share")}
            for own, mode in zip(picked(found, "frequency growth twist words"), found, strict=True)
        ],
        "robostiff": __version__,
    }
