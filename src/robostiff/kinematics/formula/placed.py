"""A leg in the world as formulas."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from robostiff.kinematics.formula.pose import FormulaPose
from robostiff.model import PlacedLeg


@dataclass(frozen=True)
class PlacedFormula:
    """A leg in the world, its entries recorded.

    Attributes
    ----------
    leg : PlacedLeg
        Points, axes, rotations and compliances are arrays of objects, in world axes.
    gap : tuple of Entry
        What vanishes when the leg meets the platform: squares of sines, and of shifts over the
        length of the rod or crank. Those that vanish at all samples are left out.
    lengths : tuple of Entry
        Lengths of the telescopes' beams that must be positive [m].
    losses : tuple of Entry
        Digits that the closure loses.
    coordinate : callable
        Records the leg coordinate of a place in the coordinate vector [m, rad].
    platform : FormulaPose
        Where the leg holds the platform.
    """

    leg: PlacedLeg
    gap: tuple[Any, ...]
    lengths: tuple[Any, ...]
    coordinate: Callable[[int], Any]
    platform: FormulaPose
    losses: tuple[Any, ...] = ()
