"""Curves: forces over deflections, residuals of readings, and what is off a path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robostiff.errors import InputError
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.picture import Category, Curve, Curves
from robostiff.plot.prefix import prefixed, short

if TYPE_CHECKING:
    import xarray

    from robostiff.compensation.compensate import Compensation
    from robostiff.identification.identified import Identified

_LEAST = 1e-6  # um: what is off a path by less is drawn so large


def load_curve(
    curve: xarray.Dataset, twist: str | None = None, *, backend: PlotBackend[Drawn] = PAPER
) -> Drawn:
    """Draw a force-deflection curve: how far the platform moves under multiples of a wrench.

    The path of equilibria is drawn where it is stable, and dashed where it is not; marks are the
    equilibria at the factors that were asked for.

    Parameters
    ----------
    curve : Dataset
        What ``rs.load_path`` returns.
    twist : str, optional
        Which displacement, such as ``dz``; the largest one when left out.
    backend : Matplotlib

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        When the dataset is another, or has no displacement of this name.

    Examples
    --------
    >>> import robostiff as rs
    >>> curve = rs.load_path(rs.load("3-puu"), None, [500, 0, 0, 0, 0, 0], [0.5, 1.0])
    >>> rs.plot.load_curve(curve).get_xlabel()
    'dx [mm]'
    """
    if "path_factor" not in curve:
        raise InputError(
            "force-deflection curve",
            got=f"a dataset of {', '.join(map(str, curve.data_vars)) or 'nothing'}",
            expected="what rs.load_path returns",
        )
    names = [str(name) for name in curve["twist"].to_numpy()]
    moved, path = curve["displacement"].to_numpy(), curve["path_displacement"].to_numpy()
    if twist is not None and twist not in names:
        raise InputError("twist of a force-deflection curve", got=twist, expected=", ".join(names))
    if twist is None:
        shifts = [i for i, name in enumerate(names) if name.startswith("d")]
        sizes = np.nanmax(np.abs(np.concatenate([moved, path])[:, shifts]), axis=0, initial=0.0)
        twist = names[shifts[int(np.argmax(sizes))]]
    i = names.index(twist)
    along, at = path[:, i], moved[:, i]
    largest = np.nanmax(np.abs(np.concatenate([along, at])), initial=0.0)
    times, unit = prefixed(float(largest), "m" if twist.startswith("d") else "rad")
    factor, stable = curve["path_factor"].to_numpy(), curve["path_stable"].to_numpy()
    # a stretch begins where the one before it ends
    leaves = ~stable | np.concatenate([~stable[1:], [False]])[: len(stable)]
    leaves = leaves | np.concatenate([[False], ~stable[:-1]])[: len(stable)]
    curves = [Curve("stable", times * np.where(stable, along, np.nan), factor, Category(0))]
    if not np.all(stable):
        lost = times * np.where(leaves, along, np.nan)
        curves.append(Curve("unstable", lost, factor, Category(1), is_dashed=True))
    marks = times * np.where(curve["stable"].to_numpy(), at, np.nan)
    factors = curve["factor"].to_numpy()
    curves.append(Curve("at the given loads", marks, factors, Category(0), has_marks=True))
    words = [
        f"{letter}{name[1:]} {short(own * float(value))} {shown}"
        for name, value in zip(names, curve.attrs["wrench"], strict=True)
        for letter, base in [("F", "N") if name.startswith("d") else ("M", "N m")]
        for own, shown in [prefixed(abs(float(value)), base)]
        if value
    ]
    picture = Curves(
        f"{curve.attrs['robot']} under load",
        f"{twist} [{unit}]",
        "times the wrench",
        tuple(curves),
        (f"wrench {', '.join(words) or 'none'}",),
    )
    return drawn_by(backend, picture)


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
