"""A slice of a map: a quantity over two coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from robostiff.errors import InputError
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.maps.selection import At, select
from robostiff.plot.picture import ColourScale, Field

if TYPE_CHECKING:
    import xarray


def map_slice(
    found: xarray.Dataset,
    variable: str,
    *,
    x: str,
    y: str,
    at: At | None = None,
    isolines: int | Sequence[float] = 0,
    full_rank: int | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw a quantity of a map over two of its coordinates, with isolines.

    Poses without an answer are no colour of the scale: those out of reach, left out or
    rank-deficient have different hatchings, named in the legend. A pose that is rank-deficient is
    not stiff, whatever its value, and so its value is not shown.

    Parameters
    ----------
    found : Dataset
        What ``rs.stiffness_map`` returns over a grid.
    variable : str
        Such as ``"worst_deflection"``.
    x, y : str
        Coordinates of the map.
    at : mapping of str to float, str or int, optional
        Where to cut the other coordinates (the nearest of the grid), and which component to show:
        ``{"z": 0.9, "displacement_axis": "dz"}``, ``{"principal_translation": 0}``.
    isolines : int or sequence of float
        How many lines of equal value, or these values [SI units].
    full_rank : int, optional
        Rank of a regular pose; to be given for a robot that is free by design.
        Rows of the stiffness matrix when left out.
    backend : Matplotlib or Plotly

    Returns
    -------
    Axes or Figure
        Of the backend.

    Raises
    ------
    InputError
        When a name is not in the map, or something remains to be chosen.

    Examples
    --------
    >>> import robostiff as rs
    >>> grid = rs.Grid(x=rs.Axis(-0.3, 0.3, 5), y=rs.Axis(-0.3, 0.3, 5))
    >>> found = rs.stiffness_map(rs.load("3-puu"), grid, [rs.Quantity.WORST_DEFLECTION])
    >>> rs.plot.map_slice(found, "worst_deflection", x="x", y="y").get_xlabel()
    'x [m]'
    """
    return drawn_by(backend, slice_picture(found, variable, (x, y), at, isolines, full_rank))


def slice_picture(
    found: xarray.Dataset,
    variable: str,
    along: tuple[str, str],
    at: At | None = None,
    isolines: int | Sequence[float] = 0,
    full_rank: int | None = None,
) -> Field:
    """The picture of `map_slice`, as data."""
    part = select(found, variable, along[::-1], at or {}, full_rank)
    y, x = part.axes
    for name, axis in zip(along, (x, y), strict=True):
        if len(axis.values) < 2:
            raise InputError(
                f"coordinate {name!r} of a slice", got="one value", expected="two or more"
            )
    finite = part.values[np.isfinite(part.values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    answered = len(finite) / part.values.size
    notes = () if answered == 1 else (f"{100 * answered:.0f} % of the poses have a value",)
    return Field(
        part.name if not part.where else f"{part.name}: {part.where}",
        x,
        y,
        part.values,
        ColourScale(part.label, low, high),
        part.regions,
        _levels(isolines, low, high, part.factor) if len(finite) else (),
        notes,
    )


def _levels(
    isolines: int | Sequence[float], low: float, high: float, factor: float
) -> tuple[float, ...]:
    """Round values between the ends, or the given ones."""
    if not isinstance(isolines, int):
        return tuple(sorted(factor * float(level) for level in isolines))
    if isolines <= 0 or high <= low:
        return ()
    step = (high - low) / (isolines + 1)
    power = 10.0 ** np.floor(np.log10(step))
    step = next(n * power for n in (1, 2, 2.5, 5, 10) if n * power >= step * (1 - 1e-9))
    first = np.ceil(low / step)
    return tuple(float(k * step) for k in np.arange(first, np.floor(high / step) + 1))
