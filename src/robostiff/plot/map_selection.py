"""The part of a map that is to be drawn: one number a pose, over some coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis.maps.variables import status_flags, status_words
from robostiff.errors import InputError, Words, needs_extra, warn_of_slip
from robostiff.frozen import frozen
from robostiff.markup import number, prefixed, short
from robostiff.plot.picture import REGIONS, Category, PlotAxis, Region

if TYPE_CHECKING:
    import xarray


_FULL = 6.0  # the largest rank


def regions(dataset: xarray.Dataset, values: np.ndarray, full_rank: int) -> tuple[Region, ...]:
    """Regions of a map or of a part of it, with values of the shape of its ``status``.

    Every pose has a value to be shown or lies in one region instead: out of reach, rank-deficient
    whatever its value, and so on. Poses that are ill-conditioned or beyond limits keep their value,
    and lie in a region over it.
    """
    status, rank = dataset["status"].values, dataset["rank"].values
    where = {name: (status & flag) != 0 for flag, name in status_flags().items()}
    where |= {"rank-deficient": rank < full_rank, "no value": ~np.isfinite(values)}
    parts, hidden = [], np.zeros(status.shape, dtype=bool)
    for name in REGIONS:
        parts.append(Region(name, where[name] & ~hidden))
        hidden = hidden if parts[-1].is_over else hidden | where[name]
    return tuple(part for part in parts if np.any(part.where))


CLASSES = ("rank", "status")
"""Variables whose values are names rather than numbers."""


def classes(dataset: xarray.Dataset, variable: str) -> tuple[Region, ...]:
    """A region for every rank, or for every status, that a part of a map has.

    Poses without a rank are named by their status. A status has the look that it has in other
    maps, where it has one.
    """
    status, rank = dataset["status"].values, dataset["rank"].values
    named: dict[str, np.ndarray] = {}
    by_rank = (rank >= 0) & (variable == "rank")
    for value in np.unique(rank[by_rank])[::-1]:
        named[f"rank {value}"] = by_rank & (rank == value)
    for code in np.unique(status[~by_rank]):
        named[status_words(int(code))] = ~by_rank & (status == code)
    parts, others = [], count()
    for name, where in named.items():
        first, _, value = name.partition(" ")
        paint: Category | float | None = None
        if REGIONS.get(name, ("", None))[1] is None:
            paint = int(value) / _FULL if first == "rank" else Category(next(others))
        parts.append(Region(name, where, paint))
    return tuple(parts)


At = Mapping[str, float | str | int]


@frozen
class Selection:
    """A quantity over some coordinates of a map."""

    title: str  # the robot, and what else was chosen, in words
    label: str  # of the quantity, with the unit of the values
    axes: tuple[PlotAxis, ...]
    # one axis a coordinate, in the unit of the label; NaN where a region stands instead
    values: np.ndarray
    regions: tuple[Region, ...]
    factor: float  # from SI units to the unit of the label


def select(
    dataset: xarray.Dataset,
    variable: str,
    along: tuple[str, ...],
    at: At,
    full_rank: int | None,
    others: bool = False,
) -> Selection:
    """Values of a variable of a map over coordinates `along`, in this order, cut `at` others.

    With `others` the coordinates that are not named follow as further axes. Rank and status are
    shown as a region for each.

    Raises InputError when a name is not in the map, or something remains to be chosen.
    """
    dataset = checked_map(dataset)
    if variable not in dataset.data_vars:
        names = map(str, dataset.data_vars)
        raise InputError("quantity of a map", got=variable, expected=" or ".join(names))
    array = dataset[variable]
    pose_dims = [str(dim) for dim in dataset["status"].dims]
    for name in along:
        if name not in pose_dims:
            expected = " or ".join(pose_dims)
            hint = "map over a grid: rs.Grid(x=rs.Axis(-0.1, 0.1, 21), ...)"
            raise InputError("coordinate of a plot", got=name, expected=expected, hint=hint)
    if len(set(along)) < len(along):
        raise InputError("coordinates of a plot", got=along, expected="each name once")
    chosen, words = _selection(dataset, array, along, at)
    remaining = [
        str(dim)
        for dim in array.dims
        if dim not in along and dim not in chosen and (array.sizes[dim] > 1 or dim not in pose_dims)
    ]
    open_dims = [dim for dim in remaining if not (others and dim in pose_dims)]
    if open_dims:
        dim = open_dims[0]
        middle = dataset[dim].values[len(dataset[dim]) // 2].item() if dim in dataset.coords else 0
        wanted = f"{middle:.6g}" if isinstance(middle, float) else repr(middle)
        raise InputError(
            f"part of the map of {variable!r} to be drawn",
            got=Words(f"nothing about {', '.join(open_dims)}"),
            expected=f"a choice: {dim} has {_choices(dataset, array, dim)}",
            hint=f"write at={{{dim!r}: {wanted}}}",
        )
    cut = dataset[["rank", "status"]].isel({d: i for d, i in chosen.items() if d in pose_dims})
    part = array.isel(chosen)
    order = [*along, *(dim for dim in cut["status"].dims if dim not in along)]
    cut = cut.transpose(*order)
    values = np.asarray(part.transpose(*order).values, dtype=float)
    if variable in CLASSES:
        parts, values = classes(cut, variable), np.full(values.shape, np.nan)
    else:
        if full_rank is None and "wrench_order" not in dataset.attrs:
            got = Words("a map that does not say whether its robot is planar")
            expected = "full_rank=3 for a planar robot, full_rank=6 for others"
            raise InputError("rank of a regular pose", got=got, expected=expected)
        full = len(str(dataset.attrs.get("wrench_order", "")).split())
        parts = regions(cut, values, full if full_rank is None else full_rank)
    hidden = [part.where for part in parts if not part.is_over]
    shown = np.where(np.any([np.zeros(values.shape, bool), *hidden], axis=0), np.nan, values)
    largest = float(np.nanmax(np.abs(shown))) if np.any(np.isfinite(shown)) else 0.0
    times, unit = prefixed(largest, str(array.attrs.get("units", "")))
    label = variable.replace("_", " ")
    axes = []
    for name in along:
        axis_unit = dataset[name].attrs.get("units", "")
        heading = f"{name} [{axis_unit}]" if axis_unit else name
        axes.append(PlotAxis(heading, np.asarray(dataset[name].values, dtype=float)))
    title = f"{label} [{unit}]" if unit and unit != "1" else label
    robot, where = str(dataset.attrs.get("robot", "")), ", ".join(words)
    return Selection(
        title=f"{robot}: {where}" if where else robot,
        label=title,
        axes=tuple(axes),
        values=times * shown,
        regions=parts,
        factor=times,
    )


def checked_map(dataset: Any) -> xarray.Dataset:
    """A map; of a list of poses over their time, or over their numbers from 0.

    Raises InputError when it is no map.
    """
    with needs_extra("plots of maps", "maps"):
        import xarray
    if not isinstance(dataset, xarray.Dataset) or not {"rank", "status"} <= set(dataset.data_vars):
        raise InputError(
            "map of a plot", got=type(dataset).__name__, expected="a result of rs.stiffness_map"
        )
    if dataset["status"].dims == ("pose",) and "pose" not in dataset.coords:
        if "time" in dataset.coords:
            return dataset.swap_dims(pose="time")
        return dataset.assign_coords(pose=np.arange(dataset.sizes["pose"]))
    return dataset


def _selection(
    dataset: xarray.Dataset, array: xarray.DataArray, along: tuple[str, ...], at: At
) -> tuple[dict[str, int], list[str]]:
    """Indices along the dimensions that are cut, and a description of them."""
    chosen: dict[str, int] = {}
    words: list[str] = []
    for name, wanted in at.items():
        if name not in array.dims or name in along:
            free = [str(dim) for dim in array.dims if dim not in along]
            raise InputError("name in 'at'", got=name, expected=" or ".join(free) or "none")
        size = array.sizes[name]
        labels = dataset[name].values if name in dataset.coords else np.arange(size)
        if isinstance(wanted, str) or labels.dtype.kind not in "fiu":
            places = np.flatnonzero(labels == wanted)
            if not len(places):
                raise InputError(
                    f"{name} in 'at'", got=wanted, expected=_choices(dataset, array, name)
                )
            chosen[name] = int(places[0])
            words.append(f"{wanted}")
        elif name in dataset.coords:
            chosen[name] = int(np.argmin(np.abs(labels - wanted)))
            unit, ends = dataset[name].attrs.get("units", ""), (labels.min(), labels.max())
            if not ends[0] - 1e-9 <= wanted <= ends[1] + 1e-9:
                values = _choices(dataset, array, name)
                warn_of_slip(
                    f"{name} = {short(wanted, 4)} {unit}: the map has {values}; its end is shown"
                )
            words.append(f"{name} = {short(float(labels[chosen[name]]), 4)} {unit}".strip())
        else:
            if not 0 <= wanted < size or wanted != int(wanted):
                raise InputError(f"{name} in 'at'", got=wanted, expected=f"0 to {size - 1}")
            chosen[name] = int(wanted)
            words.append(f"{name.replace('_', ' ')} {int(wanted) + 1} of {size}")
    return chosen, words


def _choices(dataset: xarray.Dataset, array: xarray.DataArray, name: str) -> str:
    if name in dataset.coords:
        values = dataset[name].values
        if values.dtype.kind in "fiu":
            return f"values from {number(values.min())} to {number(values.max())}"
        return " or ".join(map(str, values))
    return f"0 to {array.sizes[name] - 1}"
