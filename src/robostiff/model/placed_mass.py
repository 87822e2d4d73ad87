"""Masses in the world, and the points on bodies by which elastic parts carry theirs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robostiff.record import Entry, is_zero

_SAME = 1e-12  # of a part of a length: rounding at the samples


@dataclass(frozen=True)
class PointMass:
    """A mass at a point of a body.

    Attributes
    ----------
    after : int
        How many elements of the part lie before the body.
    value : float or entry
        [kg].
    point : (3,) array
        At the unloaded posture [m].
    """

    after: int
    value: Any
    point: np.ndarray


@dataclass(frozen=True)
class PlacedMass:
    """A mass in the world.

    Attributes
    ----------
    name : str
        Of its part.
    value : (...) array
        [kg].
    centre : (..., 3) array
        Where it is [m].
    after : int
        How many elements of its leg lie before the body that carries it; 0 in a network. It is
        spread along, or carried by, the last of these where `start` is given.
    start : (..., 3) array or None
        Where the elastic part that carries it begins [m].
    span : (float, float) or None
        From which to which part of its length it is spread; None for a mass in one place.
    """

    name: str
    value: np.ndarray
    centre: np.ndarray
    after: int = 0
    start: np.ndarray | None = None
    span: tuple[float, float] | None = None

    def at(self, rows: int | slice) -> PlacedMass:
        """The mass at one pose, or at some poses, of a batch along one axis."""
        start = None if self.start is None else one_of(self.start, 1, rows)
        value, centre = one_of(self.value, 0, rows), one_of(self.centre, 1, rows)
        return replace(self, value=value, centre=centre, start=start)

    def lumped(self, parts: int, end: np.ndarray) -> list[PointMass]:
        """The mass as points on bodies whose weights bend its elastic part as it does.

        A clamped cubic of length L moves across at s L by ``(3 s^2 - 2 s^3) v + (s^3 - s^2) L r``,
        v and r of its far end. The weight of what lies there acts on the far body by a share
        ``3 s^2 - 2 s^3`` at the distance ``L (s^2 - s^3) / (3 s^2 - 2 s^3)`` before its end, and
        alike on the near body; of a mass that is spread both are integrals. Spread evenly, half of
        it is L/6 before each end. A uniform beam has then the deflection under its weight exactly
        at its tip.

        Parameters
        ----------
        parts : int
            Elements into which the elastic part is cut; 0 for a mass in one place of a body.
        end : (3,) array
            Where the elastic part ends [m], of numbers or of entries of a record, as the mass.

        Examples
        --------
        >>> middle, start = np.array([0.3, 0, 0]), np.zeros(3)
        >>> beam = PlacedMass("beam", np.array(3.0), middle, start=start, span=(0.0, 1.0))
        >>> [(own.value, round(own.point[0], 9)) for own in beam.lumped(1, 2 * middle)]
        [(1.5, np.float64(0.1)), (1.5, np.float64(0.5))]
        """
        value = self.value if isinstance(self.value, Entry) else float(self.value)
        if self.start is None or not parts:
            return [PointMass(0, value, np.asarray(self.centre))]
        x = end - self.start
        if self.span is None:
            length = x @ x
            first = _part((self.centre - self.start) @ x, length) if _size(length) else 1.0
            last, aside = first, self.centre - self.start - x * first
        else:
            (first, last), aside = self.span, np.zeros(3)
        in_one_place = is_zero(last - first)
        found = []
        at = self.start + aside
        for i in range(parts):
            low, high = first * parts - i, last * parts - i
            if in_one_place:
                own = value if min(int(_size(first) * parts), parts - 1) == i else 0
            else:
                low, high = max(low, 0.0), min(high, 1.0)
                own = value * (max(high - low, 0.0) / ((last - first) * parts))
            if _size(own) == 0:
                continue
            far, arm = _share(low, high)
            near, near_arm = _share(1 - high, 1 - low)
            for after, share, place in ((i, near, near_arm), (i + 1, far, 1 - arm)):
                if _size(share) > 0:
                    found.append(
                        PointMass(after, own * share, at + x * ((i + place) * (1 / parts)))
                    )
        return found


def one_of(values: np.ndarray, own_axes: int, index: int | slice) -> np.ndarray:
    """Values at some poses of a batch; those that are the same at all poses have no batch axis."""
    return values if values.ndim == own_axes else values[index]


def _part(along: Any, length: Any) -> Any:
    """Which part of its length a mass is at; a number where it is so at all samples."""
    s = along / length
    if not isinstance(s, Entry):
        return float(np.clip(s, 0.0, 1.0))
    usual = _size(s)
    return usual if np.max(np.abs(s.sample - usual)) < _SAME else s


def _size(value: Any) -> float:
    return float(np.mean(np.abs(value.sample))) if isinstance(value, Entry) else abs(float(value))


def _share(low: Any, high: Any) -> tuple[Any, Any]:
    """Share of the far end in what lies between two places, and how far before it that acts."""
    if is_zero(high - low):
        square = low * low
        share, moment = 3 * square - 2 * square * low, square - square * low
    else:
        share = _mean(low, high, lambda s: s**3 - s**4 / 2)
        moment = _mean(low, high, lambda s: s**3 / 3 - s**4 / 4)
    return share, moment / share if _size(share) > 0 else 0.0


def _mean(low: float, high: float, integral: Callable[[float], float]) -> float:
    return (integral(high) - integral(low)) / (high - low)
