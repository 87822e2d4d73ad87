"""What an instrument would read of a robot with given parameters, and the rates of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.identification.frames import KnownFrames, SeenPoints, UnknownFrames, nearest_frames
from robostiff.identification.measurements import Measurements, Reading
from robostiff.identification.states import MOTIONS, FiniteLoads, PlacesInStates, SmallLoads, States
from robostiff.identification.unknowns import Unknown, UnknownKind
from robostiff.kinematics.turn import rotvec_rate, turn_by_vector
from robostiff.model import Robot
from robostiff.spatial import as_floats, skew

# Of the length of a robot: readings that are further off have other units, or joints in disorder.
_FAR = 0.05


@dataclass(frozen=True, eq=False)
class ReadingModel:
    """All readings of a campaign as functions of the unknowns.

    The unknowns are the parameters (n), where they are unknown the place of the instrument and a
    rotation vector after its first rotation (6), and the places of markers (3 each).
    """

    measured: Measurements
    statics: FiniteLoads | SmallLoads
    parameters: tuple[Unknown, ...]
    instrument: np.ndarray | None  # (6,) where it is known
    markers: np.ndarray | None  # (K, 3) where they are known
    first_rotation: np.ndarray  # (3, 3) from world to instrument axes
    names: tuple[str, ...]  # of the markers

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """All of them, by name."""
        found = list(self.parameters)
        if self.instrument is None:
            names = [f"instrument {turn}{a}" for turn in ("", "turn ") for a in "xyz"]
            units = ("m",) * 3 + ("rad",) * 3
            found += [
                Unknown(n, UnknownKind.FRAME, 0.0, u) for n, u in zip(names, units, strict=True)
            ]
        if self.markers is None:
            found += [
                Unknown(f"{name} {a}", UnknownKind.FRAME, 0.0, "m")
                for name in self.names
                for a in "xyz"
            ]
        return tuple(found)

    @cached_property
    def read(self) -> np.ndarray:
        """Which of the numbers (3 N,) are there."""
        return self.measured.is_read.ravel()

    @cached_property
    def values(self) -> np.ndarray:
        """What was read (M,)."""
        return self.measured.values.ravel()[self.read]

    @cached_property
    def sigma(self) -> np.ndarray:
        """Standard deviations (M,); ones where they are not known."""
        own = self.measured.sigma.ravel()[self.read]
        return own if self.measured.has_sigma else np.ones_like(own)

    @cached_property
    def of_reading(self) -> np.ndarray:
        """Reading of each number (M,)."""
        return np.repeat(np.arange(len(self.measured)), 3)[self.read]

    @cached_property
    def marker_places(self) -> np.ndarray:
        """Marker of each reading (N,), by its number."""
        places = {name: k for k, name in enumerate(self.names)}
        return np.array([places[name] for name in self.measured.markers])

    @cached_property
    def is_motion(self) -> np.ndarray:
        """Which readings (N,) are of displacements."""
        return np.array([kind in MOTIONS for kind in self.measured.kinds])

    def frames(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rotation to instrument axes, its vector after the first, place, and markers (K, 3)."""
        n = len(self.parameters)
        if self.instrument is None:
            b, r = x[n : n + 3], x[n + 3 : n + 6]
            R, n = turn_by_vector(r) @ self.first_rotation, n + 6
        else:
            b, r, R = self.instrument[:3], np.zeros(3), turn_by_vector(self.instrument[3:])
        m = x[n:].reshape(-1, 3) if self.markers is None else self.markers
        return R, r, b, m

    def predicted(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Readings (M,) and their rates (M, n) with the unknowns; of the last x they are kept."""
        if self._last.get("x") != x.tobytes():
            self._last.update(x=x.tobytes(), found=self._predicted(x))
        return self._last["found"]

    @cached_property
    def _last(self) -> dict[str, Any]:
        return {}

    def _predicted(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        measured, states = self.measured, self.statics.states
        n, count = len(self.parameters), len(measured)
        places = self.statics.at(x[:n])
        R, r, b, m = self.frames(x)
        names, marker = self.names, self.marker_places
        arms = m[marker] - self.statics.robot.numeric.reference_point

        def in_world(state: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
            """Markers before and by small displacements; rates with parameters and own places."""
            A = places.axes[state]
            own, t = np.einsum("nij,nj->ni", A, arms), places.twists[state]
            small = t[:, :3] + np.cross(t[:, 3:], own)
            rates = places.rates[state]
            moved = rates[:, :3] - skew(own) @ rates[:, 3:]
            return places.points[state] + own, small, moved, A + skew(t[:, 3:]) @ A

        at, small, by_parameters, by_marker = in_world(states.of_readings)
        is_motion = self.is_motion
        by_place = np.broadcast_to(-np.eye(3), (count, 3, 3)).copy()
        v = at - b + small
        if is_motion.any():
            then, small_then, rates, axes = in_world(states.of_references)
            v[is_motion] = (at - then + (small - small_then))[is_motion]
            by_parameters[is_motion] -= rates[is_motion]
            by_marker = np.where(is_motion[:, None, None], by_marker - axes, by_marker)
            by_place[is_motion] = 0.0
        y = v @ R.T
        parts = [R @ by_parameters]
        if self.instrument is None:
            parts += [R @ by_place, -skew(y) @ rotvec_rate(r)]
        if self.markers is None:
            each = np.zeros((count, 3, len(names), 3))
            each[np.arange(count), :, marker] = R @ by_marker
            parts.append(each.reshape(count, 3, -1))
        J = np.concatenate(parts, axis=2)
        for k in np.flatnonzero([kind.size == 1 for kind in measured.kinds]):
            u, start = measured.toward[k], np.zeros(3)
            if measured.kinds[k] is Reading.DISTANCE:
                u, start = y[k] - u, u
            u = u / np.linalg.norm(u)
            J[k, 0], y[k, 0] = u @ J[k], u @ (y[k] - start)
        return y.ravel()[self.read], J.reshape(3 * count, -1)[self.read]


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
    known = frames if isinstance(frames, KnownFrames) else KnownFrames(None, None)
    instrument = markers = None
    if known.instrument is not None:
        instrument = as_floats(
            "place of the instrument", known.instrument, "six numbers", None, (6,)
        )
    names = measured.marker_names
    if known.markers is not None:
        for name in names:
            if name not in known.markers:
                expected = ", ".join(map(str, known.markers))
                raise InputError("marker", got=name, expected=f"a place for it, beside {expected}")
        rows = [known.markers[name] for name in names]
        markers = as_floats("places of the markers", rows, "three numbers each [m]")
        markers = markers.reshape(len(names), 3)
    if (instrument is None or markers is None) and Reading.POINT not in measured.kinds:
        raise InputError(
            "frames of displacements and distances",
            got="unknown ones",
            expected="known ones: only points tell where instrument and markers are",
            hint='write frames=rs.KnownFrames({"marker": [0, 0, 0.05]})',
        )
    if markers is None:
        for name in names:
            rows = [k for k, own in enumerate(measured.markers) if own == name]
            if len(rows) == 1:
                raise InputError(
                    f"marker {name!r} of {measured.place(rows[0])}",
                    got="one reading",
                    expected="several readings of a marker whose place is not known",
                )
    small = all(kind in MOTIONS for kind in measured.kinds) and all(
        own.kind in (UnknownKind.COMPLIANCE, UnknownKind.FACTOR) for own in parameters
    )
    states = States.of(robot, measured)
    given = tuple(own.name for own in parameters)
    statics = (
        SmallLoads(states, robot, given) if small else FiniteLoads(states, robot, given, gravity)
    )
    p = np.array([own.nominal for own in parameters])
    statics, codes = statics.checked(p)
    _check_states(robot, measured, states, codes)
    places = statics.at(p)
    R, b, m = np.eye(3), instrument, markers
    if instrument is None or markers is None:
        seen = _seen(measured, names, states, places, robot.numeric.reference_point)
        R, b, m = nearest_frames(seen, instrument, markers, len(names))
    model = ReadingModel(measured, statics, parameters, instrument, markers, R, names)
    x = [p]
    if instrument is None:
        x += [b, np.zeros(3)]
    if markers is None:
        x.append(np.array(m, dtype=float).ravel())
    start = np.concatenate(x)
    length = max(float(np.ptp(places.points, axis=0).max()), 1e-3)
    length = max(length, float(np.abs(places.points).max()))
    off = np.abs(model.values - model.predicted(start)[0])
    if Reading.POINT in measured.kinds and float(np.sqrt(np.mean(off**2))) > _FAR * length:
        raise InputError(
            "readings against the nominal robot",
            got=f"{float(np.sqrt(np.mean(off**2))):.3g} m apart, {length:.3g} m from its base",
            expected="readings of this robot at these postures",
            hint="look at the units of readings and joints, and at the order of the joints",
        )
    return model, start


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
    is_point = np.array([kind is Reading.POINT for kind in measured.kinds])
    state = states.of_readings
    origins = places.points[state] - places.axes[state] @ reference
    rows = is_point & measured.is_read.all(axis=1) & np.isfinite(origins).all(axis=1)
    marker = np.array([names.index(name) for name in measured.markers])
    return SeenPoints(measured.values[rows], origins[rows], places.axes[state][rows], marker[rows])
