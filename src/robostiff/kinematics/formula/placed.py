"""A leg in the world as formulas, and legs whose coordinates are inputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.kinematics.closure.body import tidied, tidied_point
from robostiff.kinematics.frames import place_chain
from robostiff.kinematics.turn import turn_by_vector_of_entries
from robostiff.model import Leg, PlacedLeg, Telescope
from robostiff.record import Entry


@dataclass(frozen=True)
class FormulaPose:
    """A pose of the platform in the world.

    Attributes
    ----------
    R : (3, 3) array of entries and numbers
    p : (3,) array of entries and numbers
        [m].
    """

    R: np.ndarray
    p: np.ndarray

    @classmethod
    def of_coordinates(cls, coordinates: np.ndarray) -> FormulaPose:
        """The pose of x, y, z and a rotation vector (6,) [m, rad], entries or numbers.

        Examples
        --------
        >>> FormulaPose.of_coordinates(np.array([0.5, 0, 0, 0, 0, 0])).p.tolist()
        [0.5, 0.0, 0.0]
        """
        six = np.array(coordinates, dtype=object)
        return cls(turn_by_vector_of_entries(six[3:]), six[:3])


@dataclass(frozen=True)
class PlacedFormula:
    """A leg in the world, its entries recorded.

    Attributes
    ----------
    leg : PlacedLeg
        Points, axes, rotations and compliances are arrays of objects, in world axes.
    gap : tuple of Entry
        Gaps, zero when the leg meets the platform: squares of sines, and of shifts over the
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


def place_leg_at_joints(
    leg: Leg, q: np.ndarray, turned: Mapping[int, np.ndarray] | None = None
) -> PlacedFormula:
    """Record a leg at recorded coordinates, eq. (5); it has no gap.

    Parameters
    ----------
    leg : Leg
        Of floats or recorded entries.
    q : (size,) array of entries and numbers
        Leg coordinates [m, rad].
    turned : mapping of int to (3, 3) arrays, optional
        Axes in the world behind ball joints that do not come from their coordinates.
    """
    q = np.array(q, dtype=object)
    R_base, p_base = tidied(leg.base.R), tidied_point(leg.base.p)
    placed = place_chain(leg.chain, q, R_base, p_base, turned=turned)
    R = placed.R @ np.array(leg.attachment.R, dtype=object).T
    lengths = [
        beam.fixed + beam.share * q[where.start]
        for element, where in leg.chain.moving
        if isinstance(element, Telescope)
        for beam in element.beams
    ]
    return PlacedFormula(
        leg=PlacedLeg(leg.name, placed.elements, placed.p),
        gap=(),
        lengths=tuple(length for length in lengths if isinstance(length, Entry)),
        coordinate=lambda place: q[place],
        platform=FormulaPose(R, placed.p - R @ np.array(leg.attachment.p, dtype=object)),
    )
