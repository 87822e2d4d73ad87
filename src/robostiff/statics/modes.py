"""Natural frequencies and mode shapes of a robot, also under load."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis import PartShare
from robostiff.analysis.free_motion import free_motions_in_words
from robostiff.elastostatics import Status
from robostiff.elastostatics.status import StatusOfPoses
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Near, Pose
from robostiff.kinematics.pose import OnePose
from robostiff.linkage import DriveValues, Linkage
from robostiff.markup import InNotebooks
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.spatial import Space
from robostiff.statics.chains.beam_bowing import Beams, Bowing
from robostiff.statics.equations.newton import FoundEquilibrium
from robostiff.statics.equations.problem import EquilibriumProblem, LoadCase
from robostiff.statics.equations.stability import energies_of
from robostiff.statics.equations.vibration import vibrations
from robostiff.statics.loaded_parts import BodyPlaces, body_places, shares
from robostiff.statics.loading.given_loads import Acting, Gravity, Laws, Loads, Masses
from robostiff.statics.loading.loaded_posture import (
    LoadedPosture,
    as_snapshot,
    postures_of,
    wrenches_of,
)
from robostiff.statics.result import solved

# So that beams have modes of their own, the first of them within some percent.
_HALVES = Bowing(elements=2, inner_modes=True)
# Of the platform's motion beside that of the legs: below this it stays.
_STAYS = 1e-6
# Of a motion, rotations times the length of the robot: below this it is called a translation.
_TURNS = 1e-2
# Of a mode, by which bodies are moved to find how they move [rad].
_PART = 1e-3


@dataclass(frozen=True)
class Mode:
    """One natural vibration.

    Attributes
    ----------
    frequency : float
        [Hz]; 0 where nothing resists the motion, or the robot leaves the equilibrium.
    growth : float
        Rate at which the robot leaves an unstable equilibrium [1/s]; 0 of a vibration.
    twist : (r,) array
        Of the platform about its point, world axes, at the amplitude at which the velocity one
        second^-1 has the kinetic energy of half a joule [m, rad].
    """

    frequency: float
    growth: float
    twist: np.ndarray
    equilibrium: FoundEquilibrium = field(repr=False, compare=False)
    shape: np.ndarray = field(repr=False, compare=False)

    @cached_property
    def shares(self) -> tuple[PartShare, ...]:
        """Elastic energy of the parts, largest first."""
        problem = self.equilibrium.problem
        motion = _of_legs(problem, self.shape)[: problem.legs.numbers.total]
        stored = energies_of(problem.legs, motion, np.zeros(problem.legs.inner_modes.shape))
        return tuple(own for own in shares(stored) if own.energy > 0)

    @cached_property
    def words(self) -> str:
        """How the platform moves, or the leg that vibrates while it stays.

        A translation where its rotation times the length of the robot is less than 1 % of it.
        """
        problem, twist = self.equilibrium.problem, self.twist
        if problem.size_of(twist) < _STAYS * problem.size_of_legs(_of_legs(problem, self.shape)):
            most = self.shares[0] if self.shares else None
            return "the platform stays" + (f": most in {most.name!r}" if most else "")
        size = np.linalg.norm(twist * problem.scale)
        turning = np.arange(len(twist)) >= Space.of_size(len(twist)).translations
        if np.linalg.norm((twist * problem.scale)[turning]) < _TURNS * size:
            twist = np.where(turning, 0.0, twist)
        point = self.equilibrium.state.p
        motion = free_motions_in_words(twist[None] / size, point, problem.length)[0]
        return f"the platform moves: {motion}"

    @cached_property
    def motion(self) -> BodyPlaces:
        """By how much all bodies have moved from the equilibrium.

        By so little that none has turned, or moved by the length of the robot, by more than a
        thousandth [rad].
        """
        own, step = self.equilibrium, _of_legs(self.equilibrium.problem, self.shape)
        part = _PART / max(own.problem.size_of_legs(step), own.problem.size_of(self.twist))
        moved = own.problem.moved(own.state, part * self.twist, part * step)
        return body_places(own.problem, moved).since(body_places(own.problem, own.state))

    def __str__(self) -> str:
        rate = f"{self.frequency:.4g} Hz" if self.growth == 0 else f"grows by {self.growth:.4g} /s"
        return f"{rate}: {self.words}"


@dataclass(frozen=True, repr=False)
class Modes(InNotebooks):
    """Natural vibrations of a robot, slowest first.

    Attributes
    ----------
    name : str
    space : Space
    status : Status
        Of the equilibrium about which it vibrates.
    each : tuple of Mode
        As many as motions have mass; empty where there is no equilibrium.
    posed : Snapshot, Network, CableRobot or None
        The robot at the unloaded posture.
    problem : EquilibriumProblem or None
        Whose equilibrium it vibrates about.
    """

    name: str
    space: Space
    status: Status
    each: tuple[Mode, ...] = ()
    posed: Snapshot | Network | CableRobot | None = None
    problem: EquilibriumProblem | None = None

    @property
    def snapshot(self) -> Snapshot | None:
        """The robot at that posture; None of a network."""
        return as_snapshot(self.posed)

    @property
    def frequencies(self) -> np.ndarray:
        """Of all modes (k,) [Hz].

        Raises
        ------
        NoAnswerError
            Where there is no equilibrium.
        """
        if not self.each:
            why = "; ".join(self.status.advice)
            raise NoAnswerError(f"no modes of {self.name!r} ({self.status}): {why}")
        return np.array([mode.frequency for mode in self.each])

    def __len__(self) -> int:
        return len(self.each)

    def __getitem__(self, i: int) -> Mode:
        return self.each[i]

    def __iter__(self) -> Iterator[Mode]:
        return iter(self.each)

    def __repr__(self) -> str:
        first = "; ".join(str(mode) for mode in self.each[:3])
        return f"<{len(self.each)} modes of {self.name!r}, status {self.status}: {first}>"


@dataclass(frozen=True, repr=False)
class ModesOfPoses(StatusOfPoses):
    """Natural vibrations of a robot at a batch of poses, one a row.

    Attributes
    ----------
    each : tuple of Modes
    """

    each: tuple[Modes, ...]

    @property
    def status_codes(self) -> np.ndarray:
        """Status of the equilibrium at each pose (N,) as uint16."""
        return np.array([int(one.status) for one in self.each], dtype=np.uint16)

    @property
    def answered(self) -> np.ndarray:
        """Which poses have modes (N,)."""
        return np.array([len(one) > 0 for one in self.each], dtype=bool)

    @property
    def frequencies(self) -> np.ma.MaskedArray:
        """Of all modes (N, k) [Hz], slowest first; masked where there are none, or fewer."""
        found = np.ma.masked_all((len(self.each), max((len(one) for one in self.each), default=0)))
        for row, one in zip(found, self.each, strict=True):
            row[: len(one)] = [mode.frequency for mode in one]
        return found

    def __len__(self) -> int:
        return len(self.each)

    def __getitem__(self, i: int) -> Modes:
        return self.each[i]

    def __iter__(self) -> Iterator[Modes]:
        return iter(self.each)

    def __repr__(self) -> str:
        answered = int(np.count_nonzero(self.answered))
        return f"<ModesOfPoses of {len(self.each)} poses, {answered} with modes>"


@overload
def modes(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: OnePose = None,
    masses: Masses | None = None,
    *,
    wrench: ArrayLike | None = None,
    at: ArrayLike | None = None,
    loads: Loads | None = None,
    gravity: Gravity = None,
    preload: Mapping[str, Any] | None = None,
    laws: Laws | None = None,
    beams: Beams = _HALVES,
    near: Near = None,
) -> Modes: ...
@overload
def modes(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Pose | DriveValues = None,
    masses: Masses | None = None,
    *,
    wrench: ArrayLike | None = None,
    at: ArrayLike | None = None,
    loads: Loads | None = None,
    gravity: Gravity = None,
    preload: Mapping[str, Any] | None = None,
    laws: Laws | None = None,
    beams: Beams = _HALVES,
    near: Near = None,
) -> Any: ...
def modes(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Pose | DriveValues = None,
    masses: Masses | None = None,
    *,
    wrench: ArrayLike | None = None,
    at: ArrayLike | None = None,
    loads: Loads | None = None,
    gravity: Gravity = None,
    preload: Mapping[str, Any] | None = None,
    laws: Laws | None = None,
    beams: Beams = _HALVES,
    near: Near = None,
) -> Any:
    """Natural frequencies and mode shapes of a robot at a pose, without load or under one.

    Small motions x about the equilibrium obey ``M x'' + K x = 0``, with K the second variation of
    the energy of all elastic parts less the work of the loads, as for `equilibrium`, over the
    motions that keep the robot together. Motions without mass follow in balance. Masses along an
    elastic part have the consistent mass matrix of a beam, with sections that turn and shear.

    Parameters
    ----------
    robot, pose, wrench, at, loads, gravity, preload, laws, near
        As for `equilibrium`; poses along one axis, with one wrench for all or one a pose.
    masses : mapping of str to float, Mass or a sequence of them, optional
        What moves beside the masses of the model, by the name of the part before the body that
        carries it, ``leg/part``, of the node of a network, or ``platform`` [kg]. A mass without a
        centre or point is at that part or node, or at the point of the platform. These have no
        weight: `loads` take those.
    beams : Bowing or Linear
        As for `equilibrium`; each beam is two elements when left out. Frequencies come from above:
        that of a beam within itself is 0.5 % high with one element for each half wave, and a beam
        of one element between two bodies has none.

    Returns
    -------
    Modes or ModesOfPoses
        The latter of a batch.

    Raises
    ------
    InputError
        As for `equilibrium`; when nothing has a mass, or a given one is not more than zero.

    Examples
    --------
    >>> import robostiff as rs
    >>> spindle = {"platform": rs.Mass(150, inertia=[4, 4, 7])}
    >>> found = rs.modes(rs.load("hexapod"), masses=spindle)
    >>> len(found), found.frequencies[:2].round(1)
    (180, array([48.8, 48.8]))
    """
    postures = postures_of(robot, pose, near)
    given = wrenches_of("wrench", wrench, postures.robot.space)
    acting = Acting(loads, gravity, preload, beams, at, laws or {})
    if not postures.batch:
        if given.ndim > 1:
            raise InputError("wrench", got=wrench, expected="one wrench")
        return _modes_of(postures.loaded(0, acting, masses or {}), given)
    if len(postures.batch) > 1 or given.shape[:-1] not in ((), postures.batch):
        raise InputError(
            "batch of modes",
            got=f"poses {postures.batch}, wrenches {given.shape[:-1]}",
            expected="poses along one axis, with one wrench or as many",
        )
    given = np.broadcast_to(given, (*postures.batch, given.shape[-1]))
    loaded = (postures.loaded(i, acting, masses or {}) for i in range(len(given)))
    return ModesOfPoses(tuple(_modes_of(one, F) for one, F in zip(loaded, given, strict=True)))


def _modes_of(loaded: LoadedPosture, wrench: np.ndarray) -> Modes:
    if not loaded.has_posture:
        return Modes(loaded.name, loaded.space, loaded.status)
    problem = loaded.problem
    if problem.loads_platform_alone and not problem.dead.act and not np.any(wrench):
        status, loading = loaded.status, LoadCase(wrench, wrench)
        found = FoundEquilibrium(loading, problem.unloaded, 0.0, problem.at_rest, True, 0)
    else:
        answer = solved(loaded, wrench, None)
        status, found = answer.status, answer.found
    if found is None:
        return Modes(loaded.name, loaded.space, status)
    each = []
    for square, shape in zip(
        *vibrations(problem, loaded.masses, found.known, found.state), strict=True
    ):
        rate, twist = float(np.sqrt(abs(square))), shape[len(shape) - problem.size :]
        frequency, growth = (rate / (2 * np.pi), 0.0) if square >= 0 else (0.0, rate)
        each.append(Mode(frequency, growth, twist, found, shape))
    if not each:
        raise InputError(
            f"masses of {loaded.name!r}",
            expected="masses of bodies, by name [kg]",
            hint='write masses={"platform": 150}, rs.Mass(12, inertia=...) in place of a number; '
            '--mass "platform=150 kg"; or mass: in the model file',
        )
    return Modes(loaded.name, loaded.space, status, tuple(each), loaded.posed, problem)


def _of_legs(problem: EquilibriumProblem, shape: np.ndarray) -> np.ndarray:
    """The part of the legs in a mode, as a step of all their unknowns (T + B,)."""
    step = np.zeros(problem.legs.numbers.total + len(problem.legs.beams))
    step[problem.free] = shape[: -problem.size]
    return step
