"""A robot under load as a record: Newton steps from the unloaded posture, and checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from robostiff.elastostatics import Status
from robostiff.kinematics import PostureFinder
from robostiff.kinematics.formula import FormulaPose, place_leg, place_leg_at_joints
from robostiff.model import Robot
from robostiff.record import ENTRY_FUNCTIONS, Entry, Program, Record, is_zero, least
from robostiff.recorded import RecordedRobot
from robostiff.recorded.parameters import (
    closed_samples,
    coordinates_at_home,
    parameter_samples,
    sample_postures,
    with_inputs,
)
from robostiff.recorded.robot import assembled
from robostiff.spatial import Space
from robostiff.statics.kernels.buckling import Buckling, buckling_of
from robostiff.statics.kernels.elimination import SymmetricElimination, solved_with
from robostiff.statics.kernels.leg import RecordedLoadedLeg, Turned, recorded_legs
from robostiff.statics.kernels.motion import FURTHEST_TURN
from robostiff.statics.kernels.strut import RecordedStrut, StrutTerms, strut_terms
from robostiff.statics.problem import EquilibriumProblem

# Every step is at most half of the one before, or as small as rounding makes it; squares.
_CONTRACTION, _SMALL_STEP = 0.5**2, 1e-9**2
#: Least ratio of stiffness under load to that without it at which an answer is given.
SAFE = 0.3
# Of its mean size at the samples: what a pivot must keep.
_PIVOT = 1e-3
# The step that would be next at which equilibrium is reached; ClosedCode compares with 1e-12.
_ARRIVED = 1e-11
_LAST, _MARGIN = "size of the last step", "contraction"
_ENDLESS = 1e300


@dataclass(frozen=True)
class RecordedLoading:
    """Newton steps from the unloaded posture to equilibrium.

    Attributes
    ----------
    inputs : tuple of str
        Coordinates of the posture, the wrench, then parameters.
    start : dict of names to floats
        The unknowns without load.
    first : Program
        The first step, which leads from the inputs to the linear answer.
    step : Program
        From inputs, unknowns, and what the last step handed on, to the same of the next.
    arrival : Program
        From the same to K (symmetric part, upper triangle), the shift and quaternion of the
        platform, the square of the step that would be next, and a number that is positive where
        all checks hold.
    checks : tuple of str
        Checks of the unloaded posture, whose rows come before the last two.
    steps, most_steps : int
        How many are usually enough, and how many may be taken.
    status, rank : Status, int
        Without load, at a general pose.
    """

    inputs: tuple[str, ...]
    start: dict[str, float]
    first: Program
    step: Program
    arrival: Program
    checks: tuple[str, ...]
    steps: int = 4
    most_steps: int = 10
    status: Status = Status.OK
    rank: int = 6

    @property
    def state(self) -> dict[str, float]:
        """What the first step begins with, by name."""
        return {**self.start, _LAST: _ENDLESS, _MARGIN: 1.0}

    def arrived(self, program: Program) -> Program:
        """What is computed at the end of the steps."""
        return program

    def composed(self, program: Program) -> Program:
        """The same with the steps before it, from the inputs alone."""
        record = Record({name: np.array([1.0]) for name in self.inputs})
        values: dict[str, Any] = {name: record.input(name) for name in self.inputs}
        values |= self.state
        for step in [self.first, *[self.step] * (self.steps - 1)]:
            after = step.evaluated(values, ENTRY_FUNCTIONS)
            values |= zip(self.state, after, strict=True)
        return Program.of(record, program.evaluated(values, ENTRY_FUNCTIONS))


@dataclass(frozen=True)
class _Equations:
    """The platform's equations at a state, legs eliminated."""

    elimination: SymmetricElimination
    K: dict[tuple[int, int], Any]
    antisymmetric: np.ndarray
    right: list[Any]
    turns: list[Any]
    buckling: list[Any]
    struts: StrutTerms | None


@dataclass(frozen=True)
class LoadedRobot:
    """A robot on entries, placed at its unloaded posture.

    Attributes
    ----------
    unloaded : RecordedRobot
        Its stiffness without load, and the checks of the posture.
    legs : list of RecordedLoadedLeg or RecordedStrut
    buckling : dict of int to Buckling
        Of those that are struts.
    platform : Turned
    space : Space
    length, force : float
    wrench : list of entries
    """

    unloaded: RecordedRobot
    legs: list[RecordedLoadedLeg | RecordedStrut]
    buckling: dict[int, Buckling]
    platform: Turned
    space: Space
    length: float
    force: float
    wrench: list[Any]

    @property
    def start(self) -> dict[str, float]:
        """Its unknowns without load."""
        found = dict(self.platform.start)
        for leg in self.legs:
            if isinstance(leg, RecordedLoadedLeg):
                found |= leg.start
            else:
                found[leg.name] = 0.0
        return found

    @property
    def struts(self) -> dict[int, RecordedStrut]:
        """Legs that are struts, by number."""
        return {k: leg for k, leg in enumerate(self.legs) if isinstance(leg, RecordedStrut)}

    def equations(self, values: Mapping[str, Any], *, arrived: bool = False) -> _Equations:
        """At a state, on the way to equilibrium or there."""
        rows = list(self.space.rows)
        twist = [f"t{row}" for row in rows]
        elimination = SymmetricElimination()
        for name in twist:
            elimination.unknown(name, 1.0)
        for name, own in zip(twist, self.wrench, strict=True):
            elimination.add_right(name, own)
        body = self.platform.moved(values)
        moment = np.zeros(3, dtype=int).astype(object)
        turns, buckling = [], []
        for leg in self.legs:
            if isinstance(leg, RecordedLoadedLeg):
                added = leg.add_to(elimination, values, body, twist, self.force)
                moment = moment + added.moment
                turns += added.turns
        terms, struts = None, self.struts
        if struts:
            forces = None if arrived else [values[own.name] for own in struts.values()]
            terms = strut_terms([*struts.values()], body, forces)
            for (i, j), value in terms.K.items():
                elimination.add(f"t{i}", f"t{j}", value)
            for name, own in zip(twist, terms.W, strict=True):
                elimination.add_right(name, -own)
            moment = moment + terms.W[3:]
            for number, t, length in zip(struts, terms.t, terms.lengths, strict=True):
                buckling += self.buckling[number].checks(t, length, SAFE)
        n = len(rows)
        K = {
            (i, j): elimination.A[twist[i]].get(twist[j], 0) for i in range(n) for j in range(i, n)
        }
        x, y, z = moment * 0.5
        A = np.zeros((6, 6), dtype=int).astype(object)
        A[3:, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        right = [elimination.right[name] for name in twist]
        return _Equations(elimination, K, A[np.ix_(rows, rows)], right, turns, buckling, terms)

    def first(self, values: Mapping[str, Any]) -> list[Any]:
        """The state after the first step: the linear answer."""
        values = {**values, **self.start, _LAST: _ENDLESS, _MARGIN: 1.0}
        return self.step(values, self.equations(values), self.unloaded.factors.solved(self.wrench))

    def twist(self, at: _Equations) -> list[Any]:
        """Step of the platform, K_total x = missing, K_total not symmetric under moments."""
        return solved_with(at.K, at.antisymmetric, at.right)[0]

    def sizes(self, twist: Sequence[Any]) -> list[Any]:
        """A twist in radians, shifts by the length."""
        return [
            x * (1 / self.length) if row < 3 else x
            for x, row in zip(twist, self.space.rows, strict=True)
        ]

    def step(self, values: Mapping[str, Any], at: _Equations, twist: list[Any]) -> list[Any]:
        """The state after a step, in the order of `start`; size and contraction."""
        full = np.zeros(6, dtype=int).astype(object)
        full[list(self.space.rows)] = twist
        names = [f"t{row}" for row in self.space.rows]
        found = at.elimination.solution(dict(zip(names, twist, strict=True)))
        after = self.platform.stepped(values, full)
        if at.struts is not None:
            own = [*self.struts.values()]
            forces = at.struts.forces_after(own, full)
            after |= {leg.name: t for leg, t in zip(own, forces, strict=True)}
        moved = self.sizes(twist)
        for leg in self.legs:
            if isinstance(leg, RecordedLoadedLeg):
                own, motion = leg.stepped(values, found, full)
                after |= own
                moved += motion
        size = reduce(add, (x * x for x in moved if not is_zero(x)))
        kept = values[_LAST] * _CONTRACTION + _SMALL_STEP - size
        return [*(after[name] for name in self.start), size, least(values[_MARGIN], kept)]

    def arrival(
        self, values: Mapping[str, Any], at: _Equations
    ) -> tuple[list[Any], dict[str, Any]]:
        """What is computed in equilibrium, and the checks of the unloaded posture.

        The step that would be next is taken with what K has more than its share of the stiffness
        without load: where that is positive, the energy of this step is at least that of the other.
        """
        rest = {place: own - self.unloaded.K[place] * SAFE for place, own in at.K.items()}
        none = np.zeros((self.space.size,) * 2, dtype=int)
        twist, pivots = solved_with(rest, none, at.right)
        left = [x for x in self.sizes(twist) if not is_zero(x)]
        gap = reduce(add, (x * x for x in left)) * (1e-12 / _ARRIVED) ** 2
        n = self.space.size
        safe: list[Any] = [
            *pivots,
            *(own - _PIVOT for own in at.elimination.pivots if isinstance(own, Entry)),
            *at.elimination.still,
            *at.buckling,
            *(FURTHEST_TURN - turn for turn in at.turns if isinstance(turn, Entry)),
            values[_MARGIN],
        ]
        safe = [x for x in safe if isinstance(x, Entry)]
        K = [at.K[i, j] for i in range(n) for j in range(i, n)]
        place = [values[name] for name in self.platform.coordinates]
        checks = self.unloaded.checks
        return [*K, *place, *checks.values(), gap, reduce(least, safe)], checks


def record_loading(
    robot: Robot,
    finder: PostureFinder,
    problems: Sequence[EquilibriumProblem],
    force: float,
    *,
    by_pose: bool,
) -> RecordedLoading:
    """Record the equilibrium of a robot.

    Parameters
    ----------
    robot : Robot
        Its symbols are inputs.
    finder : PostureFinder
        Of the same robot in numbers.
    problems : sequence of EquilibriumProblem
        In numbers, at several postures.
    force : float
        Under which the platform moves by about a thousandth of the robot's length [N].
    by_pose : bool
        Whether its inputs are pose coordinates; otherwise the coordinates of all legs.
    """
    inputs = _posture_inputs(robot, finder, by_pose=by_pose)
    random = np.random.default_rng(7)
    # Some samples are without load: what vanishes there is no pivot.
    count = len(next(iter(inputs.values())))
    shares = np.resize(np.array([0.0, 1.0, 0.5]), count)
    wrench = {
        name: shares * force * (1.0 if row < 3 else finder.length) * random.uniform(-1, 1, count)
        for name, row in zip(robot.space.wrench_order, robot.space.rows, strict=True)
    }
    own = {**inputs, **wrench, **parameter_samples(robot)}
    record = Record(own)
    placed, pose, unloaded = _placed(robot, finder, record, list(inputs), by_pose=by_pose)
    reference = pose.p + pose.R @ np.array(robot.reference_point, dtype=object)
    legs = recorded_legs(problems[0].groups, [leg.leg for leg in placed], unloaded)
    struts = [k for k, leg in enumerate(legs) if isinstance(leg, RecordedStrut)]
    loaded = LoadedRobot(
        unloaded,
        legs,
        buckling_of(problems, struts, force),
        Turned("platform", reference),
        robot.space,
        finder.length,
        force,
        [record.input(name) for name in wrench],
    )
    platform = dict.fromkeys(loaded.platform.coordinates[:3], finder.length)
    platform |= dict.fromkeys(loaded.platform.coordinates[4:], 1.0)
    for name in loaded.platform.coordinates:
        size = platform.get(name)
        sample = 1.0 if size is None else size * 1e-3 * shares * random.uniform(-1, 1, count)
        record.add_input(name, sample)
    for leg in legs:
        if isinstance(leg, RecordedLoadedLeg):
            for name, sample in leg.samples(shares, force, random).items():
                record.add_input(name, sample)
        else:
            record.add_input(leg.name, force * shares * random.uniform(-1, 1, count))
    # in the order of the state
    start = loaded.start
    record.add_input(_LAST, 1.0)
    record.add_input(_MARGIN, 1.0)
    values = {name: record.input(name) for name in record.inputs}
    outputs, checks = loaded.arrival(values, loaded.equations(values, arrived=True))
    arrival = Program.of(record, outputs)
    at = loaded.equations(values)
    step = Program.of(record, loaded.step(values, at, loaded.twist(at)))
    first = loaded.first(values)
    return RecordedLoading(
        tuple(own),
        start,
        Program.of(record, first),
        step,
        arrival,
        tuple(checks),
        status=unloaded.status,
        rank=unloaded.factors.rank,
    )


def _posture_inputs(robot: Robot, finder: PostureFinder, *, by_pose: bool) -> dict[str, np.ndarray]:
    if by_pose:
        samples = sample_postures(finder.robot, finder).pose
        pairs = zip(robot.coordinates, robot.coordinate_places, strict=True)
        return {c.value: samples[:, k] for c, k in pairs}
    inputs = {}
    for leg, own in zip(robot.legs, closed_samples(robot, finder).coordinates, strict=True):
        start = "q" if robot.is_serial else f"{leg.name}/"
        inputs.update({f"{start}{i}": own[:, i] for i in range(leg.chain.size)})
    return inputs


def _placed(
    robot: Robot, finder: PostureFinder, record: Record, names: Sequence[str], *, by_pose: bool
) -> tuple[list[Any], FormulaPose, RecordedRobot]:
    robot = with_inputs(robot, record)
    if by_pose:
        six: list[Any] = coordinates_at_home(robot, finder)
        for name, k in zip(names, robot.coordinate_places, strict=True):
            six[k] = record.input(name)
        pose = FormulaPose.of_coordinates(np.array(six, dtype=object))
        pairs = zip(robot.legs, finder.solvers, strict=True)
        placed = [place_leg(leg, pose, solver) for leg, solver in pairs]
    else:
        waiting = iter(names)
        placed = []
        for leg in robot.legs:
            q = [record.input(next(waiting)) for _ in range(leg.chain.size)]
            placed.append(place_leg_at_joints(leg, np.array(q, dtype=object)))
        pose = placed[0].platform
    return placed, pose, assembled(robot, record, pose, placed, finder.length)
