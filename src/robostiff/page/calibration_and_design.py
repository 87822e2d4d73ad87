"""Identification, compensation of paths, and design: what was found, in short."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.compensation.compensate import Compensation
from robostiff.design.optimum import Ending, Optimum
from robostiff.design.tolerances import Tolerances
from robostiff.elastostatics import Status
from robostiff.identification.choice_of_poses import ChosenPoses
from robostiff.identification.identified import FitStatus, Identified
from robostiff.identification.unknowns import UnknownKind
from robostiff.markup import Block, Facts, Number, Page, Table, number, percent
from robostiff.page.of_result import attributes

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
    frames = []
    for own in found.unknowns[len(found.model.parameters) :]:
        error = found.std.get(own.name)
        words = "not identified" if error is None else Number(error, own.unit)
        frames.append((own.name, Number(found.values[own.name], own.unit), words))
    measured = found.measured
    of_what: dict[bool, list[tuple[Any, ...]]] = {False: [], True: []}
    drive_names = tuple(dict.fromkeys(filter(None, measured.drives)))
    for of_drive, names, owners, width, factor in (
        (False, measured.marker_names, measured.markers, 3, 1e6),
        (True, drive_names, measured.drives, 1, 1.0),
    ):
        kinds = [kind.of_drive is of_drive for kind in measured.kinds]
        for name in names:
            mine = [own == name and kind for own, kind in zip(owners, kinds, strict=True)]
            rest = factor * found.residuals[mine][:, :width]
            root, most = float(np.sqrt(np.nanmean(rest**2))), float(np.nanmax(np.abs(rest)))
            of_what[of_drive].append((name, str(len(rest)), Number(root), Number(most)))
    until = f"{number(100 * level)} %"
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
    tables = (
        (("parameter", "value", f"{until} from", "to", "nominal"), rows),
        (("stiffness", "value", f"{until} from", "to"), stiffnesses),
        (("frame", "value", "standard deviation"), frames),
        (("marker", "readings", f"{_REST} [um]", "largest [um]"), of_what[False]),
        (("drive", "readings", f"{_REST} [SI]", "largest"), of_what[True]),
        (("fit", ""), facts),
    )
    return Page(
        found.robot.name,
        f", identified from {len(found.measured)} readings",
        found.status,
        [Table(headings, own) for headings, own in tables if own],
        found.advice,
        {
            **attributes(found, "values std"),
            "intervals": found.interval(level),
            **attributes(found, "names covariance residuals leverage outliers chi_square"),
            **attributes(found, "degrees_of_freedom probability not_identified weak"),
            "branches": branches,
        },
    )


def chosen_poses_page(name: str, found: ChosenPoses) -> Page:
    """Which postures were chosen, and how much better they are than others."""
    choices = [
        ("this choice", Number(found.value)),
        ("a random choice", Number(found.random)),
        ("candidates left out", str(found.left_out)),
    ]
    errors = [(own, Number(value, found.units[own])) for own, value in found.std.items()]
    return Page(
        name,
        f", {len(found.rows)} postures to measure at",
        None,
        [
            Table((found.criterion, ""), choices),
            Table(("parameter", "standard deviation to be expected"), errors),
        ],
        (),
        {
            "rows": found.rows,
            "postures": getattr(found.postures, "values", found.postures),
            **attributes(found, "value random std left_out"),
        },
    )


def compensation_page(found: Compensation) -> Page:
    """How far a path is off without and with correction, and the points with a status."""
    kinds, counts = np.unique(found.status_codes, return_counts=True)
    rows = []
    cases = ("without correction", found.deviation), ("with correction", found.residual)
    for words, each in cases:
        moved, turned = (np.linalg.norm(each[:, part], axis=1) for part in (slice(3), slice(3, 6)))
        most = [float(np.nanmax(own, initial=0.0)) for own in (moved, turned)]
        rows.append((words, *(Number(round(1e6 * value, 6)) for value in most)))
    statuses = [(str(Status(int(k))), f"{n} points") for k, n in zip(kinds, counts, strict=True)]
    advice = list(found.status.advice)
    if found.jumps:
        points = ", ".join(str(k + 1) for k in found.jumps[:5])
        more = ", ..." if len(found.jumps) > 5 else ""
        advice.append(
            f"the correction jumps before point {points}{more}: the process force or the posture "
            "changes there; look at these points before the machine runs them"
        )
    return Page(
        found.robot.name,
        f", {len(found.target)} points of a path",
        found.status,
        [
            Table(("largest", "shift [um]", "rotation [urad]"), rows),
            Table(("status", "points"), statuses) if found.status else None,
        ],
        tuple(advice),
        {
            "points": len(found.target),
            **attributes(found, "deviation residual commanded drives drive_names"),
            **attributes(found, "status_codes jumps"),
        },
    )


_QUANTILES = (0.05, 0.5, 0.95, 0.99)


def optimum_page(found: Optimum) -> Page:
    """The values of the variables, the objective before and after, and the limits that hold."""
    rows = [(name, Number(value)) for name, value in found.values.items()]
    facts = (
        ("ended", f"{found.ending.value} after {found.steps} steps"),
        ("at limits", ", ".join(found.at_limits)),
    )
    advice = () if found.ending is Ending.OPTIMUM else (found.ending.advice,)
    ends = [("at the start", Number(found.at_start)), ("found", Number(found.objective))]
    blocks: list[Block] = [
        Table(("variable", "value [SI]"), rows),
        Table(("objective", ""), ends),
        Facts(tuple(own for own in facts if own[1])),
    ]
    return Page(found.robot.name, ", best values of its parameters", None, blocks, advice)


def tolerances_page(found: Tolerances) -> Page:
    """Nominal value and quantiles of each output at the first pose, and what they come from."""
    blocks: list[Block] = []
    for name, nominal in found.nominal.items():
        rows = [("nominal", Number(float(nominal[0])), "")]
        for q in _QUANTILES:
            value, error = (float(own[0]) for own in found.quantile(name, q))
            rows.append((f"{percent(q, 0)} below", Number(value), f"± {number(error, 2)}"))
        blocks.append(Table((name, "[SI]", ""), rows))
        shares = [(own, percent(share, 1)) for own, share in found.shares(name).items()]
        blocks.append(Table(("parameter", "share of the variance"), shares))
    count = len(next(iter(found.samples.values())))
    advice = ()
    if found.answered < 1:
        advice = (f"{percent(1 - found.answered)} of the robots have no answer and are left out",)
    return Page(f"{count} robots", ", whose parameters are spread", None, blocks, advice)
