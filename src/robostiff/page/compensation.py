"""Commands of a path in short."""

from __future__ import annotations

import numpy as np

from robostiff.compensation.compensate import Compensation
from robostiff.elastostatics import Status
from robostiff.markup import Number, Page, Table


def compensation_page(found: Compensation) -> Page:
    """How far a path is off without and with correction, and the points with a status."""
    kinds, counts = np.unique(found.status_codes, return_counts=True)
    rows = []
    for words, each in (
        ("without correction", found.deviation),
        ("with correction", found.residual),
    ):
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
            "deviation": found.deviation,
            "residual": found.residual,
            "commanded": found.commanded,
            "drives": found.drives,
            "drive_names": found.drive_names,
            "status_codes": found.status_codes,
            "jumps": found.jumps,
        },
    )
