"""Masses as points on bodies: those along an elastic part on the bodies at its ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from robostiff.model import PlacedMass


@dataclass(frozen=True)
class PointMass:
    """A mass at a point of a body.

    Attributes
    ----------
    after : int
        How many elements of the part lie before the body.
    value : float
        [kg].
    point : (3,) array
        At the unloaded posture [m].
    """

    after: int
    value: float
    point: np.ndarray


def lumped(mass: PlacedMass, parts: int, end: np.ndarray) -> list[PointMass]:
    """A mass as points on bodies whose weights bend its elastic part as it does.

    A clamped cubic of length L moves across at s L by ``(3 s^2 - 2 s^3) v + (s^3 - s^2) L r``, v
    and r of its far end. The weight of what lies there acts on the far body by a share
    ``3 s^2 - 2 s^3`` at the distance ``L (s^2 - s^3) / (3 s^2 - 2 s^3)`` before its end, and alike
    on the near body; of a mass that is spread both are integrals. Spread evenly, half of it is L/6
    before each end. A uniform beam has then the deflection under its weight exactly at its tip.

    Parameters
    ----------
    mass : PlacedMass
        At one pose.
    parts : int
        Elements into which the elastic part is cut; 0 for a mass in one place of a body.
    end : (3,) array
        Where the elastic part ends [m].

    Examples
    --------
    >>> beam = PlacedMass("beam", np.array(3.0), np.array([0.3, 0, 0]), 1, np.zeros(3), (0.0, 1.0))
    >>> [(own.value, round(own.point[0], 9)) for own in lumped(beam, 1, np.array([0.6, 0, 0]))]
    [(1.5, np.float64(0.1)), (1.5, np.float64(0.5))]
    """
    value = float(mass.value)
    if mass.start is None or not parts:
        return [PointMass(0, value, np.asarray(mass.centre, dtype=float))]
    x = end - mass.start
    length = float(x @ x)
    if mass.span is None:
        s = float(np.clip((mass.centre - mass.start) @ x / length, 0.0, 1.0)) if length else 1.0
        first, last, aside = s, s, mass.centre - mass.start - s * x
    else:
        (first, last), aside = mass.span, np.zeros(3)
    found = []
    for i in range(parts):
        low, high = max(first * parts - i, 0.0), min(last * parts - i, 1.0)
        if first == last:
            here = min(int(first * parts), parts - 1) == i
            own, low, high = (value, low, low) if here else (0.0, 0.0, 0.0)
        else:
            own = value * max(high - low, 0.0) / ((last - first) * parts)
        if own == 0:
            continue
        far, arm = _share(low, high)
        near, near_arm = _share(1 - high, 1 - low)
        at = mass.start + aside
        for after, share, place in ((i, near, near_arm), (i + 1, far, 1 - arm)):
            if share > 0:
                found.append(PointMass(after, own * share, at + (i + place) / parts * x))
    return found


def _share(low: float, high: float) -> tuple[float, float]:
    """Share of the far end in what lies between two places, and how far before it that acts."""
    if high == low:
        share, moment = 3 * low**2 - 2 * low**3, low**2 - low**3
    else:
        share = _mean(low, high, lambda s: s**3 - s**4 / 2)
        moment = _mean(low, high, lambda s: s**3 / 3 - s**4 / 4)
    return share, moment / share if share > 0 else 0.0


def _mean(low: float, high: float, integral: Callable[[float], float]) -> float:
    return (integral(high) - integral(low)) / (high - low)
