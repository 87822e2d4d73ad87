"""Force-deflection curves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robostiff.errors import InputError
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.picture import Category, Curve, Curves
from robostiff.plot.prefix import prefixed

if TYPE_CHECKING:
    import xarray


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
    backend : Matplotlib or Plotly

    Returns
    -------
    Axes or Figure
        Of the backend.

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
    return drawn_by(backend, load_curve_picture(curve, twist))


def load_curve_picture(curve: xarray.Dataset, twist: str | None = None) -> Curves:
    """The picture of `load_curve`, as data."""
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
    curves.append(Curve("as asked", marks, factors, Category(0), has_marks=True))
    wrench = ", ".join(f"{value:g}" for value in curve.attrs["wrench"])
    return Curves(
        f"{curve.attrs['robot']} under load",
        f"{twist} [{unit}]",
        "times the wrench",
        tuple(curves),
        (f"wrench ({wrench}) N, N m",),
    )
