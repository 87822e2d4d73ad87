"""Percentiles of a map along one coordinate, over all its others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robostiff.errors import InputError
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.maps.selection import At, select
from robostiff.plot.picture import Bands, Cover, Percentile

if TYPE_CHECKING:
    import xarray

_PERCENTS = (5.0, 25.0, 50.0, 75.0, 95.0)


def map_bands(
    found: xarray.Dataset,
    variable: str,
    *,
    along: str,
    at: At | None = None,
    percents: Sequence[float] = _PERCENTS,
    full_rank: int | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw percentiles of a quantity along one coordinate, over all poses of the others.

    The percentiles are those of the poses that have a value; beside them stands the share of poses
    that have none, and why.

    Parameters
    ----------
    found : Dataset
        What ``rs.stiffness_map`` returns over a grid.
    variable : str
    along : str
        Coordinate of the map.
    at : mapping of str to float, str or int, optional
        As for `map_slice`; coordinates that it does not name are summed up.
    percents : sequence of float
        Ascending, between 0 and 100, and symmetric about 50, which is among them.
    full_rank : int, optional
        As for `map_slice`.
    backend : Matplotlib or Plotly

    Returns
    -------
    Axes or Figure
        Of the backend.

    Raises
    ------
    InputError
        When a name is not in the map, or a component remains to be chosen.

    Examples
    --------
    >>> import robostiff as rs
    >>> grid = rs.Grid(x=rs.Axis(-0.3, 0.3, 5), y=rs.Axis(-0.3, 0.3, 5))
    >>> found = rs.stiffness_map(rs.load("3-puu"), grid, [rs.Quantity.WORST_DEFLECTION])
    >>> rs.plot.map_bands(found, "worst_deflection", along="x").get_ylabel()
    'worst deflection [µm/N]'
    """
    return drawn_by(backend, bands_picture(found, variable, along, at, percents, full_rank))


def bands_picture(
    found: xarray.Dataset,
    variable: str,
    along: str,
    at: At | None = None,
    percents: Sequence[float] = _PERCENTS,
    full_rank: int | None = None,
) -> Bands:
    """The picture of `map_bands`, as data."""
    p = np.asarray(percents, dtype=float)
    ordered = p.ndim == 1 and len(p) % 2 == 1 and np.all(np.diff(p) > 0)
    if not ordered or np.any(p < 0) or np.any(p > 100) or not np.allclose(p + p[::-1], 100):
        raise InputError(
            "percents of bands",
            got=list(percents),
            expected="ascending numbers, symmetric about 50, which is among them",
            hint="write percents=(5, 25, 50, 75, 95)",
        )
    part = select(found, variable, (along,), at or {}, full_rank, others=True)
    count = len(part.axes[0].values)
    rows = part.values.reshape(count, -1)
    curves = np.full((len(p), count), np.nan)
    for i, row in enumerate(rows):
        known = row[np.isfinite(row)]
        if len(known):
            curves[:, i] = np.percentile(known, p)
    left_out = tuple(
        replace(region, where=region.where.reshape(count, -1).mean(axis=1))
        for region in part.regions
        if region.cover is Cover.INSTEAD
    )
    return Bands(
        part.name if not part.where else f"{part.name}: {part.where}",
        part.axes[0],
        part.label,
        tuple(Percentile(float(q), curve) for q, curve in zip(p, curves, strict=True)),
        left_out,
        notes=(f"each of {count} places: {rows.shape[1]} poses",),
    )
