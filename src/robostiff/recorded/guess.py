"""A robot at a guess of its posture, on the entries of a new record."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.kinematics import PostureFinder
from robostiff.kinematics.closure import gaps
from robostiff.kinematics.closure.body import tidied
from robostiff.kinematics.formula import FormulaPose
from robostiff.kinematics.frames import place_chain
from robostiff.model import (
    ALL_COORDINATES,
    Chain,
    Joint,
    JointKind,
    Leg,
    ParallelBlock,
    Passive,
    Robot,
)
from robostiff.model.entries import Symbolic
from robostiff.record import Entry, Record, angle_of
from robostiff.recorded.newton_step import LegAtGuess
from robostiff.recorded.parameters import (
    closed_samples,
    coordinates_at_home,
    parameter_samples,
    turns_at_home,
    with_inputs,
)

_NAMES = [coordinate.value for coordinate in ALL_COORDINATES]


@dataclass(frozen=True)
class RobotAtGuess:
    """A robot at a guess of its posture.

    Attributes
    ----------
    record : Record
        Its inputs are free pose coordinates, parameters, then the unknowns.
    inputs : tuple of str
        Those that are no unknowns.
    start : dict of names to floats
        The unknowns at home: a turn is there by its cosine and sine.
    angles : tuple of str
        Coordinates that are unknown by their cosine and sine.
    legs : tuple of LegAtGuess
    pose : FormulaPose
        Of the platform.
    r : (3,) array
        Its rotation vector [rad].
    open : dict of int to str
        Pose coordinates that the legs decide.
    """

    record: Record
    inputs: tuple[str, ...]
    start: dict[str, float]
    angles: tuple[str, ...]
    legs: tuple[LegAtGuess, ...]
    pose: FormulaPose
    r: np.ndarray
    open: dict[int, str]

    @classmethod
    def of(cls, robot: Robot, finder: PostureFinder, joints: Sequence[str]) -> RobotAtGuess | None:
        """None where a parameter turns the platform at home: only closed forms take that."""
        poses, each_leg = closed_samples(robot, finder)
        chosen = robot.coordinate_places
        decided = () if finder.open_stay_at_home else robot.space.rows
        open_ = {k: _NAMES[k] for k in decided if k not in chosen}
        # The last sample is home: a pivot that vanishes there is none.
        pose = np.concatenate([poses, finder.home_pose[None]])
        inputs = {_NAMES[k]: pose[:, k] for k in chosen} | with_nominal(robot)
        state = {name: pose[:, k] for k, name in open_.items()}
        guessed = []
        waiting = iter(joints)
        for leg, solver, q in zip(finder.robot.legs, finder.solvers, each_leg, strict=True):
            names = [next(waiting) for _ in range(leg.chain.size)]
            guessed.append(_GuessedLeg.of(leg, names, np.concatenate([q, solver.home[None]])))
            state |= guessed[-1].state
        record = Record({**inputs, **state})
        own = with_inputs(robot, record)
        if turns_at_home(own):
            return None
        six = pose_on_entries(own, finder, record, (*chosen, *open_))
        return cls(
            record=record,
            inputs=tuple(inputs),
            start={name: float(values[-1]) for name, values in state.items()},
            angles=tuple(name for guess in guessed for name in guess.angles),
            legs=tuple(
                guess.on_entries(leg, record) for guess, leg in zip(guessed, own.legs, strict=True)
            ),
            pose=FormulaPose.of_coordinates(six),
            r=six[3:],
            open=open_,
        )


@dataclass(frozen=True)
class _GuessedLeg:
    """A leg in numbers, and its coordinates at closed postures (samples, size), home the last."""

    names: list[str]
    free: np.ndarray
    q: np.ndarray
    angles: dict[str, int]
    closing: tuple[int, ...]

    @classmethod
    def of(cls, leg: Leg, names: list[str], q: np.ndarray) -> _GuessedLeg:
        chain, alone = leg.chain, not leg.chain.is_coupled
        turning = [
            i
            for element, place in chain.moving
            if isinstance(element, Joint) and element.kind is not JointKind.SPHERICAL
            for i in range(place.start, place.stop)
            if alone and chain.free[i] and chain.freedoms[i].is_rotation
        ]
        closing = tuple(closing_balls(leg)) if alone else ()
        return cls(names, chain.free, q, {names[i]: i for i in turning}, closing)

    @property
    def state(self) -> dict[str, np.ndarray]:
        """Values of its unknowns at the samples."""
        found = {}
        for i in np.flatnonzero(self.free).tolist():
            name = self.names[i]
            if name in self.angles:
                cosine, sine = turn_names(name)
                found |= {cosine: np.cos(self.q[:, i]), sine: np.sin(self.q[:, i])}
            elif i not in self.closing:
                found[name] = self.q[:, i]
        return found

    def on_entries(self, leg: Leg, record: Record) -> LegAtGuess:
        """The leg at a guess; what closes it stays at zero."""
        at: list[Any] = []
        for i, (name, home) in enumerate(zip(self.names, leg.chain.home, strict=True)):
            if name in self.angles:
                cosine, sine = map(record.input, turn_names(name))
                at.append(angle_of(sine, cosine, near=float(self.q[-1, i])))
            elif i in self.closing:
                at.append(0)
            else:
                at.append(record.input(name) if self.free[i] else home)
        return LegAtGuess(
            leg, self.names, np.array(at, dtype=object), self.closing, self.q[-1].astype(float)
        )


def turn_names(angle: str) -> tuple[str, str]:
    """Names of the cosine and the sine of an unknown angle."""
    return f"cos {angle}", f"sin {angle}"


def pose_on_entries(
    robot: Robot, finder: PostureFinder, record: Record, places: Sequence[int]
) -> np.ndarray:
    """Pose coordinates (6,) of a robot on entries: inputs of a record at some places, or home's."""
    six: list[Any] = coordinates_at_home(robot, finder)
    for k in places:
        six[k] = record.input(_NAMES[k])
    return tidied(np.array(six, dtype=object))


def closing_balls(leg: Leg) -> Iterator[int]:
    """Coordinates of passive ball joints in which a leg ends, or a branch that does not lead.

    Whatever else moves, such a joint turns as far as is needed: its center alone has to meet its
    place.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> list(closing_balls(load("us-ups").legs[0]))
    [2, 3, 4]
    """
    here = np.eye(3), np.zeros(3)
    placed = place_chain(leg.chain, np.asarray(leg.chain.home, dtype=float), *here)
    chains = (leg.chain, *_chains_of_loops(leg.chain))
    for chain, gap in zip(chains, gaps(leg, placed, *here), strict=True):
        last = chain.elements[-1] if chain.elements else None
        if isinstance(last, Joint) and last.kind is JointKind.SPHERICAL:
            own = gap.own[-3:]
            if isinstance(last.role, Passive) and all(leg.chain.free[i] for i in own):
                yield from own


def _chains_of_loops(chain: Chain) -> Iterator[Chain]:
    """Chains that end where another branch does, in the order of the loops of a placed chain."""
    for element in chain.elements:
        if isinstance(element, ParallelBlock):
            for branch in element.branches:
                yield from _chains_of_loops(branch.chain)
            yield from (branch.chain for branch in element.branches[1:])


def with_nominal(robot: Symbolic) -> dict[str, np.ndarray]:
    """Values of the parameters at the samples, the nominal ones last, as at home."""
    samples = parameter_samples(robot)
    return {name: np.append(own, float(robot.nominal[name])) for name, own in samples.items()}


def nominal(value: Any) -> float:
    """A number, or the value of an entry at home."""
    return float(value.sample[-1]) if isinstance(value, Entry) else float(value)
