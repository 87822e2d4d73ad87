"""Masses that move with the bodies of a robot, as the forces of a gravity on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.model import Mass
from robostiff.spatial import as_float
from robostiff.statics.from_snapshot import DeadForce, load_vector

Masses = Mapping[str, Any]


def unit_weights(
    masses: Masses, places: Mapping[str, np.ndarray]
) -> dict[str, tuple[DeadForce, ...]]:
    """Masses as the forces of a gravity of 1 m/s^2 against z, by the names of bodies.

    Parameters
    ----------
    masses : mapping of str to float, Mass or a sequence of them
    places : mapping of str to (3,) arrays
        Of a mass without a centre, by name [m].

    Raises
    ------
    InputError
        When a mass is not more than zero.
    """
    found = {}
    for name, value in masses.items():
        several = isinstance(value, Sequence) and not isinstance(value, str)
        found[name] = tuple(
            DeadForce([0.0, 0.0, -m], at)
            for one in (value if several else (value,))
            for m, at in _points(name, one, places)
        )
    return found


def _points(
    name: str, value: Any, places: Mapping[str, np.ndarray]
) -> list[tuple[float, np.ndarray]]:
    subject, expected = f"mass of {name!r}", "more than zero [kg], or a Mass"
    mass = as_float(subject, value.value if isinstance(value, Mass) else value, expected, "kg")
    if not (np.isfinite(mass) and mass > 0):
        raise InputError(subject, got=mass, expected=expected)
    own = value if isinstance(value, Mass) else Mass(mass, name=name)
    centre = places.get(name, np.zeros(3))
    if own.centre is not None:
        centre = load_vector("point", name, own.centre)
    return [(float(m), centre + arm) for m, arm in own.points]
