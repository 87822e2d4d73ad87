"""Identification, compensation of paths, and design: what was found, in short."""

from __future__ import annotations

from contextlib import suppress
from itertools import compress

import numpy as np

from robostiff.compensation.compensate import Compensation
from robostiff.design.optimum import Ending, Optimum
from robostiff.design.tolerances import Tolerances
from robostiff.elastostatics import Status
from robostiff.errors import NoAnswerError
from robostiff.identification.choice_of_poses import ChosenPoses
from robostiff.identification.identified import FitStatus, Identified
from robostiff.identification.unknowns import UnknownKind
from robostiff.markup import Block, Facts, Number, Page, Table, number, percent
from robostiff.page.of_result import attributes

_REST = "residual, root mean square"


def identification_page(result: Identified, level: float = 0.95) -> Page:
    """Values with their intervals, stiffnesses, residuals by marker, and what was not found."""
    if result.status is FitStatus.TOO_FEW_ROWS:
        name = result.model.statics.robot.name
        return Page(name, ", not identified", result.status, [], result.advice, {"values": {}})
    rows, stiffnesses, intervals = [], [], result.interval(level)
    for p in result.model.parameters:
        interval = intervals.get(p.name)
        value = Number(result.values[p.name], p.unit)
        if interval is None:
            rows.append((p.name, value, "not identified", "", Number(p.nominal)))
            continue
        rows.append((p.name, value, *map(Number, interval), Number(p.nominal)))
        if p.kind is UnknownKind.COMPLIANCE:
            k, low, high = result.stiffness_interval(p.name, level)
            above = Number(high) if np.isfinite(high) else "no limit"
            stiffnesses.append(
                (p.name.removeprefix("1/"), Number(k, p.stiffness_unit), Number(low), above)
            )
    frames = []
    for unknown in result.unknowns[len(result.model.parameters) :]:
        error = result.std.get(unknown.name)
        words = "not identified" if error is None else Number(error, unknown.unit)
        frames.append((unknown.name, Number(result.values[unknown.name], unknown.unit), words))
    measured = result.measured
    at_markers, at_drives = [], []
    for found, owners, kinds, width, factor in (
        (at_markers, measured.markers, ~measured.of_drives, 3, 1e6),
        (at_drives, measured.drives, measured.of_drives, 1, 1.0),
    ):
        for name in dict.fromkeys(compress(owners, kinds)):
            selected = kinds & (np.array(owners) == name)
            rest = factor * result.residuals[selected][:, :width]
            root, most = float(np.sqrt(np.nanmean(rest**2))), float(np.nanmax(np.abs(rest)))
            found.append((name, str(len(rest)), Number(root), Number(most)))
    until = f"{number(100 * level)} %"
    facts = [
        ("readings", str(len(measured))),
        ("degrees of freedom", str(result.degrees_of_freedom)),
        ("chi-square", Number(result.chi_square)),
        ("probability of a larger one", Number(result.probability)),
    ]
    if not measured.has_sigma:  # all readings have one unit
        unit, factor = ("SI", 1.0) if measured.of_drives.all() else ("µm", 1e6)
        facts[2:] = [
            (f"standard deviation of a coordinate [{unit}]", Number(factor * result.sigma))
        ]
    for kinds, unit, factor in ((~measured.of_drives, "µm", 1e6), (measured.of_drives, "SI", 1.0)):
        branches = measured.branches_among(kinds)[:, :3]
        if len(branches):
            floor = factor * float(np.sqrt(np.nanmean(branches**2)))
            facts.append((f"loading less unloading, root mean square [{unit}]", Number(floor)))
    tables = (
        (("parameter", "value", f"{until} from", "to", "nominal"), rows),
        (("stiffness", "value", f"{until} from", "to"), stiffnesses),
        (("frame", "value", "standard deviation"), frames),
        (("marker", "readings", f"{_REST} [µm]", "largest [µm]"), at_markers),
        (("drive", "readings", f"{_REST} [SI]", "largest"), at_drives),
        (("fit", ""), facts),
    )
    return Page(
        result.robot.name,
        f", identified from {len(measured)} readings",
        result.status,
        [Table(headings, cells) for headings, cells in tables if cells],
        result.advice,
        {
            **attributes(result, "values std"),
            "intervals": intervals,
            **attributes(result, "names covariance residuals leverage outliers chi_square"),
            **attributes(result, "degrees_of_freedom probability not_identified weak"),
            "branches": measured.branches,
        },
    )


def chosen_poses_page(name: str, result: ChosenPoses) -> Page:
    """Which postures were chosen, and how much better they are than others."""
    choices = [
        ("this choice", Number(result.value)),
        ("a random choice", Number(result.random)),
        ("candidates left out", str(result.left_out)),
    ]
    errors = [(part, Number(value, result.units[part])) for part, value in result.std.items()]
    return Page(
        name,
        f", {len(result.rows)} postures to measure at",
        None,
        [
            Table((result.criterion, ""), choices),
            Table(("parameter", "standard deviation to be expected"), errors),
        ],
        (),
        {
            "rows": result.rows,
            "postures": getattr(result.postures, "values", result.postures),
            **attributes(result, "value random std left_out"),
        },
    )


def compensation_page(result: Compensation) -> Page:
    """How far a path is off without and with correction, and the points with a status."""
    kinds, counts = np.unique(result.status_codes, return_counts=True)
    rows = []
    cases = ("without correction", result.deviation), ("with correction", result.residual)
    for words, twists in cases:
        known = twists[np.isfinite(twists).all(axis=1)]
        sizes = (np.linalg.norm(known[:, s], axis=1) for s in (slice(3), slice(3, 6)))
        most = (Number(round(1e6 * float(x.max()), 6)) if x.size else "none" for x in sizes)
        rows.append((words, *most))
    statuses = [(str(Status(int(k))), str(n)) for k, n in zip(kinds, counts, strict=True)]
    advice, count = list(result.status.advice), len(result.target)
    if result.jumps:
        points = ", ".join(str(k + 1) for k in result.jumps[:5])
        more = ", ..." if len(result.jumps) > 5 else ""
        advice.append(
            f"the correction jumps before point {points}{more}: the process force or the posture "
            "changes there; look at these points before the machine runs them"
        )
    return Page(
        result.robot.name,
        f", {count} point{'s' if count > 1 else ''} of a path",
        result.status,
        [
            Table(("largest", "shift [µm]", "rotation [µrad]"), rows),
            Table(("status", "points"), statuses) if result.status else None,
        ],
        tuple(advice),
        {
            "points": len(result.target),
            **attributes(result, "deviation residual commanded drives drive_names"),
            **attributes(result, "status_codes jumps"),
        },
    )


_QUANTILES = (0.05, 0.5, 0.95, 0.99)


def optimum_page(result: Optimum) -> Page:
    """The values of the variables, the objective before and after, and the limits that hold."""
    rows = [(name, Number(value)) for name, value in result.values.items()]
    facts = (
        ("ended", f"{result.ending.value} after {result.steps} steps"),
        ("at limits", ", ".join(result.at_limits)),
    )
    advice = () if result.ending is Ending.OPTIMUM else (result.ending.advice,)
    ends = [("at the start", Number(result.at_start)), ("found", Number(result.objective))]
    blocks: list[Block] = [
        Table(("variable", "value [SI]"), rows),
        Table(("objective", ""), ends),
        Facts(tuple(fact for fact in facts if fact[1])),
    ]
    return Page(result.robot.name, ", best values of its parameters", None, blocks, advice)


def tolerances_page(result: Tolerances) -> Page:
    """Nominal value and quantiles of each output at the first pose, and what they come from."""
    blocks: list[Block] = []
    for name, nominal in result.nominal.items():
        rows = [("nominal", Number(float(nominal[0])), "")]
        for q in _QUANTILES:
            value, error = (float(x[0]) for x in result.quantile(name, q))
            rows.append((f"{percent(q, 0)} below", Number(value), f"± {number(error, 2)}"))
        blocks.append(Table((name, "[SI]", ""), rows))
        with suppress(NoAnswerError):  # where no parameter changes it
            shares = [(part, percent(share, 1)) for part, share in result.shares(name).items()]
            blocks.append(Table(("parameter", "share of the variance"), shares))
    count = len(next(iter(result.samples.values())))
    advice = ()
    if result.answered < 1:
        advice = (f"{percent(1 - result.answered)} of the robots have no answer and are left out",)
    return Page(f"{count} robots", ", whose parameters are spread", None, blocks, advice)
