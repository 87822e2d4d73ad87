"""Loads beside the wrench: forces, masses and gravity as they are given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError
from robostiff.linkage import Linkage
from robostiff.model import Mass, PlacedMass, Robot, Snapshot, gravity_vector
from robostiff.model.cable import CableRobot, Weight
from robostiff.network import Network
from robostiff.spatial import Space, as_float, as_floats

Loads = Mapping[str, Any]
Masses = Mapping[str, Any]
Gravity = ArrayLike | str | None
Frame = tuple[np.ndarray, np.ndarray]
_NONE = np.zeros(3)


@dataclass(frozen=True)
class DeadForce:
    """A force that keeps its direction in the world, at a point of a body of the robot.

    Attributes
    ----------
    force : (3,) array
        In world axes [N].
    point : (3,) array or None
        Where it acts at the unloaded posture, in the world [m]; None for the place of the part
        that names the body.

    Examples
    --------
    >>> DeadForce([0, 0, -120]).point is None
    True
    """

    force: object
    point: object = None


def acting_gravity(
    robot: Robot | Snapshot | Network, gravity: Gravity, loads: Loads | None
) -> np.ndarray:
    """Acceleration of free fall (3,) [m/s^2]: as given, or as the robot has it, or none.

    Raises
    ------
    InputError
        When it is given for a robot without masses, none being among the loads, or is no vector.
    """
    if gravity is None:
        own = (robot.in_floats if isinstance(robot, Robot) else robot).gravity
        return _NONE if own is None else own
    pull = gravity_vector("gravity", gravity)
    given = loads.values() if isinstance(loads, Mapping) else ()
    each = (own if isinstance(own, Sequence) else [own] for own in given)
    weighs = any(isinstance(load, Mass) for own in each for load in own)
    if np.any(pull) and not (weighs or has_masses(robot)):
        raise InputError(
            f"gravity on {robot.name!r}",
            got="a robot without masses",
            expected="masses of its parts: mass: in the file, or a density of materials",
            hint='or weights as loads: loads={"platform": rs.Mass(12)}, --weight "platform=12 kg"',
        )
    return pull


def has_masses(robot: Robot | Snapshot | Network | Linkage | CableRobot) -> bool:
    """Whether any part of a robot has a mass.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> has_masses(load("hexapod")), has_masses(load("gough-stewart-b"))
    (True, False)
    """
    if isinstance(robot, CableRobot):
        return False
    if isinstance(robot, Linkage):
        return any(_carries(c.element) for c in robot.connections)
    if isinstance(robot, Network):
        return robot.has_masses
    if isinstance(robot, Snapshot):
        return bool(robot.masses) or any(_carries(leg) for leg in robot.legs)
    return bool(robot.platform_masses) or any(_carries(leg.chain) for leg in robot.legs)


def _carries(part: Any) -> bool:
    """Whether a leg, chain, block or element has a mass, or something in it."""
    if getattr(part, "masses", ()) or getattr(part, "mass", None) is not None:
        return True
    material = getattr(part, "material", None)
    if material is not None and material.density is not None:
        return True
    inner = [*getattr(part, "elements", ()), *getattr(part, "beams", ())]
    inner += [getattr(branch, "chain", branch) for branch in getattr(part, "branches", ())]
    return any(map(_carries, inner))


def given_forces(
    loads: Loads | None, gravity: np.ndarray, space: Space, frame: Frame
) -> dict[str, tuple[DeadForce, ...]]:
    """Forces by the names of bodies; masses are pulled by gravity, or down where there is none.

    Parameters
    ----------
    loads : mapping of str to force, DeadForce, Mass, Weight or a sequence of them
    gravity : (3,) array
        [m/s^2].
    space : Space
        Down is -z, and -y of a planar robot.
    frame : tuple of (3, 3) and (3,) arrays
        Axes and origin of the platform frame [m].

    Raises
    ------
    InputError
        When one is neither, or is a `Weight` elsewhere than on the platform.
    """
    if loads is not None and not isinstance(loads, Mapping):
        raise InputError(
            "loads", got=loads, expected='forces by names, such as {"leg1/strut": [0, 0, -80]}'
        )
    down = gravity
    if not np.any(gravity):
        down = gravity_vector("gravity", "-y" if space is Space.PLANAR else "-z")
    return {name: _forces(name, value, down, frame) for name, value in (loads or {}).items()}


def weights_of(masses: Sequence[PlacedMass], gravity: np.ndarray) -> list[DeadForce]:
    """Weights of masses in the world; none without gravity."""
    return [DeadForce(m.value * gravity, m.centre) for m in masses if np.any(gravity)]


def arms_and_forces(
    on_platform: Sequence[DeadForce], point: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Arms (k, 3) of dead forces on the platform from its point [m], and the forces (k, 3) [N]."""
    arms = [
        np.zeros(3) if own.point is None else load_vector("point", "platform", own.point) - point
        for own in on_platform
    ]
    forces = [load_vector("force", "platform", own.force) for own in on_platform]
    return np.array(arms).reshape(-1, 3), np.array(forces).reshape(-1, 3)


def _forces(name: str, value: Any, down: np.ndarray, frame: Frame) -> tuple[DeadForce, ...]:
    kinds = (DeadForce, Mass, Weight)
    if isinstance(value, kinds):
        return (_force(name, value, down, frame),)
    if isinstance(value, Sequence) and value and all(isinstance(v, kinds) for v in value):
        return tuple(_force(name, own, down, frame) for own in value)
    return (DeadForce(load_vector("force", name, value)),)


def _force(
    name: str, value: DeadForce | Mass | Weight, down: np.ndarray, frame: Frame
) -> DeadForce:
    if isinstance(value, Mass):
        return DeadForce(value.value * down, value.centre)
    if isinstance(value, DeadForce):
        return value
    if name != "platform":
        raise InputError(
            f"load on {name!r}",
            got="a Weight, whose point is in the platform frame",
            expected="a DeadForce, a Mass or three numbers [N]",
            hint=f'write loads={{"{name}": rs.Mass(12)}}, or give the Weight to "platform"',
        )
    R, p = frame
    return DeadForce(value.force, p + R @ np.asarray(value.point, dtype=float))


def load_vector(what: str, name: str, value: object) -> np.ndarray:
    """Force [N] or point [m] of a load on a body (3,)."""
    units = "N" if what == "force" else "m"
    subject = f"{what} of the load on {name!r}"
    return as_floats(subject, value, f"three numbers [{units}]", units, (3,))


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
        When they have no names, or one is not more than zero.
    """
    if not isinstance(masses, Mapping):
        raise InputError(
            "masses", got=masses, expected='masses by names, such as {"platform": 150}'
        )
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
