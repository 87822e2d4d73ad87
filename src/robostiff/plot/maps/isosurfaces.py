"""Isosurfaces of a map over three coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from robostiff.errors import InputError
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.geometry.surfaces import isosurface
from robostiff.plot.maps.selection import CLASSES, At, select
from robostiff.plot.picture import Category, Item, Marks, Mesh, Scene, Shape
from robostiff.plot.prefix import short

if TYPE_CHECKING:
    import xarray

_MARKS = 1500  # of one kind: more hide the surface


def map_isosurface(
    found: xarray.Dataset,
    variable: str,
    levels: float | Sequence[float],
    *,
    x: str,
    y: str,
    z: str,
    at: At | None = None,
    full_rank: int | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw the surfaces on which a quantity of a map has given values.

    A surface ends where there are no values; poses that are out of reach, left out or
    rank-deficient are marked, and named in the legend.

    Parameters
    ----------
    found : Dataset
        What ``rs.stiffness_map`` returns over a grid.
    variable : str
    levels : float or sequence of float
        Values [SI units].
    x, y, z : str
        Coordinates of the map.
    at : mapping of str to float, str or int, optional
        As for `map_slice`.
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
        When a name is not in the map, something remains to be chosen, or no pose lies on the other
        side of a level.

    Examples
    --------
    >>> import robostiff as rs
    >>> axis = rs.Axis(-0.1, 0.1, 3)
    >>> grid = rs.Grid(x=axis, y=axis, z=rs.Axis(0.8, 1.0, 3))
    >>> found = rs.stiffness_map(rs.load("hexapod"), grid, [rs.Quantity.WORST_DEFLECTION])
    >>> middle = float(found.worst_deflection.median())
    >>> axes = rs.plot.map_isosurface(found, "worst_deflection", middle, x="x", y="y", z="z")
    """
    picture = isosurface_picture(found, variable, levels, (x, y, z), at, full_rank)
    return drawn_by(backend, picture)


def isosurface_picture(
    found: xarray.Dataset,
    variable: str,
    levels: float | Sequence[float],
    along: tuple[str, str, str],
    at: At | None = None,
    full_rank: int | None = None,
) -> Scene:
    """The picture of `map_isosurface`, as data."""
    if variable in CLASSES:
        raise InputError("quantity of a surface", got=variable, expected="one that has numbers")
    part = select(found, variable, along, at or {}, full_rank)
    finite = part.values[np.isfinite(part.values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (np.nan, np.nan)
    x, y, z = part.axes
    wanted = sorted(part.factor * float(level) for level in np.atleast_1d(levels))
    items: list[Item] = []
    unit = part.label.rpartition("[")[2].rstrip("]")
    for i, level in enumerate(wanted):
        if not low < level <= high:
            raise InputError(
                f"level of {variable!r}",
                got=level / part.factor,
                expected=f"above {low / part.factor:.4g} and up to {high / part.factor:.4g}"
                if len(finite)
                else "a map with values: no pose has one",
            )
        vertices, triangles = isosurface(part.values, level, (x.values, y.values, z.values))
        label = f"{short(level, 4)} {unit}".strip()
        items.append(Mesh(vertices, triangles, Category(i), 0.45, label))
    grid = np.stack(np.meshgrid(x.values, y.values, z.values, indexing="ij"), axis=-1)
    for i, region in enumerate(part.regions):
        points = grid[region.where]
        label = region.name
        if len(points) > _MARKS:
            points = points[:: -(-len(points) // _MARKS)]
            label += " (some of the poses)"
        items.append(Marks(points, Category(len(wanted) + i), Shape.DOT, label))
    units = {axis.label.rpartition("[")[2] for axis in part.axes}
    return Scene(
        part.name if not part.where else f"{part.name}: {part.where}",
        (x.label, y.label, z.label),
        tuple(items),
        is_equal=len(units) == 1,
        notes=(f"surfaces of equal {variable.replace('_', ' ')}",),
        frame=np.stack([grid[0, 0, 0], grid[-1, -1, -1]]),
    )
