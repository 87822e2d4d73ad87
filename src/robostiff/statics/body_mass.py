"""Masses of the bodies of a robot, as points that move with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial import as_float, as_floats
from robostiff.statics.from_snapshot import DeadForce, load_vector

Masses = Mapping[str, Any]
# Of the largest second moment: what rounding leaves of a plate or a rod.
_FLAT = 1e-9


@dataclass(frozen=True)
class BodyMass:
    """A rigid mass that moves with a body of the robot.

    Attributes
    ----------
    mass : float
        More than zero [kg].
    centre : (3,) array or None
        Centre of gravity at the unloaded posture, in the world [m]; None for the place of the part
        that names the body.
    inertia : (3,) or (3, 3) array or None
        Moments of inertia about the centre, world axes [kg m^2]; None for a point mass.

    Examples
    --------
    >>> BodyMass(150, inertia=[4, 4, 7]).centre is None
    True
    """

    mass: float
    centre: object = None
    inertia: object = None


@dataclass(frozen=True)
class PointMasses:
    """What moves like a rigid mass: points fixed to one another.

    Attributes
    ----------
    values : (k,) array
        [kg].
    points : (k, 3) array
        At the unloaded posture [m].
    """

    values: np.ndarray
    points: np.ndarray


def equimomental(mass: float, centre: np.ndarray, inertia: np.ndarray | None) -> PointMasses:
    """Six points that have the mass, centre and inertia of a body; one without inertia.

    With principal moments ``I_i`` the second moments are ``P_i = (I_1 + I_2 + I_3)/2 - I_i``; a
    sixth of the mass at ``+-sqrt(3 P_i / m)`` along each principal axis has them.

    Parameters
    ----------
    mass : float
    centre : (3,) array
    inertia : (3, 3) array or None

    Examples
    --------
    >>> found = equimomental(6.0, np.zeros(3), np.diag([4.0, 4.0, 4.0]))
    >>> found.values, found.points[0].tolist()
    (array([1., 1., 1., 1., 1., 1.]), [1.0, 0.0, 0.0])
    """
    if inertia is None:
        return PointMasses(np.array([mass]), centre[None])
    moments, axes = np.linalg.eigh(inertia)
    second = 0.5 * np.sum(moments) - moments
    if np.min(second) < -_FLAT * np.max(np.abs(moments), initial=0.0):
        raise InputError(
            "inertia of a body",
            got=np.asarray(inertia).tolist(),
            expected="moments of which none is more than the other two together [kg m^2]",
        )
    arms = axes.T * np.sqrt(3.0 * np.maximum(second, 0.0) / mass)[:, None]
    return PointMasses(np.full(6, mass / 6.0), np.concatenate([centre + arms, centre - arms]))


def unit_weights(
    masses: Masses, places: Mapping[str, np.ndarray]
) -> dict[str, tuple[DeadForce, ...]]:
    """Masses as the forces of a gravity of 1 m/s^2 against z, by the names of bodies.

    Parameters
    ----------
    masses : mapping of str to float, BodyMass or a sequence of them
    places : mapping of str to (3,) arrays
        Of a mass without a centre, by name [m].

    Raises
    ------
    InputError
        When a mass is not more than zero, or an inertia is that of no body.
    """
    found = {}
    for name, value in masses.items():
        several = isinstance(value, Sequence) and not isinstance(value, str)
        points = [_points(name, one, places) for one in (value if several else (value,))]
        found[name] = tuple(
            DeadForce([0.0, 0.0, -m], at)
            for own in points
            for m, at in zip(own.values, own.points, strict=True)
        )
    return found


def _points(name: str, value: Any, places: Mapping[str, np.ndarray]) -> PointMasses:
    own = value if isinstance(value, BodyMass) else BodyMass(value)
    subject = f"mass of {name!r}"
    expected = "more than zero [kg], or a BodyMass"
    mass = as_float(subject, own.mass, expected, "kg")
    if not (np.isfinite(mass) and mass > 0):
        raise InputError(subject, got=own.mass, expected=expected)
    centre = places.get(name, np.zeros(3))
    if own.centre is not None:
        centre = load_vector("point", name, own.centre)
    if own.inertia is None:
        return equimomental(mass, centre, None)
    expected = "three moments, or a symmetric (3, 3) array [kg m^2]"
    inertia = as_floats(f"inertia of {name!r}", own.inertia, expected, "kg m^2")
    if inertia.shape == (3,):
        inertia = np.diag(inertia)
    size = np.max(np.abs(inertia), initial=0.0)
    if inertia.shape != (3, 3) or np.max(np.abs(inertia - inertia.T)) > 1e-9 * size:
        raise InputError(f"inertia of {name!r}", got=own.inertia, expected=expected)
    return equimomental(mass, centre, 0.5 * (inertia + inertia.T))
