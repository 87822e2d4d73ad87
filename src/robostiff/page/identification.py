"""What an identification found, and chosen poses, in short."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robostiff.identification.choice_of_poses import ChosenPoses
from robostiff.identification.identified import FitStatus, Identified
from robostiff.identification.measurements import Measurements
from robostiff.identification.unknowns import UnknownKind
from robostiff.markup import Number, Page, Table

_REST = "residual, root mean square"


def identification_page(found: Identified, level: float = 0.95) -> Page:
    """Values with their intervals, stiffnesses, residuals by marker, and what was not found."""
    if found.status is FitStatus.TOO_FEW_ROWS:
        name = found.model.statics.robot.name
        return Page(name, ", not identified", found.status, [], found.advice, {"values": {}})
    rows, stiffnesses = [], []
    for own in found.model.parameters:
        interval = found.interval(level).get(own.name)
        value = Number(found.values[own.name], own.unit)
        if interval is None:
            rows.append((own.name, value, "not identified", "", Number(own.nominal)))
            continue
        rows.append((own.name, value, *map(Number, interval), Number(own.nominal)))
        if own.kind is UnknownKind.COMPLIANCE:
            unit = "N m/rad" if own.unit.startswith("rad") else "N/m"
            k, low, high = found.stiffness_interval(own.name, level)
            above = Number(high) if np.isfinite(high) else "no limit"
            stiffnesses.append((own.name.removeprefix("1/"), Number(k, unit), Number(low), above))
    frames = [
        (
            own.name,
            Number(found.values[own.name], own.unit),
            Number(found.std[own.name], own.unit) if own.name in found.std else "not identified",
        )
        for own in found.unknowns[len(found.model.parameters) :]
    ]
    measured = found.measured
    markers, of_drives = (
        _residuals([(name, found.residuals[rows][:, :width]) for name, rows in each], factor)
        for each, width, factor in (
            ([(n, _rows(measured.markers, measured, n)) for n in measured.marker_names], 3, 1e6),
            ([(n, _rows(measured.drives, measured, n, drive=True))
              for n in dict.fromkeys(filter(None, measured.drives))], 1, 1.0),
        )
    )  # fmt: skip
    until = f"{100 * level:g} %"
    facts = [
        ("readings", str(len(found.measured))),
        ("degrees of freedom", str(found.degrees_of_freedom)),
        ("chi-square", Number(found.chi_square)),
        ("probability of a larger one", Number(found.probability)),
    ]
    if not found.measured.has_sigma:
        facts[2:] = [("standard deviation of a coordinate [um]", Number(1e6 * found.sigma))]
    branches = measured.branches
    if len(branches):
        floor = 1e6 * float(np.sqrt(np.nanmean(branches[:, :3] ** 2)))
        facts.append(("loading less unloading, root mean square [um]", Number(floor)))
    return Page(
        found.robot.name,
        f", identified from {len(found.measured)} readings",
        found.status,
        [
            Table(("parameter", "value", f"{until} from", "to", "nominal"), rows),
            Table(("stiffness", "value", f"{until} from", "to"), stiffnesses)
            if stiffnesses
            else None,
            Table(("frame", "value", "standard deviation"), frames) if frames else None,
            Table(("marker", "readings", f"{_REST} [um]", "largest [um]"), markers)
            if markers
            else None,
            Table(("drive", "readings", f"{_REST} [SI]", "largest"), of_drives)
            if of_drives
            else None,
            Table(("fit", ""), facts),
        ],
        found.advice,
        {
            "values": found.values,
            "std": found.std,
            "intervals": found.interval(level),
            "names": found.names,
            "covariance": found.covariance,
            "residuals": found.residuals,
            "leverage": found.leverage,
            "outliers": found.outliers,
            "chi_square": found.chi_square,
            "degrees_of_freedom": found.degrees_of_freedom,
            "probability": found.probability,
            "not_identified": found.not_identified,
            "weak": found.weak,
            "branches": branches,
        },
    )


def _rows(
    names: Sequence[str], measured: Measurements, name: str, *, drive: bool = False
) -> list[int]:
    """Readings of a marker, or of a drive."""
    pairs = enumerate(zip(names, measured.kinds, strict=True))
    return [k for k, (own, kind) in pairs if own == name and kind.of_drive is drive]


def _residuals(each: Sequence[tuple[str, np.ndarray]], factor: float) -> list[tuple[Any, ...]]:
    """Name, count, root mean square and largest of residuals."""
    return [
        (
            name,
            str(len(own)),
            Number(factor * float(np.sqrt(np.nanmean(own**2)))),
            Number(factor * float(np.nanmax(np.abs(own)))),
        )
        for name, own in each
    ]


def chosen_poses_page(name: str, found: ChosenPoses) -> Page:
    """Which postures were chosen, and how much better they are than others."""
    return Page(
        name,
        f", {len(found.rows)} postures to measure at",
        None,
        [
            Table(
                (found.criterion, ""),
                [
                    ("this choice", Number(found.value)),
                    ("a random choice", Number(found.random)),
                    ("candidates left out", str(found.left_out)),
                ],
            ),
            Table(
                ("parameter", "standard deviation to be expected"),
                [(own, Number(value, found.units[own])) for own, value in found.std.items()],
            ),
        ],
        (),
        {
            "rows": found.rows,
            "postures": getattr(found.postures, "values", found.postures),
            "value": found.value,
            "random": found.random,
            "std": found.std,
            "left_out": found.left_out,
        },
    )
