"""Parameters of a robot from measurements under load, with frames of instrument and markers."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import Status
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.identification.identified import Identified
from robostiff.identification.measurement_kinds import PLACES, Reading
from robostiff.identification.measurements import Measurements
from robostiff.identification.readings import ReadingModel
from robostiff.identification.search import Robust, Squares, fit
from robostiff.identification.states import FiniteLoads, PlacesInStates, SmallLoads, States
from robostiff.identification.unknowns import ELASTIC, Unknown, with_unknowns
from robostiff.kinematics import JointCoordinates
from robostiff.kinematics.turn import turn_by_vector
from robostiff.markup import number
from robostiff.model import Robot, gravity_vector
from robostiff.spatial import as_floats, refuse_quantities

_ROUNDS = 20


@frozen
class UnknownFrames:
    """Neither the place of the instrument nor those of the markers are known."""


@frozen(eq=False)
class KnownFrames:
    """Places that are known; None where they are to be found, too.

    Attributes
    ----------
    markers : mapping of str to (3,) array, or None
        In the platform frame [m].
    instrument : (6,) array or None
        Its place in the world [m], and the rotation vector that takes components in world axes to
        those in instrument axes [rad], the opposite of that of a pose.
    turns : mapping of str to (3,) array, or None
        Of markers whose poses are read: rotation vectors from their axes to those of the platform.
    """

    markers: Mapping[str, ArrayLike] | None = None
    instrument: ArrayLike | None = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    turns: Mapping[str, ArrayLike] | None = None


def known_frames(
    measured: Measurements, frames: UnknownFrames | KnownFrames
) -> tuple[np.ndarray | None, np.ndarray | None, np.ndarray, tuple[int, ...]]:
    """Place of the instrument (6,), markers (K, 3), their turns (K, 3, 3), and unknown turns.

    None is what is to be found. Readings of drives alone need no frames. Raises InputError when a
    marker has no place, or readings do not tell where it is.
    """
    known = frames if isinstance(frames, KnownFrames) else KnownFrames(None, None)
    if measured.of_drives.all():
        known = KnownFrames({})
    names, instrument, markers = measured.marker_names, None, None
    if known.instrument is not None:
        instrument = as_floats("place of the instrument", known.instrument, "six", None, (6,))
    if known.markers is not None:
        for name in names:
            if name not in known.markers:
                expected = f"its place, beside that of {', '.join(map(str, known.markers))}"
                raise InputError("place of a marker", got=name, expected=expected)
        rows = [known.markers[name] for name in names] or np.zeros((0, 3))
        markers = as_floats("places of the markers", rows, "three numbers each [m]")
        markers = markers.reshape(len(names), 3)
    if (instrument is None or markers is None) and not measured.are(*PLACES).any():
        raise InputError(
            "frames of displacements and distances",
            got=Words("unknown ones"),
            expected="known ones: only points tell where instrument and markers are",
            hint=f'write frames=rs.KnownFrames({{"{names[0]}": [0, 0, 0.05]}}); on the '
            f'command line --marker "{names[0]}=0 0 50 mm" --instrument "0 0 0 0 0 0"',
        )
    for name in names if markers is None else ():
        if measured.markers.count(name) == 1:
            raise InputError(
                f"marker {name!r} of {measured.place(measured.markers.index(name))}",
                got=Words("one reading"),
                expected="several readings of a marker whose place is not known",
            )
    turned: tuple[int, ...] = ()
    if known.turns is None:
        posed = {*compress(measured.markers, measured.are(Reading.POSE))}
        turned = tuple(k for k, name in enumerate(names) if name in posed)
    vectors_of = known.turns or {}
    vectors = [
        as_floats(f"turn of {name!r}", vectors_of.get(name, np.zeros(3)), "[rad]", "rad", (3,))
        for name in names
    ]
    return instrument, markers, turn_by_vector(np.reshape(vectors, (-1, 3))), turned


def nearest_frames(
    y: np.ndarray,
    P: np.ndarray,
    A: np.ndarray,
    which: np.ndarray,
    instrument: np.ndarray | None,
    markers: np.ndarray | None,
    count: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rotation to instrument axes, its place and the markers (count, 3), found where None.

    By whole points y (N, 3) of markers `which` (N,), instrument axes, and the origins P (N, 3) and
    axes A (N, 3, 3) in the world of the platforms that carry them, as far as they are known. With
    ``Q = R^T`` as nine numbers ``Q y + b - A m = P`` is linear; Q is made a rotation, and what is
    unknown beside it follows again and again. Another start has all markers at the origin of the
    platform; the better one counts.

    Raises InputError when there are less than three points.

    References
    ----------
    Kabsch: A solution for the best rotation to relate two sets of vectors, Acta Crystallographica
    A 32, 1976.
    """
    if len(y) < 3:
        raise InputError(
            "points of markers", got=Words(f"{len(y)} whole ones"), expected="three or more"
        )
    b = np.zeros(3) if instrument is None else instrument[:3]
    m = np.zeros((count, 3)) if markers is None else markers

    def in_world(m: np.ndarray) -> np.ndarray:
        return P + np.einsum("nij,nj->ni", A, m[which])

    def fitted_frames(Q: np.ndarray, b: np.ndarray, m: np.ndarray) -> tuple[float, Any, Any, Any]:
        for _ in range(_ROUNDS):
            if markers is None:
                local = np.einsum("nji,nj->ni", A, y @ Q.T + b - P)
                sums = [np.bincount(which, local[:, i], count) for i in range(3)]
                m = np.array(sums).T / np.maximum(np.bincount(which, minlength=count), 1)[:, None]
            if instrument is None:
                Q, b = _absolute_orientation(y, in_world(m))
        return float(np.sum((y @ Q.T + b - in_world(m)) ** 2)), Q, b, m

    if instrument is not None:
        _, Q, b, m = fitted_frames(turn_by_vector(instrument[3:]).T, b, m)
        return Q.T, b, m
    starts = [fitted_frames(*_absolute_orientation(y, P), m)]
    M = np.zeros((len(y), 3, 12 + 3 * count * (markers is None)))
    for i in range(3):
        M[:, i, 3 * i : 3 * i + 3], M[:, i, 9 + i] = y, 1.0
        if markers is None:
            M[np.arange(len(y))[:, None], i, 12 + 3 * which[:, None] + np.arange(3)] = -A[:, i]
    solution = np.linalg.lstsq(M.reshape(-1, M.shape[2]), in_world(m).ravel(), rcond=1e-9)[0]
    U, _, Vt = np.linalg.svd(solution[:9].reshape(3, 3))
    Q = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt  # the nearest rotation
    m = solution[12:].reshape(-1, 3) if markers is None else m
    starts.append(fitted_frames(Q, np.mean(in_world(m) - y @ Q.T, axis=0), m))
    _, Q, b, m = min(starts, key=lambda start: start[0])
    return Q.T, b, m


def _absolute_orientation(y: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation Q and shift b by which ``Q y + b`` is nearest to w, both (N, 3) (Kabsch)."""
    from scipy.spatial.transform import Rotation

    y0, w0 = y.mean(axis=0), w.mean(axis=0)
    with warnings.catch_warnings():  # points on one line leave a turn open, which others decide
        warnings.simplefilter("ignore")
        Q = Rotation.align_vectors(w - w0, y - y0)[0].as_matrix()
    return Q, w0 - Q @ y0


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
        is_path = isinstance(measured, str | os.PathLike)
        got = Words("the name of a file") if is_path else type(measured).__name__
        hint = f"write rs.Measurements.read({os.fspath(measured)!r}, robot)" if is_path else None
        raise InputError("measurements", got=got, expected="rs.Measurements(...)", hint=hint)
    by_joints = isinstance(measured.postures, JointCoordinates) or robot.is_posed_by_joints
    asked = tuple(parameters), tuple(fixed)
    changed, unknowns = with_unknowns(robot, *asked, shared=shared, by_joints=by_joints)
    model, start = _model_of(changed, measured, unknowns, frames, gravity)
    names = [unknown.name for unknown in model.unknowns]
    low = np.array([unknown.least for unknown in model.unknowns])
    high = np.full(len(names), np.inf)
    for name, pair in (bounds or {}).items():
        if name not in names:
            raise InputError("bounds", got=name, expected=f"one of {', '.join(names)}")
        k = names.index(name)
        refuse_quantities(f"bounds of {name}", pair, "least < largest")
        if not (len(pair) == 2 and pair[0] < pair[1]):
            raise InputError(f"bounds of {name}", got=pair, expected="least < largest")
        low[k], high[k] = max(low[k], pair[0]), pair[1]
    return Identified(*fit(model, np.clip(start, low, high), (low, high), loss))


def _model_of(
    robot: Robot,
    measured: Measurements,
    parameters: tuple[Unknown, ...],
    frames: UnknownFrames | KnownFrames,
    gravity: ArrayLike | str | None = None,
) -> tuple[ReadingModel, np.ndarray]:
    """The model of a campaign, and where the search begins (n,).

    Displacements alone, with lengths known, are taken in proportion to loads. Raises InputError
    when frames, postures or readings do not fit the robot.
    """
    if gravity is not None:
        gravity = gravity_vector("gravity", gravity)  # small loads take none
    names = measured.marker_names
    instrument, markers, turns, turned = known_frames(measured, frames)
    R = np.eye(3) if instrument is None else turn_by_vector(instrument[3:])
    states = States.of(robot, measured, R)
    p = np.array([unknown.nominal for unknown in parameters])
    statics: FiniteLoads | SmallLoads = FiniteLoads(states, robot, parameters, gravity)
    if all(u.kind in ELASTIC for u in parameters) and not robot.springs:
        statics = SmallLoads(states, statics)
    statics = statics.of_readings(measured, states)
    try:
        statics, codes = statics.verify(p)
    except InputError as error:
        if not (isinstance(error.got, str) and error.got in measured.bodies):
            raise
        place = measured.place(measured.bodies.index(error.got))
        raise InputError(f"hook of {place}", got=error.got, expected=error.expected) from None
    bad = Status.UNREACHABLE | Status.BEYOND_LIMITS | Status.NO_EQUILIBRIUM
    for state in np.flatnonzero(codes & int(bad)):
        k = int(np.argmax(states.of_readings == state))
        raise InputError(
            f"posture of {measured.place(k)}",
            got=str(Status(int(codes[state])) & bad),
            expected=f"a posture that {robot.name!r} reaches, within its limits, and holds",
            hint="remove the line, or look at units and order of the joints",
        )
    if isinstance(statics, FiniteLoads):
        for name in statics.plays:
            signs = statics.factors[:, statics.names.index(name)]
            if not (signs.min() < 0 < signs.max()):
                got = Words("torques of one sign: play and zero are the same")
                expected = "readings with torques of both signs at this joint"
                raise InputError(f"loads for {name}", got=got, expected=expected)
    places = statics.at(p)
    if instrument is not None and markers is not None:
        b, m = instrument[:3], markers
    else:
        state = states.of_readings
        origins = places.points[state] - places.axes[state] @ robot.numeric.reference_point
        rows = np.isfinite(origins).all(axis=1) & measured.is_read[:, :3].all(axis=1)
        rows &= measured.are(*PLACES)
        which = np.array([names.index(n) if n in names else 0 for n in measured.markers])[rows]
        points = measured.values[rows, :3], origins[rows], places.axes[state][rows], which
        R, b, m = nearest_frames(*points, instrument, markers, len(names))
    for k in turned:
        from scipy.spatial.transform import Rotation

        rows = measured.are(Reading.POSE) & (np.array(measured.markers) == names[k])
        back = np.swapaxes(R @ places.axes[states.of_readings[rows]], 1, 2)
        each = Rotation.from_matrix(back @ turn_by_vector(measured.values[rows, 3:]))
        turns[k] = each.mean().as_matrix()
    of = [instrument is None] * 2 + [markers is None] * len(names)
    sought = np.repeat([*of, *(k in turned for k in range(len(names)))], 3)
    first = np.concatenate([b, np.zeros(3), np.ravel(m), np.zeros(3 * len(names))])
    model = ReadingModel(measured, statics, parameters, names, first, sought, R, turns)
    start = np.concatenate([p, first[sought]])
    _check_points(model, start, places)
    return model.with_errors_of_loads(start), start


def _check_points(model: ReadingModel, start: np.ndarray, places: PlacesInStates) -> None:
    """Raise where points are far from those of the nominal robot with unknowns `start` (n,)."""
    measured = model.measured
    rows = measured.are(*PLACES)[:, None]
    rows = (rows & (np.arange(measured.values.shape[1]) < 3)).ravel()[model.read]
    size = max(float(np.ptp(places.points, axis=0).max()), 1e-3, float(np.abs(places.points).max()))
    off = (model.values - model.prediction(start)[0])[rows]
    apart = float(np.sqrt(np.mean(off**2))) if off.size else 0.0
    if apart > _FAR * size:
        what = "readings against the nominal robot"
        expected = "readings of this robot at these postures"
        got = Words(f"{number(apart, 3)} m apart, {number(size, 3)} m from its base")
        hint = "look at the units of readings and joints, and at the order of the joints"
        raise InputError(what, got=got, expected=expected, hint=hint)
