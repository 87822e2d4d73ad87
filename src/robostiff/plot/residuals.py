"""What is left of readings once parameters are identified, as data of a picture."""

from __future__ import annotations

import numpy as np

from robostiff.identification.identified import Identified
from robostiff.plot.picture import Category, Curve, Curves


def residuals_picture(found: Identified) -> Curves:
    """Residuals of the three coordinates over the readings [um]."""
    readings = np.arange(1, len(found.measured) + 1, dtype=float)
    curves = [
        Curve(axis, readings, 1e6 * found.residuals[:, k], Category(k))
        for k, axis in enumerate("xyz")
        if np.isfinite(found.residuals[:, k]).any()
    ]
    title = f"Residuals of {found.robot.name}"
    return Curves(title, "reading", "residual [um]", tuple(curves))
