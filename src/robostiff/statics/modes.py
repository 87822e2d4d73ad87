"""Natural frequencies and mode shapes of a robot, also under load."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis import PartShare
from robostiff.analysis.free_motion import free_motions_in_words
from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Near, Pose
from robostiff.linkage import DriveValues, Linkage
from robostiff.markup import InNotebooks
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.spatial import Space
from robostiff.statics.chains.beam_bowing import Beams, Bowing
from robostiff.statics.equations.problem import EquilibriumProblem, Linearised, LoadCase, State
from robostiff.statics.equations.vibration import CarriedMasses, SmallMotions
from robostiff.statics.equilibrium import solved
from robostiff.statics.loaded_parts import BodyPlaces, body_places, shares
from robostiff.statics.loading.given_loads import Acting, Gravity, Laws, Loads, Masses
from robostiff.statics.loading.loaded_posture import (
    LoadedPosture,
    as_snapshot,
    one_wrench,
    postures_of,
)

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
    shares : tuple of PartShare
        Elastic energy of the parts, largest first.
    words : str
        How the platform moves, a translation where its rotation times the length of the robot is
        less than 1 % of it; or the leg that vibrates while it stays.
    motion : BodyPlaces
        By how much all bodies have moved from the equilibrium, so that none has turned, or moved by
        the length of the robot, by more than a thousandth [rad].
    """

    frequency: float
    growth: float
    twist: np.ndarray
    shares: tuple[PartShare, ...]
    words: str
    motion: BodyPlaces = field(repr=False, compare=False)

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
) -> Modes:
    """Natural frequencies and mode shapes of a robot at a pose, without load or under one.

    Small motions x about the equilibrium obey ``M x'' + K x = 0``, with K the second variation of
    the energy of all elastic parts less the work of the loads, as for `equilibrium`, over the
    motions that keep the robot together. Motions without mass follow in balance. Masses along an
    elastic part have the consistent mass matrix of a beam, with sections that turn and shear.

    Parameters
    ----------
    robot, pose, wrench, at, loads, gravity, preload, laws, near
        As for `equilibrium`.
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
    Modes

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
    given = one_wrench(postures, wrench)
    acting = Acting(loads, gravity, preload, beams, at, laws or {})
    loaded = postures.loaded(0, acting, {} if masses is None else masses)
    if not loaded.has_posture:
        return Modes(loaded.name, loaded.space, loaded.status)
    problem, known, state, status = _about(loaded, given)
    if known is None or state is None:
        return Modes(loaded.name, loaded.space, status)
    each = _vibrating(problem, loaded.masses, known, state)
    if not each:
        raise InputError(
            f"masses of {robot.name!r}",
            expected="what moves, by name [kg]",
            hint='write masses={"platform": 150}, rs.Mass(12, inertia=...) in place of a number; '
            '--mass "platform=150 kg"; or mass: in the model file',
        )
    return Modes(loaded.name, loaded.space, status, each, loaded.posed, problem)


def _about(
    loaded: LoadedPosture, wrench: np.ndarray
) -> tuple[EquilibriumProblem, Linearised | None, State | None, Status]:
    """The equilibrium about which a robot vibrates; a direction may be rigid without load."""
    problem = loaded.problem
    if problem.loads_platform_alone and not len(problem.dead.forces) and not np.any(wrench):
        nothing, state = np.zeros(problem.size), problem.unloaded
        known = problem.linearised(state, LoadCase(nothing, nothing), 0.0)
        return problem, known, state, loaded.status
    answer = solved(loaded, wrench, None)
    if answer.found is None:
        return problem, None, None, answer.status
    return problem, answer.found.known, answer.found.state, answer.status


def _vibrating(
    problem: EquilibriumProblem, masses: CarriedMasses, known: Linearised, state: State
) -> tuple[Mode, ...]:
    squares, shapes = SmallMotions.of(problem, masses, known, state).vibrations()
    each, rest = [], body_places(problem, state)
    for square, shape in zip(squares, shapes, strict=True):
        rate = np.sqrt(abs(square))
        twist = shape[len(shape) - problem.size :]
        motion = _of_legs(problem, shape)[: problem.legs.numbers.total]
        stored = problem.legs.energies_of(motion, np.zeros(problem.legs.inner_modes.shape))
        parts = tuple(own for own in shares(stored) if own.energy > 0)
        each.append(
            Mode(
                float(rate) / (2 * np.pi) if square >= 0 else 0.0,
                float(rate) if square < 0 else 0.0,
                twist,
                parts,
                _words(problem, state, shape, twist, parts),
                _moved(problem, state, shape).since(rest),
            )
        )
    return tuple(each)


def _moved(problem: EquilibriumProblem, state: State, shape: np.ndarray) -> BodyPlaces:
    """Where bodies are after a small part of a mode."""
    step, twist = _of_legs(problem, shape), shape[-problem.size :]
    part = _PART / max(problem.size_of_legs(step), problem.size_of(twist))
    return body_places(problem, problem.moved(state, part * twist, part * step))


def _of_legs(problem: EquilibriumProblem, shape: np.ndarray) -> np.ndarray:
    """The part of the legs in a mode, as a step of all their unknowns (T + B,)."""
    step = np.zeros(problem.legs.numbers.total + len(problem.legs.beams))
    step[problem.free] = shape[: -problem.size]
    return step


def _words(
    problem: EquilibriumProblem,
    state: State,
    shape: np.ndarray,
    twist: np.ndarray,
    shares: tuple[PartShare, ...],
) -> str:
    if problem.size_of(twist) < _STAYS * problem.size_of_legs(_of_legs(problem, shape)):
        most = shares[0] if shares else None
        return "the platform stays" + (f": most in {most.name!r}" if most else "")
    size = np.linalg.norm(twist * problem.scale)
    turning = np.arange(len(twist)) >= Space.of_size(len(twist)).translations
    if np.linalg.norm((twist * problem.scale)[turning]) < _TURNS * size:
        twist = np.where(turning, 0.0, twist)
    motion = free_motions_in_words(twist[None] / size, state.p, problem.length)[0]
    return f"the platform moves: {motion}"
