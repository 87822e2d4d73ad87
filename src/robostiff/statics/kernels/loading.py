"""A robot under load as a record: Newton steps from the unloaded posture, and checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from robostiff.elastostatics import Status
from robostiff.kinematics import PostureFinder
from robostiff.model import Robot
from robostiff.record import Entry, Program, is_zero, least
from robostiff.recorded import RecordedRobot
from robostiff.recorded.closure import (
    BEFORE_FIRST,
    LAST,
    RecordedSteps,
    contraction,
    handed_on,
)
from robostiff.recorded.robot import RobotOnEntries
from robostiff.spatial import Space, cross
from robostiff.statics.beam_bowing import Beams
from robostiff.statics.from_snapshot import walks_of
from robostiff.statics.kernels.buckling import Buckling, buckling_of
from robostiff.statics.kernels.elements import RecordedJoint
from robostiff.statics.kernels.elimination import SymmetricElimination, solved_with
from robostiff.statics.kernels.leg import RecordedLoadedLeg, Turned, recorded_legs
from robostiff.statics.kernels.motion import FURTHEST_TURN, identity
from robostiff.statics.kernels.springs import (
    RecordedBodySpring,
    SpringEnds,
    recorded_body_springs,
    with_anchors,
    without_anchors,
)
from robostiff.statics.kernels.strut import RecordedStrut, StrutTerms, strut_terms
from robostiff.statics.kernels.weights import (
    StandingLoads,
    framed,
    gravity_on,
    loads_on_legs,
    loads_on_platform,
    with_recorded_masses,
)
from robostiff.statics.loaded_posture import LoadedPosture
from robostiff.statics.newton import FALLS, HALF, LITTLE

#: Least ratio of stiffness under load to that without it at which an answer is given.
SAFE = 0.3
# Of its mean size at the samples: what a pivot must keep.
_PIVOT = 1e-3
# The step that would be next at which equilibrium is reached; ClosedCode compares with 1e-12.
_ARRIVED = 1e-11
# Part of the one before that a step may be at most: its square.
_PART, _ROUNDING = "part of the last step", 1e-18
_HANDED = BEFORE_FIRST | {_PART: HALF**2}


@dataclass(frozen=True, kw_only=True)
class RecordedLoading(RecordedSteps):
    """Newton steps from the unloaded posture to equilibrium.

    Its inputs are coordinates of the posture, parameters, then the wrench; the first step leads to
    the linear answer.

    Attributes
    ----------
    arrival : Program
        To K (symmetric part, upper triangle), the shift and quaternion of the platform, where it
        has them the arms of dead forces on it (see `LoadedAnswer`), the square of the step that
        would be next, and a number that is positive where all checks hold.
    checks : tuple of str
        Checks of the unloaded posture, whose rows come before the last two.
    has_arms : bool
    status, rank : Status, int
        Without load, at a general pose.
    """

    checks: tuple[str, ...]
    has_arms: bool
    most_steps: int = 10
    status: Status = Status.OK
    rank: int = 6

    @property
    def state(self) -> dict[str, float]:
        """What the first step begins with."""
        return self.start | _HANDED


@dataclass(frozen=True)
class _Equations:
    """The platform's equations at a state, legs eliminated.

    K is that of the legs, `K_total` that less what dead forces f on the platform do, both symmetric
    parts; `arms` is the sum of ``b f^T``, b their arms.
    """

    elimination: SymmetricElimination
    K: dict[tuple[int, int], Any]
    K_total: dict[tuple[int, int], Any]
    antisymmetric: np.ndarray
    arms: np.ndarray
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
    dead : list of pairs of (3,) arrays
        Arms from the point of the platform at the unloaded posture [m], and forces [N].
    springs : list of RecordedBodySpring
        Between bodies.
    """

    unloaded: RecordedRobot
    legs: list[RecordedLoadedLeg | RecordedStrut]
    buckling: dict[int, Buckling]
    platform: Turned
    space: Space
    length: float
    force: float
    wrench: list[Any]
    dead: list[tuple[np.ndarray, np.ndarray]]
    springs: list[RecordedBodySpring]

    @property
    def start(self) -> dict[str, float]:
        """Its unknowns without load."""
        found = dict(self.platform.start)
        for leg in self.legs:
            if isinstance(leg, RecordedLoadedLeg):
                found |= leg.start
        return found

    @property
    def struts(self) -> dict[int, RecordedStrut]:
        """Legs that are struts, by number."""
        return {k: leg for k, leg in enumerate(self.legs) if isinstance(leg, RecordedStrut)}

    @property
    def stands(self) -> bool:
        """Whether anything acts beside the wrench."""
        if self.dead or self.springs:
            return True
        chains = [c for leg in self.legs if isinstance(leg, RecordedLoadedLeg) for c in leg.chains]
        joints = [e for c in chains for e in c.elements if isinstance(e, RecordedJoint)]
        return any(c.loads for c in chains) or any(not is_zero(e.preload) for e in joints)

    @property
    def _at_rest(self) -> LoadedRobot:
        """The same, springs between bodies relaxed and nothing acting on bodies."""
        legs = [leg if isinstance(leg, RecordedStrut) else leg.without_loads for leg in self.legs]
        return replace(self, legs=legs, springs=[own.relaxed for own in self.springs], dead=[])

    def equations(
        self, values: Mapping[str, Any], forces: Sequence[Any] | None = None
    ) -> _Equations:
        """At a state; `forces` are those of struts that turn with them, see `strut_terms`."""
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
        alone = [own for own in self.springs if own.leg is None]
        moment = moment + SpringEnds(body, twist, rows).add(alone, elimination)[1]
        for leg in self.legs:
            if isinstance(leg, RecordedLoadedLeg):
                taken, turned = leg.add_to(elimination, values, body, twist, self.force)
                moment, turns = moment + taken, turns + turned
        terms, struts = None, self.struts
        if struts:
            terms = strut_terms([*struts.values()], body, forces)
            for (i, j), value in terms.K.items():
                elimination.add(f"t{i}", f"t{j}", value)
            for name, own in zip(twist, terms.W, strict=True):
                elimination.add_right(name, -own)
            moment = moment + terms.W[3:]
            for number, t, length in zip(struts, terms.t, terms.lengths, strict=True):
                buckling += self.buckling[number].checks(t, length, SAFE)
        arms = np.zeros((3, 3), dtype=int).astype(object)
        for arm, force in self.dead:
            b = body.R @ arm
            arms = arms + b[:, None] * force[None, :]
            acting = np.concatenate([force, cross(b, force)])
            moment = moment - acting[3:]
            for name, row in zip(twist, rows, strict=True):
                elimination.add_right(name, acting[row])
        n = len(rows)
        K = {
            (i, j): elimination.A[twist[i]].get(twist[j], 0) for i in range(n) for j in range(i, n)
        }
        turning = np.zeros((6, 6), dtype=int).astype(object)
        trace = arms[0, 0] + arms[1, 1] + arms[2, 2]
        turning[3:, 3:] = (arms + arms.T) * 0.5 - identity() * trace
        K_total = {(i, j): own - turning[rows[i], rows[j]] for (i, j), own in K.items()}
        x, y, z = moment * 0.5
        A = np.zeros((6, 6), dtype=int).astype(object)
        A[3:, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        right = [elimination.right[name] for name in twist]
        A = A[np.ix_(rows, rows)]
        return _Equations(elimination, K, K_total, A, arms, right, turns, buckling, terms)

    def first(self, values: Mapping[str, Any]) -> list[Any]:
        """The state after the first step, the linear answer; of struts after two more."""
        values = {**values, **self.start, **_HANDED}
        at = self.equations(values)
        twist = self.twist(at) if self.stands else self.unloaded.factors.solved(self.wrench)
        after = self.step(values, at, twist, falls=False)
        struts = [*self.struts.values()]
        if not struts:
            return after
        forces = [own.first_force(np.array(twist, dtype=object)) for own in struts]
        values |= zip((*self.start, *_HANDED), after, strict=True)
        at = self.equations(values, forces)
        twist = self.twist(at)
        after = self.step(values, at, twist, falls=False)
        forces = at.struts.forces_after(struts, np.array(twist, dtype=object)) if at.struts else []
        values |= zip((*self.start, *_HANDED), after, strict=True)
        at = self.equations(values, forces)
        return self.step(values, at, self.twist(at), falls=False)

    def twist(self, at: _Equations) -> list[Any]:
        """Step of the platform, K_total x = missing, K_total not symmetric under moments."""
        return solved_with(at.K_total, at.antisymmetric, at.right)[0]

    def sizes(self, twist: Sequence[Any]) -> list[Any]:
        """A twist in radians, shifts by the length."""
        return [
            x * (1 / self.length) if row < 3 else x
            for x, row in zip(twist, self.space.rows, strict=True)
        ]

    def step(
        self, values: Mapping[str, Any], at: _Equations, twist: list[Any], *, falls: bool = True
    ) -> list[Any]:
        """The state after a step, in the order of `start`; size, contraction, and what may follow.

        `falls`: whether it is one of Newton's, of which each has to be a smaller part than before.
        """
        full = np.zeros(6, dtype=int).astype(object)
        full[list(self.space.rows)] = twist
        names = [f"t{row}" for row in self.space.rows]
        found = at.elimination.solution(dict(zip(names, twist, strict=True)))
        after = self.platform.stepped(values, full)
        moved = self.sizes(twist)
        for leg in self.legs:
            if isinstance(leg, RecordedLoadedLeg):
                own, motion = leg.stepped(values, found, full)
                after |= own
                moved += motion
        size = reduce(add, (x * x for x in moved if not is_zero(x)))
        handed, part = handed_on(values, size, values[_PART]), HALF**2
        if falls:
            of_last = size / (values[LAST] + _ROUNDING)
            part = least(values[_PART], of_last * FALLS**2 + LITTLE**2)
        return [*(after[name] for name in self.start), *handed, part]

    def arrival(
        self, values: Mapping[str, Any], at: _Equations
    ) -> tuple[list[Any], dict[str, Any]]:
        """What is computed in equilibrium, and the checks of the unloaded posture.

        The step that would be next is taken with what K has more than its share of the stiffness
        without load: where that is positive, the energy of this step is at least that of the other.
        """
        unloaded = self.unloaded.K
        if self.springs:
            unloaded = self._at_rest.equations({**values, **self.start}).K
        rest = {place: own - unloaded[place] * SAFE for place, own in at.K_total.items()}
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
            contraction(values),
        ]
        safe = [x for x in safe if isinstance(x, Entry)]
        K = [at.K[i, j] for i in range(n) for j in range(i, n)]
        place = [values[name] for name in self.platform.coordinates]
        arms = [*at.arms.flat] if self.dead else []
        checks = self.unloaded.checks
        return [*K, *place, *arms, *checks.values(), gap, reduce(least, safe)], checks


def record_loading(
    robot: Robot,
    finder: PostureFinder,
    loaded_postures: Sequence[LoadedPosture],
    force: float,
    standing: StandingLoads,
    beams: Beams,
    *,
    by_pose: bool,
) -> RecordedLoading:
    """Record the equilibrium of a robot, whose symbols are inputs.

    `finder` and `loaded_postures` have it in numbers, the latter at several postures. Under `force`
    [N] the platform moves by about a thousandth of the robot's length. The other inputs are pose
    coordinates (`by_pose`), or the coordinates of all legs.
    """
    gravity, springs = gravity_on(robot.numeric, standing), finder.robot.springs
    here = RobotOnEntries.of(
        robot,
        finder,
        by_pose=by_pose,
        changed=lambda leg: with_anchors(framed(leg) if np.any(gravity) else leg, springs),
    )
    here, frames = without_anchors(here)
    if np.any(gravity):
        here = with_recorded_masses(here)
    record, unloaded = here.record, here.recorded
    random, count = np.random.default_rng(7), record.count
    # Some samples are without load: what vanishes there is no pivot.
    shares = np.resize(np.array([0.0, 1.0, 0.5]), count)

    def small(size: float) -> np.ndarray:
        return shares * size * random.uniform(-1, 1, count)

    rows = zip(robot.space.wrench_order, robot.space.rows, strict=True)
    sizes = {name: force * (1.0 if row < 3 else finder.length) for name, row in rows}
    wrench = [record.add_input(name, small(size)) for name, size in sizes.items()]
    inputs = record.inputs
    dead, forces = loads_on_platform(here, standing, gravity)
    snapshot = loaded_postures[0].snapshot
    walks = [] if snapshot is None else walks_of(snapshot, beams)
    on_legs = [own.leg for own in here.placed]
    loads = loads_on_legs(walks, on_legs, forces, gravity)
    placed = () if snapshot is None else snapshot.springs
    held = recorded_body_springs(springs, placed, here, frames, walks)
    legs = recorded_legs(walks, on_legs, unloaded, loads, standing.preload or {}, held)
    struts = [k for k, leg in enumerate(legs) if isinstance(leg, RecordedStrut)]
    loaded = LoadedRobot(
        unloaded,
        legs,
        buckling_of([own.problem for own in loaded_postures], struts, force),
        Turned("platform", here.reference),
        robot.space,
        finder.length,
        force,
        wrench,
        dead,
        held,
    )
    start = loaded.start
    lengths = dict.fromkeys(loaded.platform.coordinates[:3], 1e-3 * finder.length)
    for name, size in (lengths | dict.fromkeys(loaded.platform.coordinates[3:], 1e-3)).items():
        record.add_input(name, small(size) if start[name] == 0.0 else start[name])
    for leg in legs:
        if isinstance(leg, RecordedLoadedLeg):
            for name, sample in leg.samples(shares, force, random).items():
                record.add_input(name, sample)
    for name in _HANDED:
        record.add_input(name, 1.0)
    values = {name: record.input(name) for name in record.inputs}
    at = loaded.equations(values)
    outputs, checks = loaded.arrival(values, at)
    return RecordedLoading(
        inputs=inputs,
        start=start,
        step=Program.of(record, loaded.step(values, at, loaded.twist(at))),
        arrival=Program.of(record, outputs),
        first_steps=3 if struts else 1,
        first=Program.of(record, loaded.first(values)),
        checks=tuple(checks),
        has_arms=bool(loaded.dead),
        status=unloaded.status,
        rank=unloaded.factors.rank,
    )
