"""The closure of a robot as a record: Newton steps from home, and checks that they arrived."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property, reduce
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.frozen import field, frozen, replace
from robostiff.kinematics import PostureFinder
from robostiff.kinematics.formula import FormulaPose
from robostiff.model import Passive, Robot
from robostiff.record import (
    ENTRY_FUNCTIONS,
    WATCHED,
    Entry,
    Program,
    Record,
    derivatives_along,
    least,
    with_turn,
)
from robostiff.recorded.guess import (
    NAMES,
    GuessedLeg,
    Same,
    is_still,
    nominal,
    pose_on_entries,
    turn_names,
    with_nominal,
)
from robostiff.recorded.newton_step import NewtonStep, newton_step
from robostiff.recorded.parameters import closed_samples, rate_name, turns_at_home, with_inputs

# Every step is at most half of the one before, or as small as rounding makes it; squares.
_HALF, _SMALL_STEP = 0.5**2, 1e-9**2
LAST, _MARGIN = "size of the last step", "contraction"
#: What the first step finds of the one before.
BEFORE_FIRST = {LAST: 1e300, _MARGIN: 1.0}


def handed_on(values: Mapping[str, Any], size: Any, part: Any = _HALF) -> list[Any]:
    """What a step of a size (its square) hands to the next, in the order of `BEFORE_FIRST`.

    The second is positive as long as every step is at most a part (its square) of the one before.
    """
    kept = values[LAST] * part + _SMALL_STEP - size
    return [size, least(values[_MARGIN], kept)]


def contraction(values: Mapping[str, Any]) -> Any:
    """Positive where every step so far was at most a part of the one before."""
    return values[_MARGIN]


@frozen(kw_only=True)
class RecordedSteps:
    """Newton steps from a start."""

    inputs: tuple[str, ...]
    start: dict[str, float]  # the unknowns there
    # From inputs, unknowns, and what the last step handed on, to the next unknowns and the same of
    # this step
    step: Program
    # What is computed from the same at the end; what stays open (squared), and a number that is
    # positive where all is well, come last
    arrival: Program
    # The first step, or several of them, from the inputs alone, where these are other ones
    first: Program | None = None
    first_steps: int = 1  # how many it takes
    # How many are usually enough, and how many may be taken
    steps: int = 4
    most_steps: int = 6

    @property
    def state(self) -> dict[str, float]:
        """What the first step begins with, by name."""
        return self.start | BEFORE_FIRST

    def at_end(self, program: Program) -> Program:
        """A program at the end of the steps, as one of inputs and state, which it is here."""
        return program

    def after_all_steps(self, arrived: Program) -> Program:
        """The same with the steps before it, from the inputs alone."""
        record = self.empty_record(self.inputs)
        values: dict[str, Any] = {name: record.input(name) for name in self.inputs}
        for step in [self.first_step, *[self.step] * (self.steps - self.first_steps)]:
            values |= zip(self.state, step.evaluate(values, ENTRY_FUNCTIONS), strict=True)
        return Program.of(record, arrived.evaluate(values, ENTRY_FUNCTIONS))

    @cached_property
    def first_step(self) -> Program:
        """The first steps, from the inputs alone: much in them is known."""
        if self.first is not None:
            return self.first
        record = self.empty_record(self.inputs)
        values = self.state | {name: record.input(name) for name in self.inputs}
        return Program.of(record, self.step.evaluate(values, ENTRY_FUNCTIONS))

    def empty_record(self, names: Sequence[str]) -> Record:
        """A record in which nothing is decided by samples: what is alike at home need not stay."""
        return Record(dict.fromkeys(names, ()))


_MODE = "assembly mode"  # positive in that of home


@frozen(kw_only=True)
class RecordedClosure(RecordedSteps):
    """Newton steps of a whole robot, from home to a pose.

    Its inputs are pose coordinates, then parameters; its unknowns the coordinates of the legs,
    turns by their cosines and sines, and pose coordinates that the legs decide.

    Attributes
    ----------
    home : dict of names to floats
        The inputs there.
    arrival : Program
        To the coordinates of all legs in the order of ``joints``, the square of what stays open,
        and a number that is positive in the assembly mode of home.
    joints : tuple of str
    angles : tuple of str
        Joints that are unknown by their cosine and sine.
    held : tuple of str
        Coordinates of passive joints that nothing determines, as of a rod that spins: they stay
        where they are at home.
    same : mapping of names to Same
        Joints that are another one or a pose coordinate but for its sign, or a number.
    """

    home: dict[str, float]
    joints: tuple[str, ...]
    angles: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    same: Mapping[str, Same] = field(default_factory=dict)

    @property
    def state(self) -> dict[str, float]:
        """What the first step begins with, the assembly mode that each finds among it."""
        return super().state | {_MODE: 1.0}

    @property
    def following(self) -> list[str]:
        """What follows from the inputs: coordinates of the legs, and unknowns."""
        names = dict.fromkeys((*self.joints, *self.start))
        return [name for name in names if name not in self.inputs]

    def rates(self, by: str) -> Program:
        """Rates of what follows, in a closed posture, when one input changes.

        A Newton step g(x, p) from a closed posture x of an input p returns to it, and does so from
        all nearby: dg/dx = 0. So dx/dp = dg/dp, with x held.
        """
        record = self.empty_record((*self.inputs, *self.state))
        values: dict[str, Any] = {name: record.input(name) for name in record.inputs}
        after = self.step.evaluate(values, ENTRY_FUNCTIONS)[: len(self.start)]
        rates = derivatives_along(record, after, {by: 1})
        moving = dict(zip(self.start, rates, strict=True))
        values |= self._joints_at(values)
        found = [values[name] for name in self.following]
        return Program.of(record, derivatives_along(record, found, {by: 1} | moving))

    def direction(self, record: Record, by: str) -> dict[str, Any]:
        """Rates of the inputs of a record when one input of the closure changes.

        Those of what follows become inputs of the record, which the closure provides.

        Raises InputError when the closure has no such input.
        """
        if by not in self.inputs:
            raise InputError("derivative", got=by, expected=", ".join(self.inputs))
        known = set(record.inputs)
        moving = [name for name in self.following if name in known]
        rates: dict[str, Any] = {x: record.add_input(rate_name(x, by), 1.0) for x in moving}
        return rates | ({by: 1} if by in known else {})

    def at_end(self, program: Program) -> Program:
        """Those of a program of leg coordinates, then the last two of the arrival."""
        record = self.empty_record((*self.inputs, *self.state))
        values = {name: record.input(name) for name in record.inputs}
        gap, mode = self.arrival.evaluate(values, ENTRY_FUNCTIONS)[-2:]
        at_joints = {**values, **self._joints_at(values)}
        for by in self.inputs:
            names = [rate_name(name, by) for name in self.following]
            if not set(names).isdisjoint(program.inputs):
                rates = self.rates(by).evaluate(values, ENTRY_FUNCTIONS)
                at_joints |= zip(names, rates, strict=True)
        return Program.of(record, [*program.evaluate(at_joints, ENTRY_FUNCTIONS), gap, mode])

    def _joints_at(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Coordinates of all legs at values of inputs and unknowns."""
        found = self.arrival.evaluate(values, ENTRY_FUNCTIONS)[:-2]
        q = dict(zip(self.joints, found, strict=True))
        for name in self.angles:
            cosine, sine = turn_names(name)
            with_turn(q[name], values[sine], values[cosine])
        return q


def record_closure(
    robot: Robot, finder: PostureFinder, joints: Sequence[str], most: int | None = None
) -> RecordedClosure | None:
    """Record the closure of a robot whose legs are closed by iteration.

    Parameters
    ----------
    robot : Robot
        Its symbols, which have nominal values, are inputs as well.
    finder : PostureFinder
        Of the same robot in numbers.
    joints : sequence of str
        Names for the coordinates of the legs, one leg after the other.
    most : int, optional
        Of operations, beyond which a `NoAnswerError` is raised.

    Returns
    -------
    RecordedClosure or None
        None where a record does not serve: home is singular, or drives or pose coordinates are
        undetermined, so that the way of the iteration chooses them.

    Raises
    ------
    InputError
        When home has no room around it.
    """
    poses, each_leg = closed_samples(robot, finder)
    chosen = robot.coordinate_places
    decided = () if finder.open_stay_at_home else robot.space.rows
    open_ = {k: NAMES[k] for k in decided if k not in chosen}
    # The last sample is home: a pivot that vanishes there is none.
    six = np.concatenate([poses, finder.home_pose[None]])
    moving = {NAMES[k]: six[:, k] for k in (*chosen, *open_) if not is_still(six[:, k])}
    inputs = {NAMES[k]: six[:, k] for k in chosen} | with_nominal(robot)
    state = {name: moving[name] for name in open_.values() if name in moving}
    guesses, waiting = [], iter(joints)
    for leg, solver, q in zip(finder.robot.legs, finder.solvers, each_leg, strict=True):
        names = [next(waiting) for _ in range(leg.chain.size)]
        samples = np.concatenate([q, solver.home[None]])
        guesses.append(GuessedLeg.of(leg, names, samples, moving))
        state |= guesses[-1].state
    record = Record({**inputs, **state}, most)
    entries = with_inputs(robot, record)
    if turns_at_home(entries):  # only closed forms take that
        return None
    pose_at_guess = pose_on_entries(entries, finder, record, (*inputs, *state))
    pose, r = FormulaPose.of_coordinates(pose_at_guess), pose_at_guess[3:]
    pairs = zip(guesses, entries.legs, strict=True)
    legs = [guess.on_entries(leg, record, inputs, pose) for guess, leg in pairs]
    start = {name: float(values[-1]) for name, values in state.items()}
    # Coordinates that are no unknowns, as in a parallelogram: they equal another one or a pose
    # coordinate but for its sign, or a number, wherever the legs close. At first each is unknown.
    same = {name: one for guess in guesses for name, one in guess.same.items()}
    step = newton_step([replace(leg, same={}) for leg in legs], pose, r, open_, finder.length)
    roles = [role for leg in robot.legs for role in leg.chain.roles]
    passive = {name for name, role in zip(joints, roles, strict=True) if isinstance(role, Passive)}
    if not passive.issuperset(step.undetermined):
        return None
    undetermined, elsewhere = tuple(step.undetermined), ()
    if {*same, *open_.values()} - {*undetermined, *step.following, *start}:
        # Not the whole step is needed, but its determinants: what is known of all closed postures
        # holds on as well where assembly modes meet, and beyond.
        elsewhere = step.determinants
        unknown = {k: name for k, name in open_.items() if name in start}
        step = newton_step(legs, pose, r, unknown, finder.length)
    q = {name: x for leg in legs for name, x in zip(leg.names, leg.q, strict=True)}
    turns = []  # positive where a limited turn is the one that the careful closure reports
    for leg in legs:
        chain = leg.leg.chain
        for i, (low, high) in enumerate(chain.limits.T.tolist()):
            if not chain.freedoms[i].is_rotation or math.isinf(low):
                continue
            x, centre = leg.q[i], min(max(nominal(chain.home[i]), low), high)
            turns += [math.pi - (x - centre), math.pi + (x - centre)]
            if high >= centre + math.pi or low <= centre - math.pi:
                turns += [x - low, high - x]
    closure = steps_from_home(
        record,
        tuple(inputs),
        start,
        step,
        q | step.following,
        turns=turns,
        angles=[name for guess in guesses for name in guess.angles],
        determinants=elsewhere,
    )
    return closure and replace(closure, held=undetermined, same=same)


def steps_from_home(
    record: Record,
    inputs: tuple[str, ...],
    start: dict[str, float],
    step: NewtonStep,
    q: Mapping[str, Any],
    *,
    turns: Iterable[Any] = (),
    angles: Sequence[str] = (),
    determinants: Sequence[Entry] = (),
) -> RecordedClosure | None:
    """The closure that takes one recorded step after the other; None where home is singular.

    Inputs of the record are those of the closure, then the unknowns, and its last sample is home.
    `q` are the coordinates that follow; `turns` are positive in the posture that is meant; `angles`
    are unknown by their cosine and sine; more determinants are looked at on arrival.
    """
    mode, last = _mode(step.determinants), _mode(determinants)
    if mode is None or last is None:
        return None
    before = {name: record.add_input(name, 1.0) for name in (*BEFORE_FIRST, _MODE)}
    moved = {name: record.input(name) + step.steps.get(name, 0) for name in start}
    for name in angles:
        # It turns by 2 atan(x/2), which is the step x up to its third power and needs no sine.
        x, (cosine, sine) = step.steps.get(name, 0), turn_names(name)
        c, s = record.input(cosine), record.input(sine)
        part = 1 / (1 + x * x * 0.25)
        c_step, s_step = 2 * part - 1, x * part
        moved |= {cosine: c * c_step - s * s_step, sine: s * c_step + c * s_step}
    after = [moved[name] for name in start]
    # That of the last step will do: where nothing stays open, it was as short as its square.
    arrived = reduce(least, turns, least(least(before[_MODE], last), contraction(before)))
    return RecordedClosure(
        inputs=inputs,
        home={name: float(record.input(name).sample[-1]) for name in inputs},
        start=start,
        step=Program.of(record, [*after, *handed_on(before, step.size), mode]),
        arrival=Program.of(record, [*q.values(), step.gap, arrived]),
        joints=tuple(q),
        angles=tuple(angles),
    )


def _mode(determinants: Sequence[Entry]) -> Any:
    """Least determinant as a part of its size at home; None where one vanishes or turns there."""
    parts = []
    for determinant in determinants:
        *elsewhere, home = determinant.sample.tolist()
        if not (home and all(value / home > WATCHED for value in elsewhere)):
            return None
        parts.append(determinant * (1 / home))
    return reduce(least, parts) - WATCHED if parts else 1.0
