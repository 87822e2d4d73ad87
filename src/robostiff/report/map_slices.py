"""Slices of a map of the workspace, one coordinate behind a slider."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.markup import Paragraph, Section, number
from robostiff.plot.backend import DATA
from robostiff.plot.map_pictures import OVERVIEW, map_slice
from robostiff.plot.map_selection import CLASSES
from robostiff.plot.picture import Field
from robostiff.report.contents import ReportContents
from robostiff.report.figures import Figure, Level

if TYPE_CHECKING:
    import xarray


_MOST_LEVELS = 25
_MOST_VALUES = 40_000  # of all figures, by which a page stays below 2 MB


def map_section(contents: ReportContents) -> Section | None:
    """A figure for each quantity of the map; nothing without a map."""
    found = contents.found
    if found is None:
        return None
    axes = [str(name) for name in found["status"].dims if found.sizes[name] > 1]
    title = "Over the workspace"
    if len(axes) < 2 or any(name not in found.coords for name in axes):
        why = "The map has no grid over two coordinates, so there is no slice to draw."
        return Section("map", title, [Paragraph(why)])
    # ranks and statuses where there is more than one of them
    several = [name for name in CLASSES if len(np.unique(found[name].values)) > 1]
    names = [name for name in (*OVERVIEW, *several) if name in found]
    poses = int(np.prod([found.sizes[name] for name in axes]))
    words = [f"{poses} poses over {', '.join(axes)}."]
    # so few values of the first coordinates that slices of all stay small
    kept = {name: found.sizes[name] for name in axes[:3]}
    for name in axes[2:3]:
        kept[name] = min(kept[name], _MOST_LEVELS)
    while len(names) * math.prod(kept.values()) > _MOST_VALUES:
        longest = max(axes[:2], key=lambda name: kept[name])
        kept[longest] = math.ceil(0.9 * kept[longest])
    chosen = {name: np.linspace(0, found.sizes[name] - 1, n) for name, n in kept.items()}
    shown = found.isel({name: np.round(own).astype(int) for name, own in chosen.items()})
    thin = [
        f"{shown.sizes[name]} of {found.sizes[name]} values of {name}"
        for name in axes[:3]
        if shown.sizes[name] < found.sizes[name]
    ]
    if thin:
        words.append(f"The slices show {', '.join(thin)}.")
    figures = [_slices(contents, shown, name, axes) for name in names]
    return Section("map", title, [Paragraph(" ".join(words)), *figures])


def _slices(
    contents: ReportContents, found: xarray.Dataset, variable: str, axes: list[str]
) -> Figure:
    x, y, *others = axes
    fixed: dict[str, Any] = {name: _near(contents, found, name) for name in others[1:]}
    levels = [float(value) for value in found[others[0]].values] if others else [None]
    rank = contents.stiffness.space.size
    pictures: list[Field] = []
    for value in levels:
        at = dict(OVERVIEW.get(variable, {})) | fixed
        if value is not None:
            at[others[0]] = value
        one = map_slice(found, variable, x=x, y=y, at=at, full_rank=rank, backend=DATA)
        pictures.append(one)
    labels = [
        "" if value is None else f"{others[0]} = {number(value)} {found[others[0]].attrs['units']}"
        for value in levels
    ]
    start = 0
    if others:
        start = int(np.argmin(np.abs(np.array(levels) - _near(contents, found, others[0]))))
    caption = str(found[variable].attrs.get("long_name", variable))
    if OVERVIEW.get(variable, {}):
        caption = f"The smallest of the {caption.partition(';')[0]}"  # which are in ascending order
    units = {name: found[name].attrs["units"] for name in fixed}
    places = ", ".join(f"{n} = {number(value)} {units[n]}" for n, value in fixed.items())
    caption = f"{caption[0].upper()}{caption[1:]}{f', at {places}' if places else ''}."
    # the same colours for the same values at all levels
    scales = [own.scale for own in pictures if own.scale and np.isfinite(own.values).any()]
    low, high = min((s.low for s in scales), default=0), max((s.high for s in scales), default=0)
    shown = [
        replace(own, scale=replace(own.scale, low=low, high=high)) if own.scale and scales else own
        for own in pictures
    ]
    return Figure(variable.replace("_", "-"), caption, tuple(map(Level, labels, shown)), start)


def _near(contents: ReportContents, found: xarray.Dataset, name: str) -> float:
    """Value of a coordinate nearest to the pose of the report, or in the middle of the map."""
    values = np.asarray(found[name].values, dtype=float)
    pose, names = contents.stiffness.pose, ("x", "y", "z", "rx", "ry", "rz")
    wanted = values.mean() if pose is None or name not in names else pose[names.index(name)]
    return float(values[np.argmin(np.abs(values - wanted))])
