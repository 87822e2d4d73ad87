"""Bars in groups, side by side or one on another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.plot.picture.paint import Paint


@dataclass(frozen=True)
class Series:
    """One bar in every group.

    Attributes
    ----------
    name : str
    paint : Paint
    values : (groups,) array
        NaN where there is no bar.
    texts : tuple of str
        Written at each bar; empty for none.
    """

    name: str
    paint: Paint
    values: np.ndarray
    texts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Group:
    """The name of a group of bars, and what is said about it."""

    name: str
    note: str = ""


@dataclass(frozen=True)
class Panel:
    """Bars with one unit.

    Attributes
    ----------
    label : str
        Of the axis of values, with its unit.
    groups : tuple of Group
    series : tuple of Series
    """

    label: str
    groups: tuple[Group, ...]
    series: tuple[Series, ...]


@dataclass(frozen=True)
class Bars:
    """Panels of bars.

    Attributes
    ----------
    title : str
    panels : tuple of Panel
        Of the same series.
    is_stacked : bool
        Whether the bars of a group lie one after another.
    notes : tuple of str
    """

    title: str
    panels: tuple[Panel, ...]
    is_stacked: bool = False
    notes: tuple[str, ...] = ()
