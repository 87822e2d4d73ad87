"""What an instrument would read of a robot with given parameters, and the rates of it."""

from __future__ import annotations

from functools import cached_property
from itertools import compress

import numpy as np

from robostiff.errors import InputError
from robostiff.frozen import frozen, replace
from robostiff.identification.measurement_kinds import MOTIONS, Reading
from robostiff.identification.measurements import Measurements
from robostiff.identification.states import FiniteLoads, PlacesInStates, SmallLoads, States
from robostiff.identification.unknowns import Unknown, UnknownKind
from robostiff.kept import kept_for_last
from robostiff.kinematics.turn import rotvec_rate, turn_by_vector
from robostiff.spatial import skew
from robostiff.spatial.rotation import vector_of_rotation


@frozen(eq=False)
class ReadingModel:
    """All readings of a campaign as functions of the unknowns.

    They are functions of the parameters (n), and of frames: the place of the instrument and a
    rotation vector after its first rotation (6), the places of the K markers (3 each), and rotation
    vectors of these after their first rotations (3 each). Of the frames some are unknown.
    """

    measured: Measurements
    statics: FiniteLoads | SmallLoads
    parameters: tuple[Unknown, ...]
    names: tuple[str, ...]  # of the markers
    first_frames: np.ndarray  # (6 + 6 K,), zeros for all rotation vectors
    sought: np.ndarray  # (6 + 6 K,) of bool: which of them are unknown
    first_rotation: np.ndarray  # (3, 3) from world to instrument axes
    first_turns: np.ndarray  # (K, 3, 3) from axes of the markers to those of the platform
    by_loads: np.ndarray | None = None  # (M,) standard deviations of readings by those of loads

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """All of them, by name."""
        of = "the instrument"
        frames = [  # names, what has these coordinates, and their units
            *[("instrument", ("place", of), "m"), ("instrument turn", ("turn", of), "rad")],
            *((name, ("place", name), "m") for name in self.names),
            *((f"{name} turn", ("turn", name), "rad") for name in self.names),
        ]
        coordinates = (
            Unknown(f"{name} {a}", UnknownKind.FRAME, 0.0, unit, frame=frame)
            for name, frame, unit in frames
            for a in "xyz"
        )
        return (*self.parameters, *compress(coordinates, self.sought))

    def of(self, measured: Measurements, x: np.ndarray) -> ReadingModel:
        """Other readings of the same markers, by the kernel that is compiled already, near x."""
        for name in measured.marker_names:
            if name not in self.names:
                raise InputError("marker", got=name, expected=f"one of {', '.join(self.names)}")
        states = States.of(self.statics.robot, measured, self.frames(x)[0])
        statics = self.statics.of_readings(measured, states)
        statics, _ = statics.verify(x[: len(self.parameters)])
        return replace(self, measured=measured, statics=statics).with_errors_of_loads(x)

    def with_errors_of_loads(self, x: np.ndarray) -> ReadingModel:
        """The same with what uncertain loads do to readings near x, ``|dy/dF| sigma_F``.

        By differences over a standard deviation to both sides; loads of references stay.
        """
        measured, errors = self.measured, np.zeros(len(self.values))
        rows = self.statics.robot.space.rows
        for k in (k for k in rows if measured.sigma_wrench[:, k].any()):
            sides = []
            for sign in (1.0, -1.0):
                moved = measured.with_loads_moved(k, sign)
                states = States.of(self.statics.robot, moved, self.frames(x)[0])
                statics = self.statics.with_states(states)
                model = replace(self, measured=moved, statics=statics)
                sides.append(model.prediction(x)[0][: len(errors)])
            errors = np.hypot(errors, np.nan_to_num(0.5 * (sides[0] - sides[1])))
        return replace(self, by_loads=errors if measured.sigma_wrench.any() else None)

    @cached_property
    def read(self) -> np.ndarray:
        """Which of the numbers (width N,) are there."""
        return self.measured.is_read.ravel()

    @cached_property
    def values(self) -> np.ndarray:
        """What was read (M,)."""
        return self.measured.values.ravel()[self.read]

    @cached_property
    def sigma(self) -> np.ndarray:
        """Standard deviations (M,), those by loads among them; ones where they are not known."""
        if not self.measured.has_sigma:
            return np.ones(np.count_nonzero(self.read))
        sigma = self.measured.sigma.ravel()[self.read]
        return sigma if self.by_loads is None else np.hypot(sigma, self.by_loads)

    @cached_property
    def marker_places(self) -> np.ndarray:
        """Marker of each reading (N,), by its number; 0 of one of a drive."""
        places = {name: k for k, name in enumerate(self.names)}
        return np.array([places.get(name, 0) for name in self.measured.markers])

    @cached_property
    def drive_places(self) -> np.ndarray:
        """Drive of each reading (N,) among those of the kernel; 0 of one of a marker.

        Raises InputError for a name that is none, or of a rigid drive.
        """
        places = np.zeros(len(self.measured), dtype=int)
        if isinstance(self.statics, FiniteLoads):
            robot, known = self.statics.robot, self.statics.compiled.drives
            prefix = f"{robot.legs[0].name}/" if robot.is_serial else ""
            for k in np.flatnonzero(self.measured.of_drives):
                name = self.measured.drives[k]
                drive = name if name in known else prefix + name
                if drive not in known:
                    expected = f"an elastic drive: {', '.join(known)}"
                    subject = f"drive of {self.measured.place(int(k))}"
                    raise InputError(subject, got=name, expected=expected)
                places[k] = known.index(drive)
        return places

    def frames(
        self, x: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rotation to instrument axes, its vector after the first, place, and markers (K, 3).

        And the rotation vectors of the markers after their first rotations (K, 3).
        """
        frames = self.first_frames.copy()
        frames[self.sought] = x[len(self.parameters) :]
        (b, r), (m, turns) = frames[:6].reshape(2, 3), frames[6:].reshape(2, len(self.names), 3)
        return turn_by_vector(r) @ self.first_rotation, r, b, m, turns

    @cached_property
    def _columns(self) -> np.ndarray:
        """Of rates with parameters and all frames: those with unknowns."""
        n = len(self.parameters)
        return np.concatenate([np.arange(n), n + np.flatnonzero(self.sought)])

    def prediction(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Readings (M,) and their rates (M, n) with the unknowns; of the last x they are kept."""
        return kept_for_last(ReadingModel._prediction, self, x)

    def _prediction(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        measured, states = self.measured, self.statics.states
        n, count = len(self.parameters), len(measured)
        places = self.statics.at(x[:n])
        R, r, b, m, _ = self.frames(x)
        names, marker = self.names, self.marker_places
        width = measured.values.shape[1]
        places_of_markers = m if names else np.zeros((1, 3))
        arms = places_of_markers[marker] - self.statics.robot.numeric.reference_point

        def in_world(state: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
            """Markers before and by small displacements; rates with parameters and own places."""
            A = places.axes[state]
            moved_arms, t = np.einsum("nij,nj->ni", A, arms), places.twists[state]
            small = t[:, :3] + np.cross(t[:, 3:], moved_arms)
            rates = places.rates[state]
            moved = rates[:, :3] - skew(moved_arms) @ rates[:, 3:]
            return places.points[state] + moved_arms, small, moved, A + skew(t[:, 3:]) @ A

        at, small, by_parameters, by_marker = in_world(states.of_readings)
        is_motion = measured.are(*MOTIONS)
        by_place = np.broadcast_to(-np.eye(3), (count, 3, 3)).copy()
        v = at - b + small
        if is_motion.any():
            then, small_then, rates, axes = in_world(states.of_references)
            v[is_motion] = (at - then + (small - small_then))[is_motion]
            by_parameters[is_motion] -= rates[is_motion]
            by_marker = np.where(is_motion[:, None, None], by_marker - axes, by_marker)
            by_place[is_motion] = 0.0
        y = v @ R.T
        J = np.zeros((count, width, n + len(self.sought)))
        parts = R @ by_parameters, R @ by_place, -skew(y) @ rotvec_rate(r)
        J[:, :3, : n + 6] = np.concatenate(parts, axis=2)
        if names:
            own = J[:, :3, n + 6 : n + 6 + m.size].reshape(count, 3, -1, 3)
            own[np.arange(count), :, marker] = R @ by_marker
            J[:, :3, n + 6 : n + 6 + m.size] = own.reshape(count, 3, -1)
        J = J[:, :, self._columns]
        y = np.concatenate([y, np.zeros((count, width - 3))], axis=1)
        if (posed := measured.are(Reading.POSE)).any():
            y[posed, 3:], J[posed, 3:] = self._turns(posed, places, x)
        if (driven := measured.of_drives).any():
            J[driven, 0] = 0.0
            y[driven, 0], J[driven, 0, :n] = self._of_drives(driven, places, x)
        along = measured.are(Reading.ALONG, Reading.DISTANCE)
        is_far = measured.are(Reading.DISTANCE)[along, None]
        u, v = measured.toward[along], y[along, :3]
        u, v = np.where(is_far, v - u, u), np.where(is_far, v - u, v)
        u = u / np.linalg.norm(u, axis=1, keepdims=True)
        y[along, 0], J[along, 0] = np.sum(u * v, axis=1), np.einsum("ni,nij->nj", u, J[along, :3])
        return y.ravel()[self.read], J.reshape(width * count, -1)[self.read]

    def _turns(
        self, posed: np.ndarray, places: PlacesInStates, x: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Rotation vectors (P, 3) of markers in instrument axes, and rates (P, 3, unknowns).

        Of the readings `posed` (N,), what was read less ``e = log(R_read R^T)``, so that turns by
        more than half of one do no harm; with R turned by w, ``de = -J_r(e)^-1 w`` and
        ``J_r(e) = J_l(-e)``.
        """
        (R, r, _, _, turns), state = self.frames(x), self.statics.states.of_readings[posed]
        marker, A, n = self.marker_places[posed], R @ places.axes[state], len(self.parameters)
        M = (turn_by_vector(turns) @ self.first_turns)[marker]
        read = self.measured.values[posed, 3:]
        e = vector_of_rotation(turn_by_vector(read) @ np.swapaxes(A @ M, 1, 2))
        w = np.zeros((len(e), 3, n + len(self.sought)))
        w[:, :, :n], w[:, :, n + 3 : n + 6] = R @ places.rates[state, 3:], rotvec_rate(r)
        for axis, own in enumerate(np.moveaxis(A @ rotvec_rate(turns)[marker], 2, 0)):
            w[np.arange(len(e)), :, n + 6 + 3 * (len(self.names) + marker) + axis] = own
        return read - e, np.linalg.solve(rotvec_rate(-e), w[:, :, self._columns])

    def _of_drives(
        self, driven: np.ndarray, places: PlacesInStates, x: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """What is read (D,) at drives by the readings `driven` (N,); rates with parameters."""
        statics, torque = self.statics, self.measured.are(Reading.TORQUE)[driven]
        assert isinstance(statics, FiniteLoads)  # noqa: S101 - what is read at drives needs them
        state, place = statics.states.of_readings[driven], self.drive_places[driven]
        deflected = statics.commanded[state, place] + places.drives[state, 0, place]
        y = np.where(torque, -places.drives[state, 1, place], deflected)
        rates = places.drive_rates[state, 1 * torque, place] * np.where(torque, -1.0, 1.0)[:, None]
        for name, joint in statics.plays.items():
            i, own = statics.names.index(name), place == statics.compiled.drives.index(joint)
            factor = np.where(own & ~torque, statics.factors[state, i], 0.0)
            y, rates[:, i] = y + x[i] * factor, rates[:, i] + factor
        return y, rates
