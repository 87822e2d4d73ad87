"""The model of a campaign, and where the search for its unknowns begins."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.identification.frames import (
    KnownFrames,
    SeenPoints,
    UnknownFrames,
    known_frames,
    nearest_frames,
    nearest_turn,
)
from robostiff.identification.measurement_kinds import Reading
from robostiff.identification.measurements import Measurements
from robostiff.identification.readings import ReadingModel
from robostiff.identification.states import MOTIONS, FiniteLoads, PlacesInStates, SmallLoads, States
from robostiff.identification.unknowns import Unknown, UnknownKind
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Robot

# Of the length of a robot: readings that are further off have other units, or joints in disorder.
_FAR = 0.05


def model_of(
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
    given = tuple(own.name for own in parameters)
    p = np.array([own.nominal for own in parameters])
    statics: FiniteLoads | SmallLoads = SmallLoads(states, robot, given)
    if not small:
        of_drives = any(kind.of_drive for kind in measured.kinds)
        statics = FiniteLoads.of(states, robot, parameters, gravity, drives=of_drives)
    try:
        statics, codes = statics.checked(p)
    except InputError as error:
        if error.got not in measured.bodies:
            raise
        place = measured.place(measured.bodies.index(error.got))
        raise InputError(f"hook of {place}", got=error.got, expected=error.expected) from None
    _check_states(robot, measured, states, codes)
    _check_plays(statics)
    places = statics.at(p)
    b, m = instrument, markers
    if instrument is None or markers is None:
        seen = _seen(measured, names, states, places, robot.numeric.reference_point)
        R, b, m = nearest_frames(seen, instrument, markers, len(names))
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


def _seen(
    measured: Measurements,
    names: tuple[str, ...],
    states: States,
    places: PlacesInStates,
    reference: np.ndarray,
) -> SeenPoints:
    """Whole points whose platforms are known."""
    is_point = np.array([kind in (Reading.POINT, Reading.POSE) for kind in measured.kinds])
    state = states.of_readings
    origins = places.points[state] - places.axes[state] @ reference
    rows = is_point & measured.is_read[:, :3].all(axis=1) & np.isfinite(origins).all(axis=1)
    marker = np.array([names.index(n) if n in names else 0 for n in measured.markers])
    return SeenPoints(
        measured.values[rows, :3], origins[rows], places.axes[state][rows], marker[rows]
    )
