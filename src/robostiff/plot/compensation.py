"""How far a path is off, before and after compensation."""

from __future__ import annotations

import numpy as np

from robostiff.compensation.compensate import Compensation
from robostiff.plot.picture import Category, Curve, Curves

_LEAST = 1e-6  # um: what is smaller is drawn so large


def compensation_picture(found: Compensation) -> Curves:
    """Shift of the platform from each point of the path, without and with correction, as data."""
    points = np.arange(1, len(found.target) + 1, dtype=float)
    curves = []
    for k, (name, each) in enumerate(
        (("without correction", found.deviation), ("with correction", found.left))
    ):
        moved = 1e6 * np.linalg.norm(each[:, :3], axis=1)
        curves.append(Curve(name, points, np.maximum(moved, _LEAST), Category(k)))
    return Curves(
        f"{found.robot.name} along a path",
        "point",
        "off the path [um]",
        tuple(curves),
        is_log=True,
    )
