"""A robot under load on entries: its equations, and a record of the steps to equilibrium."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cached_property, partial, reduce
from operator import add
from typing import Any, cast

import numpy as np

from robostiff.elastostatics import Status
from robostiff.errors import OpenAtHomeError
from robostiff.frozen import field, frozen, replace
from robostiff.kinematics import PostureFinder, posture_finder
from robostiff.model import PlacedMass, PlacedPlatform, Robot, Snapshot
from robostiff.model.body_spring import BASE, PLATFORM
from robostiff.network.assembly import of_legs
from robostiff.record import Entry, Program, derivatives_along, is_zero, least
from robostiff.recorded import Factors, RecordedClosure, RecordedRobot, factors_of, flags_of
from robostiff.recorded.closure import BEFORE_FIRST, LAST, RecordedSteps, contraction, handed_on
from robostiff.recorded.parameters import rate_name, sample_postures
from robostiff.recorded.robot import RobotOnEntries, place_robot
from robostiff.spatial import skew
from robostiff.statics.chains.legs import LegEquations
from robostiff.statics.chains.moving_chain import FURTHEST_TURN
from robostiff.statics.equations.newton import FALLS, HALF, LITTLE
from robostiff.statics.equations.problem import DeadForces
from robostiff.statics.kernels.elimination import SymmetricElimination
from robostiff.statics.kernels.leg import (
    MovingBody,
    RecordedElements,
    RecordedLegs,
    Site,
    frame_of,
    placed_springs,
)
from robostiff.statics.kernels.strut import (
    Buckling,
    RecordedStrut,
    add_struts,
    buckling_of,
    recorded_struts,
)
from robostiff.statics.loading.given_loads import (
    DeadForce,
    StandingLoads,
    acting_gravity,
    given_forces,
    on_platform,
)
from robostiff.statics.loading.legs import LoadedAssembly, loaded_legs
from robostiff.statics.loading.loaded_posture import LoadedPosture

#: Least ratio of stiffness under load to that without it at which an answer is given.
SAFE = 0.3
# Of its mean size at the samples: what a pivot must keep.
_PIVOT = 1e-3
# The step that would be next at which equilibrium is reached; ClosedCode compares with 1e-12.
_ARRIVED = 1e-11
# Part of the one before that a step may be at most: its square.
_PART, _ROUNDING = "part of the last step", 1e-18
# Part by which a parameter is changed to find out whether legs move with it, and less than they do.
_CHANGE, _STILL = 1e-3, 1e-9
#: Inputs: the sum of ``h f^T`` over forces f at hooks h, in platform axes and world axes [N m].
HOOKS = tuple(f"hook_{a}{b}" for a in "xyz" for b in "xyz")
_WORLD = np.eye(3), np.zeros(3)
#: What a step hands to the next, and what the first finds.
HANDED = BEFORE_FIRST | {_PART: HALF**2}


@frozen
class _Equations:
    """The platform's equations at a state, legs eliminated.

    K is that of the legs, `K_total` that less what dead forces on the platform do, both symmetric
    parts.
    """

    elimination: SymmetricElimination
    K: dict[tuple[int, int], Any]
    K_total: dict[tuple[int, int], Any]
    antisymmetric: np.ndarray
    right: list[Any]
    legs: LegEquations
    buckling: list[Any]

    @cached_property
    def factored(self) -> Factors:
        """K_total, not symmetric under moments."""
        return factors_of(self.K_total, len(self.right), self.antisymmetric, in_order=True)


@frozen
class LoadedRobot:
    """A robot on entries, placed at its unloaded posture."""

    unloaded: RecordedRobot  # its stiffness without load, and the checks of the posture
    legs: RecordedLegs
    struts: dict[int, RecordedStrut]  # of the other legs, by their numbers
    buckling: dict[int, Buckling]  # of the struts
    wrench: list[Any]  # entries
    dead: DeadForces  # of those at hooks the levers alone: these forces are part of the wrench
    stands: bool  # whether anything acts beside the wrench
    axes: Any = None  # (3, 3): of the platform at the unloaded posture, where its rates are asked
    # Parameters by which rates are asked for: rates of all inputs that move with each at a pose
    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    with_drives: bool = False  # whether deflections of drives are asked for, too

    @property
    def start(self) -> dict[str, float]:
        """Its unknowns without load."""
        return {name: start for name, (start, _) in self.legs.unknowns.items()}

    def equations(self, values: Mapping[str, Any], share: int = 1) -> _Equations:
        """At a state; at the share 0 no dead force and no preload acts, and springs are relaxed."""
        rows, twist = list(self.unloaded.space.rows), self.legs.twist
        elimination = SymmetricElimination()
        for name in twist:
            elimination.unknown(name, 1.0)
        for name, force in zip(twist, self.wrench, strict=True):
            elimination.add_right(name, force)
        legs, moment = self.legs.add_to(elimination, values, share)
        body = MovingBody(legs.state.R, legs.state.p)
        buckling = []
        if self.struts:
            more, carried = add_struts(elimination, twist, [*self.struts.values()], body)
            moment = moment + more
            for number, (t, length) in zip(self.struts, carried, strict=True):
                buckling += self.buckling[number].checks(t, length, SAFE)
        acting, turning = (x * share for x in self.dead.acting(body.R))
        moment = moment - acting[3:]
        for name, row in zip(twist, rows, strict=True):
            elimination.add_right(name, acting[row])
        turning = (turning + turning.T) * 0.5
        n = len(rows)
        K = {
            (i, j): elimination.A[twist[i]].get(twist[j], 0) for i in range(n) for j in range(i, n)
        }
        K_total = {(i, j): entry - turning[rows[i], rows[j]] for (i, j), entry in K.items()}
        right = [elimination.right[name] for name in twist]
        A = np.zeros((6, 6), dtype=int).astype(object)
        A[3:, 3:] = skew(moment * -0.5)  # of the rate of a wrench with this moment
        A = A[np.ix_(rows, rows)]
        return _Equations(elimination, K, K_total, A, right, legs, buckling)

    def first(self, values: Mapping[str, Any]) -> list[Any]:
        """The state after the first step, the linear answer; of struts after one more.

        Under the forces of the linear answer they are stiffer or softer: the step that follows need
        not be a smaller part of it.
        """
        values = {**values, **self.start, **HANDED}
        at = self.equations(values)
        twist = self.unloaded.factors.solution(self.wrench)
        if self.stands:
            twist = at.factored.solution(at.right)
        after = self.step(values, at, twist, falls=False)
        if self.struts:
            values |= zip((*self.start, *HANDED), after, strict=True)
            at = self.equations(values)
            after = self.step(values, at, at.factored.solution(at.right), falls=False)
        return after

    def sizes(self, twist: Sequence[Any]) -> list[Any]:
        """A twist in radians, shifts by the length."""
        return [
            x * (1 / self.legs.length) if row < 3 else x
            for x, row in zip(twist, self.unloaded.space.rows, strict=True)
        ]

    def step(
        self, values: Mapping[str, Any], at: _Equations, twist: list[Any], *, falls: bool = True
    ) -> list[Any]:
        """The state after a step, in the order of `start`; size, contraction, and what may follow.

        `falls`: whether it is one of Newton's, of which each has to be a smaller part than before.
        """
        full = np.zeros(6, dtype=int).astype(object)
        full[list(self.unloaded.space.rows)] = twist
        found = at.elimination.solution(dict(zip(self.legs.twist, twist, strict=True)))
        after, moved = self.legs.after_step(values, at.legs, found, full)
        moved = self.sizes(twist) + moved
        size = reduce(add, (x * x for x in moved if not is_zero(x)))
        (size, margin), part = handed_on(values, size, values[_PART]), HALF**2
        if falls:
            of_last = size / (values[LAST] + _ROUNDING)
            part = least(values[_PART], of_last * FALLS**2 + LITTLE**2)
        return [*(after[name] for name in self.start), size, margin, part]

    def arrival(self, values: Mapping[str, Any], at: _Equations) -> list[Any]:
        """What is computed in equilibrium, the flags of the unloaded posture among it.

        The step that would be next is taken with what K has more than its share of the stiffness
        without load: where that is positive, the energy of this step is at least that of the other.
        """
        unloaded = self.unloaded.K
        if self.legs.legs.springs:
            unloaded = self.equations({**values, **self.start}, share=0).K
        rest = {place: entry - unloaded[place] * SAFE for place, entry in at.K_total.items()}
        n = self.unloaded.space.size
        safe_part = factors_of(rest, n, in_order=True)
        twist = safe_part.solution(at.right)
        sizes = [x for x in self.sizes(twist) if not is_zero(x)]
        gap = reduce(add, (x * x for x in sizes)) * (1e-12 / _ARRIVED) ** 2
        safe: list[Any] = [
            *safe_part.d,
            *(pivot - _PIVOT for pivot in at.elimination.pivots if isinstance(pivot, Entry)),
            *at.elimination.still,
            *at.buckling,
            *(
                FURTHEST_TURN**2 - turn
                for turn in at.legs.terms.turns.flat
                if isinstance(turn, Entry)
            ),
            *(1 - bend for bend in self.legs.legs.bends(at.legs.state)),
            contraction(values),
        ]
        safe = [x for x in safe if isinstance(x, Entry)]
        K = [at.K[min(place), max(place)] for place in np.ndindex(n, n)]
        place = [values[name] for name in self.legs.platform.coordinates]
        arms = at.legs.state.R @ self.dead.levers
        rates = [] if self.axes is None else self._rates(values, at)
        flags = flags_of(self.unloaded)
        arms = [*arms.flat] if self.has_arms else []
        return [*K, *place, *arms, *rates, flags, gap, reduce(least, safe)]

    @property
    def has_arms(self) -> bool:
        """Whether dead forces act on the platform."""
        return not all(map(is_zero, self.dead.levers.flat))

    def _rates(self, values: Mapping[str, Any], at: _Equations) -> list[Any]:
        """Place of the unloaded platform (12), and rates with parameters: of it, and of the state.

        In equilibrium ``g(s, p) = 0`` with the tangent ``T = dg/ds`` the state moves by
        ``ds/dp = -T^-1 dg/dp``: what the next step of Newton would be of. Behind these, where
        drives are asked for, their deflections and loads, and the rates of both.
        """
        record, R = self.unloaded.record, self.axes
        unloaded = [*self.legs.platform.origin, *R.flat]
        found, drives = list(unloaded), list(self.legs.drives.values()) if self.with_drives else []
        deflections = [values[f"u{u}"] for u, _ in drives]
        stiffnesses = [k for _, k in drives]
        step: dict[int, Any] = {}
        if drives:
            twist = at.factored.solution(at.right)
            step = at.elimination.solution(dict(zip(self.legs.twist, twist, strict=True)))
        steps = [step[u] for u, _ in drives]
        loads = [k * q for k, q in zip(stiffnesses, deflections, strict=True)]
        of_drives, last = [*deflections, *loads], 12 + len(at.right)
        for along in self.parameters.values():
            quantities = [*unloaded, *at.right, *steps, *loads]
            moved = derivatives_along(record, quantities, along)
            spin = np.reshape(np.array(moved[3:12], dtype=object), (3, 3)) @ R.T
            found += [*moved[:3], spin[2, 1], spin[0, 2], spin[1, 0]]
            found += at.factored.solution(moved[12:last])
            of_steps, softer = moved[last : last + len(drives)], moved[last + len(drives) :]
            of_drives += of_steps
            of_drives += [
                k * rate + more for k, rate, more in zip(stiffnesses, of_steps, softer, strict=True)
            ]
        return found + of_drives


@frozen(kw_only=True)
class RecordedLoading(RecordedSteps):
    """Newton steps from the unloaded posture to equilibrium.

    Its inputs are coordinates of the posture, parameters, then the wrench; the first step leads to
    the linear answer.

    Attributes
    ----------
    arrival : Program
        To K (symmetric part), the shift and quaternion of the platform, where it has them the arms
        of dead forces on it (sums of ``b f^T``), the flags of the unloaded posture, the square of
        the step that would be next, and a number that is positive where all checks hold.
    has_arms : bool
    drives : tuple of str
        Whose deflections, loads and their rates stand behind those of the platform.
    status, rank : Status, int
        Without load, at a general pose.
    joints : tuple of str
        Inputs that are coordinates of the legs.
    rates : tuple of str
        The last inputs: rates of these with parameters that move them at a pose.
    closure : RecordedClosure or None
        From pose coordinates to these.
    """

    has_arms: bool
    drives: tuple[str, ...] = ()
    most_steps: int = 10
    status: Status = Status.OK
    rank: int = 6
    joints: tuple[str, ...] = ()
    rates: tuple[str, ...] = ()
    closure: RecordedClosure | None = None

    @property
    def state(self) -> dict[str, float]:
        """What the first step begins with."""
        return self.start | HANDED


def record_loading(
    robot: Robot,
    finder: PostureFinder,
    loaded_postures: Sequence[LoadedPosture],
    force: float,
    standing: StandingLoads,
    *,
    platforms: bool = False,
    drives: bool = False,
    sites: Sequence[Site] = (),
) -> RecordedLoading:
    """Record the equilibrium of a robot, whose symbols are inputs.

    `finder` and `loaded_postures` have it in numbers, the latter at several postures. Under `force`
    [N] the platform moves by about a thousandth of the robot's length. The other inputs are pose
    coordinates, or the coordinates of all legs. With `platforms` forces at hooks are inputs behind
    the wrench, and `arrival` has what `LoadedRobot._rates` gives behind the arms. Behind these are
    forces at `sites`.
    """
    gravity = acting_gravity(robot.numeric, standing.gravity, standing.loads)
    weighs = bool(np.any(gravity))
    on_legs = weighs or bool(standing.preload)
    here, closure = place_robot(robot, finder, weighs=on_legs, all_joints=True)
    record, unloaded, L = here.record, here.stiffness, finder.length
    random = np.random.default_rng(7)
    # Some samples are without load: what vanishes there is no pivot.
    shares = np.resize(np.array([0.0, 1.0, 0.5]), record.count)

    def small(size: float) -> np.ndarray:
        return shares * size * random.uniform(-1, 1, record.count)

    rows = zip(robot.space.wrench_order, robot.space.rows, strict=True)
    sizes = {name: force * (1.0 if row < 3 else L) for name, row in rows}
    wrench = [record.add_input(name, small(size)) for name, size in sizes.items()]
    hooks: Any = 0
    if platforms:
        levers = [record.add_input(name, small(force * L)) for name in HOOKS]
        hooks = here.pose.R @ np.reshape(np.array(levers, dtype=object), (3, 3))
    forces = {
        (k, site): [record.add_input(f"force{k}_{a}", small(force)) for a in "xyz"]
        for k, site in enumerate(sites)
    }
    along = _rates_along(robot, finder, here) if platforms else {}
    inputs, reference = record.inputs, here.reference
    found = _legs_on_entries(here, finder, loaded_postures[0], standing, gravity, forces)
    dead = on_platform(found.on_platform, reference)
    dead = replace(dead, levers=dead.levers + hooks)
    problems = [posture.problem for posture in loaded_postures]
    straight: dict[int, RecordedStrut] = {}
    if not drives and robot.platform is None:  # of a strut the force alone is computed
        straight = recorded_struts(found.legs, unloaded.legs, problems)
    struts = {found.legs.chains[c].owner.leg: strut for c, strut in straight.items()}
    has_loads = finder.robot.springs or standing.loads or standing.preload
    loaded = LoadedRobot(
        unloaded,
        RecordedLegs(found.legs.without([*straight]), L, force),
        struts,
        buckling_of(problems, [*struts], force),
        wrench,
        dead,
        stands=bool(has_loads or weighs or platforms or sites),
        axes=np.array(here.pose.R, dtype=object) if platforms else None,
        parameters=along,
        with_drives=drives,
    )
    for name, (value, size) in loaded.legs.unknowns.items():
        record.add_input(name, value or small(size))
    for name in HANDED:
        record.add_input(name, 1.0)
    values = {name: record.input(name) for name in record.inputs}
    at = loaded.equations(values)
    return RecordedLoading(
        inputs=inputs,
        start=loaded.start,
        step=Program.of(record, loaded.step(values, at, at.factored.solution(at.right))),
        arrival=Program.of(record, loaded.arrival(values, at)),
        first=Program.of(record, loaded.first(values), inputs=inputs),
        first_steps=2 if struts else 1,
        has_arms=loaded.has_arms,
        drives=tuple(loaded.legs.drives) if drives else (),
        status=unloaded.status,
        rank=unloaded.factors.rank,
        joints=here.joints,
        rates=inputs[len(inputs) - sum(len(rates) - 1 for rates in along.values()) :],
        closure=closure,
    )


def _legs_on_entries(
    here: RobotOnEntries,
    finder: PostureFinder,
    posture: LoadedPosture,
    standing: StandingLoads,
    gravity: np.ndarray,
    at_sites: Mapping[tuple[int, Site], list[Any]],
) -> LoadedAssembly:
    """The legs of a placed robot with what stands on it, and with forces (3,) at sites.

    `finder` and `posture` have the robot in numbers.
    """
    robot, frames = here.robot, {PLATFORM: lambda: (here.pose.R, here.pose.p), BASE: lambda: _WORLD}
    for formula in here.placed:
        frames |= {f"{formula.leg.name}/{name}": own for name, (own, _) in formula.bodies.items()}
    platform = None
    if robot.platform is not None:
        axes = np.array(here.pose.R, dtype=object)
        platform = PlacedPlatform(robot.platform, robot.holds, axes, here.pose.p)
        for node in robot.platform.nodes:
            place = axes, platform.in_world(node.at)
            frames[f"{PLATFORM}/{node.name}"] = lambda place=place: place
    forces = given_forces(standing.loads, gravity, robot.space, partial(frame_of, frames))
    for (_, (body, at)), force in at_sites.items():
        R, p = frame_of(frames, body) or _WORLD  # no body is refused later
        at_site = DeadForce(np.array(force, dtype=object), p + R @ at)
        forces[body] = (*forces.get(body, ()), at_site)
    masses = [
        PlacedMass(PLATFORM, mass.value, here.pose.p + here.pose.R @ at)
        for mass in (robot.platform_masses if np.any(gravity) else ())
        for at in (np.zeros(3) if mass.centre is None else mass.centre,)
    ]
    springs = placed_springs(finder.robot.springs, cast("Snapshot", posture.posed).springs, frames)
    return loaded_legs(
        of_legs([formula.leg for formula in here.placed], platform, masses, springs),
        RecordedElements.of(posture.problem.legs, robot.space, here.length),
        np.array(here.reference, dtype=object),
        robot.space.rows,
        forces,
        standing.preload or {},
        gravity,
        {},
        {},
    )


def _rates_along(
    robot: Robot, finder: PostureFinder, here: RobotOnEntries
) -> dict[str, dict[str, Any]]:
    """Rates of inputs with each parameter while the platform holds its pose, by name.

    Those of joints that move then are further inputs of the record, which the closure provides.
    """
    nominal, along = robot.nominal, {str(symbol): {str(symbol): 1} for symbol in robot.symbols}
    if not here.joints or robot.is_posed_by_joints:
        return along
    pose = sample_postures(finder).pose[:1, robot.coordinate_places]
    still = np.concatenate(finder.find(pose).coordinates, axis=1)
    for name, rates in along.items():
        value, q = nominal[name], np.full_like(still, np.nan)
        changed = robot.substituted({**nominal, name: value + _CHANGE * (abs(value) or 1.0)})
        with suppress(OpenAtHomeError):
            q = np.concatenate(posture_finder(changed.numeric).find(pose).coordinates, axis=1)
        if not np.allclose(q, still, rtol=0, atol=_STILL):
            rates |= {q: here.record.add_input(rate_name(q, name), 1.0) for q in here.joints}
    return along
