"""What is left of readings once parameters are identified, and of a path once it is corrected."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robostiff.plot.picture import Category, Curve, Curves

if TYPE_CHECKING:
    from robostiff.compensation.compensate import Compensation
    from robostiff.identification.identified import Identified

_LEAST = 1e-6  # um: what is off a path by less is drawn so large


def residuals_picture(found: Identified) -> Curves:
    """Residuals of the three coordinates of markers over the readings [um]."""
    readings = np.arange(1, len(found.measured) + 1, dtype=float)
    rest = 1e6 * found.residuals
    rest[[kind.of_drive for kind in found.measured.kinds]] = np.nan
    curves = [
        Curve(axis, readings, rest[:, k], Category(k))
        for k, axis in enumerate("xyz")
        if np.isfinite(rest[:, k]).any()
    ]
    title = f"Residuals of {found.robot.name}"
    return Curves(title, "reading", "residual [um]", tuple(curves))


def compensation_picture(found: Compensation) -> Curves:
    """Shift of the platform from each point of the path, without and with correction, as data."""
    points = np.arange(1, len(found.target) + 1, dtype=float)
    curves = []
    for k, (name, each) in enumerate(
        (("without correction", found.deviation), ("with correction", found.residual))
    ):
        moved = 1e6 * np.linalg.norm(each[:, :3], axis=1)
        curves.append(Curve(name, points, np.maximum(moved, _LEAST), Category(k)))
    return Curves(
        f"{found.robot.name} along a path", "point", "off the path [um]", tuple(curves), is_log=True
    )
