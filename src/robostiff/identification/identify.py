"""Parameters of a robot from measurements under load, by weighted least squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError
from robostiff.identification.frames import KnownFrames, UnknownFrames
from robostiff.identification.identified import Identified
from robostiff.identification.measurements import Measurements
from robostiff.identification.search import Robust, Squares, fitted
from robostiff.identification.start import model_of
from robostiff.identification.unknowns import with_unknowns
from robostiff.kinematics import JointCoordinates
from robostiff.model import Robot

_UNKNOWN, _SQUARES = UnknownFrames(), Squares()


def identify(
    robot: Robot,
    measured: Measurements,
    parameters: Sequence[str],
    *,
    fixed: Sequence[str] = (),
    shared: bool = False,
    frames: UnknownFrames | KnownFrames = _UNKNOWN,
    loss: Squares | Robust = _SQUARES,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    gravity: ArrayLike | str | None = None,
) -> Identified:
    """Find compliances, lengths and zeros of a robot from readings under load.

    ``min sum ((y - f(p, b, m)) / sigma)^2`` over the parameters p, the place b of the instrument
    and the places m of markers, f by equilibria under weights and loads with exact rates:
    ``ds/dp = -T^-1 dg/dp`` of an equilibrium g = 0 with the tangent T. What no reading tells is
    found before the search, keeps its value, and is named.

    Parameters
    ----------
    robot : Robot
    measured : Measurements
        Displacements alone, where compliances are asked for, are taken in proportion to loads.
    parameters : sequence of str
        Names, which may have ``*``: ``arm/joint2`` or ``leg*/strut`` (the compliance of a drive or
        spring), ``arm/forearm.factor`` (of the compliance of a link), ``arm/joint3.zero`` (of its
        coordinate), ``arm/joint2.play`` (backlash), or symbols of the model.
    fixed : sequence of str
        Names among them that keep their values.
    shared : bool
        Whether a name with ``*`` is one number for all parts that it fits.
    frames : UnknownFrames or KnownFrames
    loss : Squares or Robust
    bounds : mapping of str to (float, float), optional
        Least and largest values [SI]; compliances are above zero.
    gravity : (3,) array or str, optional
        As for `equilibrium`.

    Returns
    -------
    Identified

    Raises
    ------
    InputError
        When readings do not fit the robot at all.

    References
    ----------
    Dumas, Caro, Garnier, Furet: Joint stiffness identification of six-revolute industrial serial
    robots, Robotics and Computer-Integrated Manufacturing 27, 2011.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot, load = rs.load("hexapod"), [800, -500, -2000, 90, 60, 40]
    >>> t = rs.deflection(robot, wrench=load).twist
    >>> marks = {name: 0.2 * np.eye(3)[k] for k, name in enumerate("abc")}
    >>> moved = [t[:3] + np.cross(t[3:], m) for m in marks.values()]
    >>> read = rs.Measurements([[0, 0, 0.9, 0, 0, 0]] * 3, moved, wrenches=load, sigma=1e-6,
    ...                        markers=["a", "b", "c"], kinds=rs.Reading.DISPLACEMENT)
    >>> found = rs.identify(robot, read, ["leg*/strut"], frames=rs.KnownFrames(marks))
    """
    if not isinstance(robot, Robot):
        raise InputError("robot to identify", got=type(robot).__name__, expected="a Robot")
    if not isinstance(measured, Measurements):
        raise InputError(
            "measurements", got=type(measured).__name__, expected="rs.Measurements(...)"
        )
    by_joints = isinstance(measured.postures, JointCoordinates) or robot.is_posed_by_joints
    changed, unknowns = with_unknowns(robot, parameters, fixed, shared=shared, by_joints=by_joints)
    model, start = model_of(changed, measured, unknowns, frames, gravity)
    names = [own.name for own in model.unknowns]
    low = np.array([own.least for own in model.unknowns])
    high = np.full(len(names), np.inf)
    for name, pair in (bounds or {}).items():
        if name not in names:
            raise InputError("bounds", got=name, expected=f"one of {', '.join(names)}")
        k = names.index(name)
        if not (len(pair) == 2 and pair[0] < pair[1]):
            raise InputError(f"bounds of {name}", got=pair, expected="least < largest")
        low[k], high[k] = max(low[k], pair[0]), pair[1]
    return Identified(*fitted(model, np.clip(start, low, high), (low, high), loss))
