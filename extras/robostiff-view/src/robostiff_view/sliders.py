"""What can be moved: coordinates, parameters and loads, with ranges and units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robostiff.model import Actuated, Coordinate, Locked, Robot
from robostiff.spatial import Space

_REACH = 0.25  # of the robot: how far a coordinate goes from home
_TURN = 45.0  # [deg]
_STEPS = 400
_WRITTEN = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*([^\d\s()+*-][^()+-]*)?\s*")
_LARGEST_FORCE, _LARGEST_MOMENT = 1000.0, 200.0  # [N], [N m]


@dataclass(frozen=True)
class Slider:
    """A number that can be moved."""

    name: str  # of a coordinate, a parameter or a component of the load
    unit: str  # in which it is shown; empty for a plain number
    # in this unit
    low: float
    high: float
    start: float
    # from this unit to SI; not used for parameters, which are given with their unit
    factor: float = 1.0
    kind: str = ""  # a parameter may have the name of a coordinate

    @property
    def key(self) -> str:
        """Its name among all sliders of a page."""
        return f"{self.kind} {self.name}".lstrip()

    @property
    def label(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def step(self) -> float:
        """A round step, some hundred of which make the range."""
        wanted = (self.high - self.low) / _STEPS
        power = 10.0 ** math.floor(math.log10(wanted))
        return next(round(k * power, 15) for k in (1, 2, 5, 10) if k * power >= wanted * 0.999)


def coordinate_sliders(
    names: Sequence[Coordinate], home: np.ndarray, start: np.ndarray, size: float
) -> tuple[Slider, ...]:
    """Of pose coordinates around home (6,), which begin at `start` (6,); `size` in metres."""
    places = [(own, list(Coordinate).index(own)) for own in names]
    return tuple(slider_around(own.value, i >= 3, home[i], start[i], size) for own, i in places)


def joint_sliders(robot: Robot, start: np.ndarray, size: float) -> tuple[Slider, ...]:
    """Of the joints of a serial arm at `start` (n,), within their limits where they have some.

    None of a joint that follows others by a gear.
    """
    chain = robot.legs[0].chain
    sums = {} if chain.transmission is None else chain.transmission.sums
    held = {chain.own_places[i] for i, own in sums.items() if isinstance(own.role, Locked)}
    sliders = []
    joints = zip(chain.freedoms, chain.coordinate_names, chain.roles, start, strict=True)
    for place, (screw, name, role, value) in enumerate(joints):
        if place in held:
            continue
        slider = slider_around(name, screw.turns, value, value, size, half_turn=180.0)
        if isinstance(role, Actuated) and role.limits is not None:
            low, high = (_shown(limit, slider.factor) for limit in role.limits)
            own = slider.start
            slider = replace(slider, low=min(low, own), high=max(high, own))
        sliders.append(slider)
    return tuple(sliders)


def joint_values(robot: Robot, values: Mapping[str, float]) -> np.ndarray:
    """Coordinates (n,) of a serial arm, from those of its sliders by name [m, rad]."""
    chain = robot.legs[0].chain
    each = zip(chain.coordinate_names, chain.home, strict=True)
    return np.array([values.get(name, float(own)) for name, own in each])


def load_sliders(space: Space, start: Sequence[float]) -> tuple[Slider, ...]:
    """Of the components of a wrench that begins at `start` (n,)."""
    sliders = []
    for i, (name, value) in enumerate(zip(space.wrench_order, start, strict=True)):
        is_force = i < space.translations
        most = _LARGEST_FORCE if is_force else _LARGEST_MOMENT
        most = max(most, _round_up(abs(float(value))) if value else 0.0)
        sliders.append(Slider(name, "N" if is_force else "N m", -most, most, float(value)))
    return tuple(sliders)


def parameter_sliders(definitions: Mapping[str, Any]) -> tuple[Slider, ...]:
    """Of the parameters of a model file that are numbers with or without a unit.

    Half to twice their value; those that are computed from others follow.

    Examples
    --------
    >>> [(s.label, s.low, s.high) for s in parameter_sliders({"R": "500 mm", "d": "R/2", "n": 3})]
    [('R [mm]', 250.0, 1000.0), ('n', 1.5, 6.0)]
    """
    sliders = []
    for name, definition in definitions.items():
        written = _WRITTEN.fullmatch(str(definition))
        if written is None or isinstance(definition, bool):
            continue
        value, unit = float(written[1]), (written[2] or "").strip()
        if value == 0:
            half = _TURN if unit == "deg" else 1.0
            sliders.append(Slider(name, unit, -half, half, 0.0, kind="parameter"))
        else:
            low, high = sorted((0.5 * value, 2 * value))
            sliders.append(Slider(name, unit, low, high, value, kind="parameter"))
    return tuple(sliders)


def slider_around(
    name: str, turns: bool, home: float, start: float, size: float, half_turn: float = _TURN
) -> Slider:
    """Of a coordinate, from home to both sides, and to the start [m, rad]; in degrees or mm."""
    unit, factor = ("deg", math.pi / 180) if turns else ("mm", 1e-3)
    half = half_turn if turns else _round_up(_REACH * size / factor)
    middle, value = _shown(home, factor), _shown(start, factor)
    digits = max(0, 2 - math.floor(math.log10(half)))
    low, high = (round(end, digits) for end in (middle - half, middle + half))
    return Slider(name, unit, min(low, value), max(high, value), value, factor)


def _shown(value: float, factor: float) -> float:
    """A value in the unit of a slider, as it would be written: no rounding of degrees."""
    return round(float(value) / factor, 9)


def _round_up(value: float) -> float:
    power = 10.0 ** math.floor(math.log10(value))
    return next(k * power for k in (1, 2, 5, 10) if k * power >= value * 0.999)
