"""Maps over two coordinates, along one with percentiles, and over three as isosurfaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.markup import number, percent, short
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.map_selection import CLASSES, At, checked_map, select
from robostiff.plot.picture import (
    Bands,
    Category,
    ColourScale,
    Field,
    Item,
    Marks,
    Mesh,
    Scene,
    Shape,
)
from robostiff.plot.surfaces import isosurface

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
        Such as ``"worst_deflection"``; ``"rank"`` and ``"status"`` have a colour for each value.
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
    backend : Matplotlib

    Raises
    ------
    InputError
        When a name is not in the map, or something remains to be chosen.
    """
    part = select(found, variable, (y, x), at or {}, full_rank)
    rows, columns = part.axes
    for name, axis in ((y, rows), (x, columns)):
        if len(axis.values) < 2:
            raise InputError(
                f"coordinate {name!r} of a slice", got=Words("one value"), expected="two or more"
            )
    if variable in CLASSES:
        picture = Field(f"{part.title}, {variable}", columns, rows, part.values, None, part.regions)
        return drawn_by(backend, picture)
    finite = part.values[np.isfinite(part.values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    answered = len(finite) / part.values.size
    notes = () if answered == 1 else (f"{percent(answered, 0)} of the poses have a value",)
    picture = Field(
        part.title,
        columns,
        rows,
        part.values,
        ColourScale(part.label, low, high),
        part.regions,
        _levels(isolines, low, high, part.factor) if len(finite) else (),
        notes,
    )
    return drawn_by(backend, picture)


OVERVIEW: Mapping[str, Mapping[str, int]] = {
    "displacement_magnitude": {},
    "worst_deflection": {},
    "translational_stiffness": {"principal_translation": 0},
    "rotational_stiffness": {"principal_rotation": 0},
    "greatest_tension": {},
}
"""Quantities that are shown first, and which of their values: the smallest."""


def map_overview(
    found: xarray.Dataset,
    variable: str | None = None,
    *,
    at: At | None = None,
    full_rank: int | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw a quantity of a map over its first two coordinates, or along its only one.

    A list of poses is drawn over its time, or over the numbers of its poses.

    Parameters
    ----------
    found : Dataset
        What ``rs.stiffness_map`` returns over a grid.
    variable : str, optional
        Such as ``"worst_deflection"``, ``"rank"`` or ``"status"``; the first that there is when
        left out.
    at : mapping of str to float, str or int, optional
        As for `map_slice`; other coordinates are cut in the middle, and of several values the
        first is shown, which is the smallest of principal ones.
    full_rank : int, optional
        As for `map_slice`.
    backend : Matplotlib

    Raises
    ------
    InputError
        When a name is not in the map, or a single pose is left.
    """
    found = checked_map(found)
    if variable is None:
        others = [str(name) for name in found.data_vars if name not in CLASSES]
        first = [name for name in OVERVIEW if name in found]
        variable = next(iter([*first, *others, "rank"]))
    poses = [str(dim) for dim in found["status"].dims]
    chosen = dict(at or {})
    axes = [
        name
        for name in poses
        if name in found.coords and found.sizes[name] > 1 and name not in chosen
    ]
    if not axes:
        got = Words("a single pose, or all coordinates cut")
        expected = "poses over a coordinate or two, or a list of poses"
        raise InputError("map of a plot", got=got, expected=expected)
    for name in axes[2:]:
        values = found[name].values
        chosen[name] = float(values[len(values) // 2])
    array = found.get(variable)
    for dim in () if array is None else array.dims:
        if dim not in poses and dim not in chosen:
            labels = found[dim].values if dim in found.coords else [0]
            chosen[str(dim)] = str(labels[0]) if isinstance(labels[0], str) else 0
    if len(axes) == 1:
        return map_bands(
            found, variable, along=axes[0], at=chosen, full_rank=full_rank, backend=backend
        )
    x, y = axes[:2]
    return map_slice(found, variable, x=x, y=y, at=chosen, full_rank=full_rank, backend=backend)


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

    The percentiles are those of the poses that have a value; below them stand the shares of poses
    that have none, are ill-conditioned or beyond limits: the first of them that applies. A single
    pose at each place is a curve.

    Parameters
    ----------
    found : Dataset
        What ``rs.stiffness_map`` returns over a grid.
    variable : str
        Of ``"rank"`` and ``"status"`` the shares of poses with each are drawn.
    along : str
        Coordinate of the map.
    at : mapping of str to float, str or int, optional
        As for `map_slice`; coordinates that it does not name are summed up.
    percents : sequence of float
        Ascending, between 0 and 100, and symmetric about 50, which is among them.
    full_rank : int, optional
        As for `map_slice`.
    backend : Matplotlib

    Raises
    ------
    InputError
        When a name is not in the map, or a component remains to be chosen.
    """
    p = np.asarray(percents, dtype=float)
    ordered = p.ndim == 1 and len(p) % 2 == 1 and np.all(np.diff(p) > 0)
    if not ordered or np.any(p < 0) or np.any(p > 100) or not np.allclose(p + p[::-1], 100):
        expected = "ascending numbers, symmetric about 50, which is among them"
        hint = "write percents=(5, 25, 50, 75, 95)"
        raise InputError("percents of bands", got=list(percents), expected=expected, hint=hint)
    part = select(found, variable, (along,), at or {}, full_rank, others=True)
    count = len(part.axes[0].values)
    rows = part.values.reshape(count, -1)
    one_pose = rows.shape[1] == 1
    p = np.array([50.0]) if one_pose else p
    curves = np.full((len(p), count), np.nan)
    for i, row in enumerate(rows):
        known = row[np.isfinite(row)]
        if len(known):
            curves[:, i] = np.percentile(known, p)
    shares, marked = [], np.zeros(part.values.shape, dtype=bool)
    for region in part.regions:
        share = (region.where & ~marked).reshape(count, -1).mean(axis=1)
        shares.append(replace(region, where=share))
        marked |= region.where
    picture = Bands(
        part.title,
        part.axes[0],
        f"{variable}, share of poses" if variable in CLASSES else part.label,
        *(((), curves[:0]) if variable in CLASSES else (tuple(p.tolist()), curves)),
        tuple(shares),
        notes=() if one_pose else (f"each of {count} places: {rows.shape[1]} poses",),
    )
    return drawn_by(backend, picture)


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

    Raises
    ------
    InputError
        When a name is not in the map, something remains to be chosen, or no pose lies on the other
        side of a level.
    """
    if variable in CLASSES:
        raise InputError("quantity of a surface", got=variable, expected="one that has numbers")
    part = select(found, variable, (x, y, z), at or {}, full_rank)
    finite = part.values[np.isfinite(part.values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (np.nan, np.nan)
    x_axis, y_axis, z_axis = part.axes
    places = x_axis.values, y_axis.values, z_axis.values
    wanted = sorted(part.factor * float(level) for level in np.atleast_1d(levels))
    items: list[Item] = []
    unit = part.label.rpartition("[")[2].rstrip("]")
    for i, level in enumerate(wanted):
        if not low < level <= high:
            raise InputError(
                f"level of {variable!r}",
                got=level / part.factor,
                expected=f"above {number(low / part.factor)} and up to {number(high / part.factor)}"
                if len(finite)
                else "a map with values: no pose has one",
            )
        vertices, triangles = isosurface(part.values, level, places)
        label = f"{short(level, 4)} {unit}".strip()
        items.append(Mesh(vertices, triangles, Category(i), 0.45, label))
    grid = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1)
    for i, region in enumerate(part.regions):
        points = grid[region.where]
        label = region.name
        if len(points) > _MARKS:
            points = points[:: -(-len(points) // _MARKS)]
            label += " (some of the poses)"
        items.append(Marks(points, Category(len(wanted) + i), Shape.DOT, label))
    units = {axis.label.rpartition("[")[2] for axis in part.axes}
    picture = Scene(
        part.title,
        (x_axis.label, y_axis.label, z_axis.label),
        tuple(items),
        is_equal=len(units) == 1,
        notes=(f"surfaces of equal {variable.replace('_', ' ')}",),
        frame=np.stack([grid[0, 0, 0], grid[-1, -1, -1]]),
    )
    return drawn_by(backend, picture)
