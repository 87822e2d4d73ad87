"""Poses as a machine is commanded: coordinates of its actuators, or tool tip and tool axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.model import Actuated, Robot
from robostiff.spatial import as_floats

_SHORTEST = 1e-12  # of an axis: below it there is no direction


@frozen
class ActuatorCoordinates:
    """A posture given by the coordinates of the actuated joints; all others follow.

    The posture is that of the assembly mode of home, or the one nearest to ``near=`` where that is
    given. `actuator_names` lists the actuators of a robot in their order.

    Attributes
    ----------
    values : (..., n) array, or mapping of str to (...) array
        Coordinates [m, rad] of all actuators, leg by leg from base to platform; or by their names,
        where those left out stay at home.
    """

    values: ArrayLike | Mapping[str, ArrayLike]

    def numbers(self, robot: Robot, home: np.ndarray) -> np.ndarray:
        """Coordinates of all actuators (..., n), from names with those of home (n,).

        Raises
        ------
        InputError
            When they do not fit the robot, or are no finite numbers.
        """
        names = actuator_names(robot)
        each = zip(robot.legs, actuator_places(robot), strict=True)
        units = [leg.chain.freedoms[place].unit for leg, places in each for place in places]
        subject = f"actuator coordinates of {robot.name!r}"
        if not names:
            raise InputError(subject, expected="none: this robot has no actuated joint")
        drives = dict(zip(names, home[:, None], strict=True))
        return coordinates_of_drives(subject, self.values, drives, names, units)


def coordinates_of_drives(
    subject: str,
    given: Any,
    drives: Mapping[str, np.ndarray],
    inputs: Sequence[str],
    units: Sequence[str],
    hint: str | None = None,
) -> np.ndarray:
    """Coordinates of drives as they were given: in a row (..., n), or by the names of the drives.

    Parameters
    ----------
    subject : str
        What they are, in words.
    given : array-like, or mapping of str to array-like
        By name numbers (...), or (..., size) of a drive with several coordinates.
    drives : mapping of str to (size,) array
        Coordinates of each drive at home, where it stays when it is left out [m, rad].
    inputs, units : sequence of str
        Names and SI units of all coordinates.
    hint : str, optional
        What to write for a name that is not there.

    Raises
    ------
    InputError
        When names or numbers do not fit.
    """
    if not isinstance(given, Mapping):
        n = len(inputs)
        words = f"{n} finite numbers in the last axis: {' '.join(inputs)}, one pose a row"
        rows = as_floats(subject, given, words, units)
        if rows.shape[-1:] != (n,):
            raise InputError(subject, got=Words(f"shape {rows.shape}"), expected=words)
        return rows
    parts, start, unit_of = dict(drives), 0, {}
    for name, own in drives.items():
        unit_of[name] = units[start] if own.size == 1 else units[start : start + own.size]
        start += own.size
    for name, value in given.items():
        if name not in parts:
            raise InputError(subject, got=name, expected=f"one of {', '.join(parts)}", hint=hint)
        size = drives[name].size
        words = f"numbers (N,) of {name!r}" if size == 1 else f"numbers (N, {size}) of {name!r}"
        numbers = as_floats(f"coordinates of {name!r}", value, words, unit_of[name])
        parts[name] = numbers[..., None] if size == 1 else numbers
        if parts[name].shape[-1:] != (size,):
            raise InputError(subject, got=Words(f"shape {numbers.shape}"), expected=words)
    try:
        batch = np.broadcast_shapes(*(own.shape[:-1] for own in parts.values()))
    except ValueError:
        shapes = ", ".join(f"{own.shape[:-1]} of {name!r}" for name, own in parts.items())
        expected = "as many poses for each joint"
        raise InputError(subject, got=Words(shapes), expected=expected) from None
    each = [np.broadcast_to(own, (*batch, own.shape[-1])) for own in parts.values()]
    return np.concatenate([np.zeros((*batch, 0)), *each], axis=-1)


@frozen
class ToolPose:
    """A pose given by the tip of the tool and the direction of its axis, as for milling.

    A machine with fewer than six freedoms turns about the tool axis as its legs demand. One with
    six is turned from home the shortest way, then by `spin` about the axis.

    Attributes
    ----------
    tip : (..., 3) array
        Place of the reference point of the robot in the world [m].
    axis : (..., 3) array
        Direction of the tool axis in the world, from the tip towards the spindle, as I, J and K of
        cutter location data; of any length.
    tool_axis : (3,) array
        The same direction in the platform frame.
    spin : float, (...) array or None
        Turn about the axis, from the shortest way from home [rad]; None for what the machine
        demands.
    """

    tip: ArrayLike
    axis: ArrayLike
    tool_axis: ArrayLike = (0.0, 0.0, 1.0)
    spin: ArrayLike | None = None

    def numbers(self, robot: Robot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tips (..., 3), unit axes (..., 3) in the world, and the unit axis (3,) of the tool.

        Raises
        ------
        InputError
            When they are no finite vectors, or an axis has no length.
        """
        subject = f"tool pose of {robot.name!r}"
        tip = as_floats(f"{subject}, tip", self.tip, "3 finite numbers in the last axis", "m")
        words = "a direction: three finite numbers in the last axis, not all zero"
        units = []
        for key, value in (("axis", self.axis), ("tool_axis", self.tool_axis)):
            given = as_floats(f"{subject}, {key}", value, words)
            size = np.linalg.norm(given, axis=-1, keepdims=True)
            if given.shape[-1:] != (3,) or np.any(size < _SHORTEST):
                raise InputError(f"{subject}, {key}", got=value, expected=words)
            units.append(given / size)
        axis, own = units
        if tip.ndim == 0 or tip.shape[-1] != 3:
            raise InputError(f"{subject}, tip", got=self.tip, expected="x y z in the last axis [m]")
        if own.shape != (3,):
            raise InputError(f"{subject}, tool_axis", got=self.tool_axis, expected="one direction")
        tip, axis = np.broadcast_arrays(tip, axis)
        return tip, axis, own


def actuator_names(robot: Robot) -> tuple[str, ...]:
    """Names of the actuated joints in the order of `ActuatorCoordinates`.

    ``leg/joint``, or the joint alone in a robot of one leg.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> actuator_names(load("3-rpr"))
    ('leg1/actuator', 'leg2/actuator', 'leg3/actuator')
    """
    names = []
    for leg, places in zip(robot.legs, actuator_places(robot), strict=True):
        prefix = "" if robot.is_serial else f"{leg.name}/"
        own = leg.chain.coordinate_names
        names += [prefix + own[place] for place in places]
    return tuple(names)


def actuator_places(robot: Robot) -> tuple[np.ndarray, ...]:
    """Places of the actuated coordinates in each leg's coordinates."""
    return tuple(
        np.array([i for i, role in enumerate(leg.chain.roles) if isinstance(role, Actuated)], int)
        for leg in robot.legs
    )
