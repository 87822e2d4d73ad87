"""Style of regions of a map: a fill outside the colour scale, and a hatching."""

from __future__ import annotations

from dataclasses import dataclass

from robostiff.plot.picture import Cover, Region
from robostiff.plot.theme import Palette

# Of the categories of a palette; None is the ground.
_TINTS = (None, None, None, 5, 3, 2, 1, None, None, None)
_GREY = (0.35, 0.15, 0.55, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0)
_HATCHES = ("--", "..", "////", "++", "||", "\\\\\\\\", "xxxx", "oo", "\\\\", "...")
_TINT = 0.38


@dataclass(frozen=True)
class RegionStyle:
    """Fill #rrggbb, none over values; hatching as Matplotlib writes it, and its colour."""

    fill: str | None
    hatch: str
    line: str


def region_style(region: Region, palette: Palette) -> RegionStyle:
    """Look of a region: the same for the same reason, in every picture."""
    order = region.order
    if region.cover is Cover.OVER:
        return RegionStyle(None, _HATCHES[order], palette.ground)
    tint = _TINTS[order]
    if tint is None:
        fill = palette.along((palette.ground, palette.faint), _GREY[order])
        return RegionStyle(fill, _HATCHES[order], palette.muted)
    colour = palette.categories[tint]
    fill = palette.along((palette.ground, colour), _TINT)
    return RegionStyle(fill, _HATCHES[order], colour)
