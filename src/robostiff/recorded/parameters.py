"""Symbols of a robot as further inputs of its record."""

from __future__ import annotations

import numpy as np

from robostiff.errors import InputError
from robostiff.kinematics import PostureFinder, posture_finder
from robostiff.model import Robot, with_entries
from robostiff.record import Entry, Record
from robostiff.recorded.samples import COUNT, sample_postures
from robostiff.recorded.symbols import entry_reader

_SPREAD = 0.02  # of the nominal values
_SEED = 1911


def parameter_samples(robot: Robot, seed: int | None = None) -> dict[str, np.ndarray]:
    """Values of the symbols of a robot around the nominal ones, by name (samples,); {} of none.

    Another seed gives others than those of the records.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> samples = parameter_samples(load("planar-link", symbols=("L",)))
    >>> samples["L"].shape, bool(np.all(np.abs(samples["L"] - 0.5) <= 0.01))
    ((5,), True)
    """
    random = np.random.default_rng(_SEED if seed is None else seed)
    samples = {}
    for symbol in robot.symbols:
        nominal = float(robot.nominal[str(symbol)])
        spread = _SPREAD * (abs(nominal) or 1.0)
        samples[str(symbol)] = nominal + spread * random.uniform(-1, 1, COUNT)
    return samples


def with_inputs(robot: Robot, record: Record) -> Robot:
    """The robot with the inputs of a record in place of its symbols, and floats elsewhere."""
    if not robot.has_formulas:
        return robot
    return with_entries(robot, entry_reader(record, exact=False))


def sample_coordinates(robot: Robot, finder: PostureFinder) -> list[np.ndarray]:
    """Coordinates of each leg (samples, size) at the sample postures, every sample closed anew.

    Raises
    ------
    InputError
        When a leg does not reach its sample postures with other values of the parameters.
    """
    posture = sample_postures(finder.robot, finder)
    values = parameter_samples(robot)
    if not values or robot.is_posed_by_joints:
        return list(posture.coordinates)
    rows = []
    for k in range(COUNT):
        other = robot.substituted({name: float(own[k]) for name, own in values.items()})
        told = robot.coordinate_places
        closed = posture_finder(other).find(posture.pose[k : k + 1, told])
        if not closed.reached.all():
            raise InputError(
                f"parameters of {robot.name!r}",
                got=", ".join(values),
                expected="parameters that may change a little while the legs reach the platform",
            )
        rows.append(closed.coordinates)
    return [np.concatenate(own) for own in zip(*rows, strict=True)]


def coordinates_at_home(robot: Robot, finder: PostureFinder) -> list[float | Entry]:
    """Home coordinates of a robot on entries; those of the position may depend on parameters.

    Raises
    ------
    InputError
        When a parameter turns the platform about axes that a pose does not tell.
    """
    six: list[float | Entry] = finder.home_pose.tolist()
    if robot.home is None or not robot.has_formulas:
        return six
    told = set(robot.coordinate_places)
    turned = any(isinstance(x, Entry) for x in robot.home.R.flat)
    if turned and not {3, 4, 5} <= told:
        raise InputError(
            f"parameters of {robot.name!r}",
            got="one that turns the platform at home",
            expected="parameters that leave the rotation of the platform at home alone",
            hint="leave that parameter at its nominal value",
        )
    return [*robot.home.p.tolist(), *six[3:]]
