"""Parameters of a robot from measurements under load, by weighted least squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.identification.frames import (
    KnownFrames,
    UnknownFrames,
    known_frames,
    nearest_frames,
    nearest_turn,
)
from robostiff.identification.identified import Identified
from robostiff.identification.measurement_kinds import Reading
from robostiff.identification.measurements import Measurements
from robostiff.identification.readings import ReadingModel
from robostiff.identification.search import Robust, Squares, fitted
from robostiff.identification.states import MOTIONS, FiniteLoads, PlacesInStates, SmallLoads, States
from robostiff.identification.unknowns import Unknown, UnknownKind, with_unknowns
from robostiff.kinematics import JointCoordinates
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Robot

_UNKNOWN, _SQUARES = UnknownFrames(), Squares()
# Of the length of a robot: readings that are further off have other units, or joints in disorder.
_FAR = 0.05


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
    model, start = _model_of(changed, measured, unknowns, frames, gravity)
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


def _model_of(
    robot: Robot,
    measured: Measurements,
    parameters: tuple[Unknown, ...],
    frames: UnknownFrames | KnownFrames,
    gravity: ArrayLike | str | None = None,
) -> tuple[ReadingModel, np.ndarray]:
    """The model of a campaign, and where the search begins (n,).

    Displacements alone, with lengths known, are taken in proportion to loads.

    Raises
    ------
    InputError
        When frames, postures or readings do not fit the robot.
    """
    names = measured.marker_names
    instrument, markers, turns, turned = known_frames(measured, frames)
    R = np.eye(3) if instrument is None else turn_by_vector(instrument[3:])
    states = States.of(robot, measured, R)
    small = all(kind in MOTIONS for kind in measured.kinds) and not states.sites
    small &= all(own.kind in (UnknownKind.COMPLIANCE, UnknownKind.FACTOR) for own in parameters)
    p = np.array([own.nominal for own in parameters])
    statics: FiniteLoads | SmallLoads = SmallLoads(states, robot, tuple(x.name for x in parameters))
    if not small:
        of_drives = any(kind.of_drive for kind in measured.kinds)
        statics = FiniteLoads(states, robot, parameters, gravity, of_drives)
    try:
        statics, codes = statics.checked(p)
    except InputError as error:
        if not (isinstance(error.got, str) and error.got in measured.bodies):
            raise
        place = measured.place(measured.bodies.index(error.got))
        raise InputError(f"hook of {place}", got=error.got, expected=error.expected) from None
    _check_states(robot, measured, states, codes)
    _check_plays(statics)
    places = statics.at(p)
    b, m = instrument, markers
    if instrument is None or markers is None:
        state = states.of_readings
        origins = places.points[state] - places.axes[state] @ robot.numeric.reference_point
        rows = np.isfinite(origins).all(axis=1) & measured.is_read[:, :3].all(axis=1)
        rows &= [kind in (Reading.POINT, Reading.POSE) for kind in measured.kinds]
        which = np.array([names.index(n) if n in names else 0 for n in measured.markers])[rows]
        seen = measured.values[rows, :3], origins[rows], places.axes[state][rows], which
        R, b, m = nearest_frames(*seen, instrument, markers, len(names))
    for k in turned:
        rows = [i for i, own in enumerate(measured.markers)
                if own == names[k] and measured.kinds[i] is Reading.POSE]  # fmt: skip
        read = turn_by_vector(measured.values[rows, 3:])
        back = np.swapaxes(R @ places.axes[states.of_readings[rows]], 1, 2)
        turns[k] = nearest_turn((back @ read).mean(axis=0))
    model = ReadingModel(
        measured, statics, parameters, instrument, markers, R, names, turns, turned
    )
    x = [p]
    if instrument is None:
        x += [b, np.zeros(3)]
    if markers is None:
        x.append(np.array(m, dtype=float).ravel())
    start = np.concatenate([*x, np.zeros(3 * len(turned))])
    _check_points(model, start, places)
    return model.with_errors_of_loads(start), start


def _check_points(model: ReadingModel, start: np.ndarray, places: PlacesInStates) -> None:
    """Raise where points are far from those of the nominal robot."""
    measured = model.measured
    rows = np.array([kind in (Reading.POINT, Reading.POSE) for kind in measured.kinds])[:, None]
    rows = (rows & (np.arange(measured.values.shape[1]) < 3)).ravel()[model.read]
    size = max(float(np.ptp(places.points, axis=0).max()), 1e-3, float(np.abs(places.points).max()))
    off = (model.values - model.predicted(start)[0])[rows]
    apart = float(np.sqrt(np.mean(off**2))) if off.size else 0.0
    if apart > _FAR * size:
        raise InputError(
            "readings against the nominal robot",
            got=f"{apart:.3g} m apart, {size:.3g} m from its base",
            expected="readings of this robot at these postures",
            hint="look at the units of readings and joints, and at the order of the joints",
        )


def _check_plays(statics: FiniteLoads | SmallLoads) -> None:
    """Raise for a joint with play that is strained in one direction alone."""
    if isinstance(statics, FiniteLoads):
        for name in statics.plays:
            signs = statics.factors[:, statics.names.index(name)]
            if not (signs.min() < 0 < signs.max()):
                raise InputError(
                    f"loads for {name}",
                    got="torques of one sign: play and zero are the same",
                    expected="readings with torques of both signs at this joint",
                )


def _check_states(robot: Robot, measured: Measurements, states: States, codes: np.ndarray) -> None:
    """Raise for the first reading whose posture has no answer."""
    bad = Status.UNREACHABLE | Status.BEYOND_LIMITS | Status.NO_EQUILIBRIUM
    for state in np.flatnonzero(codes & int(bad)):
        k = int(np.argmax(states.of_readings == state))
        raise InputError(
            f"posture of {measured.place(k)}",
            got=str(Status(int(codes[state])) & bad),
            expected=f"a posture that {robot.name!r} reaches, within its limits, and holds",
            hint="remove the line, or look at units and order of the joints",
        )
