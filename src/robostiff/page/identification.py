"""What an identification found, and chosen poses, in short."""

from __future__ import annotations

import numpy as np

from robostiff.identification.choice_of_poses import ChosenPoses
from robostiff.identification.identified import Identified
from robostiff.identification.unknowns import UnknownKind
from robostiff.markup import Number, Page, Table


def identification_page(found: Identified, level: float = 0.95) -> Page:
    """Values with their intervals, stiffnesses, residuals by marker, and what was not found."""
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
        (own.name, Number(found.values[own.name], own.unit), Number(found.std.get(own.name, 0.0)))
        for own in found.unknowns[len(found.model.parameters) :]
    ]
    markers = []
    for name in found.measured.marker_names:
        mine = found.residuals[[k for k, own in enumerate(found.measured.markers) if own == name]]
        rms, most = np.sqrt(np.nanmean(mine**2)), np.nanmax(np.abs(mine))
        markers.append((name, len(mine), Number(1e6 * float(rms)), Number(1e6 * float(most))))
    until = f"{100 * level:g} %"
    facts = [
        ("readings", str(len(found.measured))),
        ("degrees of freedom", str(found.degrees_of_freedom)),
        ("chi-square", Number(found.chi_square)),
        ("probability of a larger one", Number(found.probability)),
    ]
    if not found.measured.has_sigma:
        facts[2:] = [("standard deviation of a coordinate [um]", Number(1e6 * found.sigma))]
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
            Table(
                ("marker", "readings", "residual, root mean square [um]", "largest [um]"),
                [(name, str(count), *more) for name, count, *more in markers],
            ),
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
        },
    )


def chosen_poses_page(name: str, found: ChosenPoses) -> Page:
    """Which postures were chosen, and how much better they are than others."""
    return Page(
        name,
        f", {len(found.rows)} postures to measure at",
        None,
        [
            Table(
                ("criterion", ""),
                [
                    ("this choice", Number(found.value)),
                    ("a random choice", Number(found.random)),
                    ("candidates left out", str(found.left_out)),
                ],
            ),
            Table(
                ("parameter", "standard deviation to be expected"),
                [(own, Number(value)) for own, value in found.std.items()],
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
