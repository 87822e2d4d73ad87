"""From written masses and gravity to those of the model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robostiff.io.model_file.geometry import point
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_parts import Value, WrittenMass
from robostiff.io.model_file.written_robot import WrittenPlatformMass
from robostiff.io.suggest import Words
from robostiff.io.units import Dimension
from robostiff.model import Mass, gravity_vector
from robostiff.spatial.formula import is_above


def read_mass(place: Place, written: Value | None) -> Any:
    """The mass that is written at a place [kg]; None where there is none."""
    if written is None:
        return None
    value = place.number(written, Dimension.MASS)
    if is_above(0, value):
        raise place.error("mass", got=written, expected="zero or more, such as 2 kg")
    return value


def build_masses(place: Place, written: WrittenMass) -> tuple[Mass, ...]:
    """The mass of a part, as far as it is written."""
    if written.mass is None and written.centre is not None:
        raise (place / "centre").error(
            "centre of mass",
            got=Words("no mass beside it"),
            expected="mass: beside centre:",
            hint="a beam has its mass from the density of its material, in its middle",
            key=True,
        )
    value = read_mass(place / "mass", written.mass)
    if value is None:
        return ()
    centre = None if written.centre is None else point(place / "centre", written.centre)
    return (Mass(value, centre),)


def build_platform_masses(place: Place, written: Sequence[WrittenPlatformMass]) -> tuple[Mass, ...]:
    """Masses of the platform and of what it carries."""
    found = []
    for i, own in enumerate(written):
        here = place / i
        value = read_mass(here / "mass", own.mass)
        if value is not None:
            centre = None if own.centre is None else point(here / "centre", own.centre)
            found.append(Mass(value, centre, name=own.name or f"platform{i + 1}"))
    return tuple(found)


def build_gravity(place: Place, written: str | list[Value] | None) -> np.ndarray | None:
    """Acceleration of free fall [m/s^2]; None where none is written."""
    if written is None:
        return None
    if isinstance(written, str):
        return gravity_vector("gravity", written)
    values = [(place / i).number(value, Dimension.ACCELERATION) for i, value in enumerate(written)]
    return np.array(values, dtype=object if place.is_exact else float)
