"""The stiffness of a robot with symbols as a formula: closure, legs and sum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.chain import Closed, Steps
from robostiff.analytic.derivation import Definition
from robostiff.analytic.record_reading import ClosedReading, StepReading
from robostiff.analytic.robot_derivation import LegDerivation, RobotDerivation
from robostiff.analytic.robot_pose import (
    AtHome,
    PoseFormula,
    coordinate_expressions,
    platform_pose,
    posed_by_joints,
)
from robostiff.analytic.snapshot_formula import snapshot_formula
from robostiff.elasticity import Elasticity
from robostiff.errors import InputError
from robostiff.kinematics import PostureFinder
from robostiff.kinematics.formula import (
    FormulaPose,
    PlacedFormula,
    place_leg,
    place_leg_at_joints,
)
from robostiff.model import PlacedFreedom, PlacedLeg, Robot, Snapshot, with_entries
from robostiff.record import Entry, Record
from robostiff.recorded import RecordedRobot, assembled, entry_reader
from robostiff.spatial import exact_number

_SAMPLES = 5
_SPREAD = 0.03  # of the nominal values, for the samples
_SEED = 2011


def derive_robot(
    robot: Robot, pose: PoseFormula | None = None, form: Closed | Steps | None = None
) -> RobotDerivation:
    """Stiffness matrix of a robot as a formula of its symbols and of its pose.

    The legs are closed in formulas, placed, and their stiffness is found by the wrench basis form,
    K = W (W^T C W)^-1 W^T, one transmitted wrench after the other; the legs are summed about the
    reference point, eq. (12). World axes.

    Parameters
    ----------
    robot : Robot
        Its symbols have nominal values, at which branches of the closure and pivots are chosen.
    pose : AtHome, AtSymbols or AtCoordinates
        Home when left out.
    form : Closed or Steps
        One canonical expression an entry, in exact arithmetic; or named steps, which never explode.
        Closed at home and steps elsewhere when left out.

    Returns
    -------
    RobotDerivation

    Raises
    ------
    InputError
        When the robot has symbols without a nominal value, a leg has no closed form for its
        closure away from home, or a transmitted wrench meets no compliance.
    FormulaTooLargeError
        When a closed form would exceed the limit.

    Examples
    --------
    >>> import robostiff as rs
    >>> derivation = derive_robot(rs.load("gough-stewart-b", symbols=("R", "r", "h", "k")))
    >>> derivation.K[0, 0]
    3*k*(R**2 - R*r + r**2)/(R**2 - R*r + h**2 + r**2)
    """
    pose = AtHome() if pose is None else pose
    form = (Closed() if isinstance(pose, AtHome) else Steps()) if form is None else form
    placed = _placed(robot, pose)
    return placed.closed() if isinstance(form, Closed) else placed.in_steps()


@dataclass(frozen=True)
class _PlacedRobot:
    """A robot on recorded entries, placed at its pose."""

    robot: Robot
    entries: Robot
    where: str
    record: Record
    symbols: dict[str, sp.Symbol]
    platform: FormulaPose
    legs: tuple[PlacedFormula, ...]
    length: float

    @property
    def reference(self) -> np.ndarray:
        """Reference point in the world."""
        point = np.array(self.entries.reference_point, dtype=object)
        return self.platform.p + self.platform.R @ point

    def in_steps(self) -> RobotDerivation:
        """The record itself, its steps named."""
        recorded = assembled(self.entries, self.record, self.platform, self.legs, self.length)
        _give_names(recorded)
        n = recorded.space.size
        of_legs = [[x for w in leg.wrenches for x in w] + list(leg.mu) for leg in recorded.legs]
        results = [*recorded.K.values(), *(x for leg in of_legs for x in leg)]
        reading = StepReading(self.record, self.symbols, results)
        K = sp.ImmutableMatrix(n, n, lambda i, j: reading(recorded.K[min(i, j), max(i, j)]))
        parts = _shared_out(reading.definitions, self.record, of_legs)
        legs = []
        for placed, leg, own in zip(self.legs, recorded.legs, parts, strict=False):
            names = _passive(placed.leg)
            legs.append(
                LegDerivation(
                    name=leg.name,
                    joints=names,
                    redundant=tuple(
                        name for name, lost in zip(names, leg.redundant, strict=True) if lost
                    ),
                    elastic=_elastic(placed.leg),
                    wrenches=tuple(
                        sp.ImmutableMatrix([reading(x) for x in w]) for w in leg.wrenches
                    ),
                    compliances=tuple(reading(mu) for mu in leg.mu),
                    K=None,
                    definitions=own,
                )
            )
        return RobotDerivation(
            name=self.robot.name,
            K0=K,
            stages=(),
            K=K,
            definitions=reading.definitions,
            legs=tuple(legs),
            where=self.where,
        )

    def closed(self) -> RobotDerivation:
        """Entries written out, then eliminated in exact arithmetic."""
        read = ClosedReading(self.record, self.symbols)
        legs = tuple(_written(placed.leg, read) for placed in self.legs)
        snapshot = Snapshot(self.robot.name, legs, _array(self.reference, read), self.robot.space)
        formula = snapshot_formula(snapshot)
        return RobotDerivation(
            name=self.robot.name,
            K0=formula.K,
            stages=(),
            K=formula.K,
            legs=tuple(
                LegDerivation(leg.name, _passive(leg), (), _elastic(leg), (), (), K)
                for leg, K in zip(legs, formula.legs, strict=True)
            ),
            where=self.where,
        )


def _placed(robot: Robot, pose: PoseFormula) -> _PlacedRobot:
    """Record the closure of a robot on entries for its symbols."""
    twin = robot.numeric
    finder = PostureFinder(twin)
    told = coordinate_expressions(robot, pose)
    symbols = {symbol.name: symbol for symbol in robot.symbols}
    for expression in (told or {}).values():
        symbols |= {symbol.name: symbol for symbol in expression.free_symbols}
    record = Record(_samples(symbols, twin, finder))
    read = entry_reader(record, exact=True)
    exact = with_entries(robot, exact_number)
    entries = with_entries(exact, read)
    coordinates = None if told is None else {name: read(value) for name, value in told.items()}
    legs: tuple[PlacedFormula, ...]
    if posed_by_joints(robot):
        chain = entries.legs[0].chain
        q = np.array(chain.home, dtype=object)
        for i in range(chain.size):
            if coordinates is not None and f"q{i + 1}" in coordinates:
                q[i] = coordinates[f"q{i + 1}"]
        legs = (place_leg_at_joints(entries.legs[0], q),)
        platform = legs[0].platform
    else:
        home = FormulaPose(
            np.array(entries.home.R, dtype=object), np.array(entries.home.p, dtype=object)
        )
        platform = platform_pose(home, coordinates)
        legs = tuple(
            _closed_leg(leg, platform, solver, at_home=told is None)
            for leg, solver in zip(entries.legs, finder.solvers, strict=True)
        )
    return _PlacedRobot(
        robot=robot,
        entries=entries,
        where=_in_words(told),
        record=record,
        symbols=symbols,
        platform=platform,
        legs=legs,
        length=finder.length,
    )


def _closed_leg(leg: Any, platform: FormulaPose, solver: Any, *, at_home: bool) -> PlacedFormula:
    if solver.closed_form is not None:
        return place_leg(leg, platform, solver)
    if at_home:
        return place_leg_at_joints(leg, np.array(leg.chain.home, dtype=object))
    raise InputError(
        f"closure of leg {leg.name!r}",
        got="a leg without a closed form",
        expected="a strut, or a rod on a slide or a crank, away from home",
        hint="derive it at home, where its joints have the coordinates of the model",
    )


def _samples(
    symbols: Mapping[str, sp.Symbol], twin: Robot, finder: PostureFinder
) -> dict[str, Sequence[float]]:
    """Values of the symbols around the nominal ones, and of pose symbols around home."""
    random = np.random.default_rng(_SEED)
    home = _home_values(twin, finder)
    samples: dict[str, Sequence[float]] = {}
    for name in symbols:
        nominal = twin_value(name, twin, home)
        spread = _SPREAD * (abs(nominal) if nominal else 1.0)
        samples[name] = nominal + spread * random.uniform(-1, 1, _SAMPLES)
    return samples


def twin_value(name: str, twin: Robot, home: Mapping[str, float]) -> float:
    """Nominal value of a symbol, or of a pose coordinate at home."""
    if name in twin.nominal:
        return float(twin.nominal[name])
    return float(home.get(name, 1.0))


def _home_values(twin: Robot, finder: PostureFinder) -> dict[str, float]:
    if posed_by_joints(twin):
        home = twin.legs[0].chain.home
        return {f"q{i + 1}": float(q) for i, q in enumerate(home)}
    x, y, z = finder.home_pose[:3].tolist()
    return {"x": x, "y": y, "z": z, "alpha": 0.0, "beta": 0.0, "gamma": 0.0}


def _give_names(recorded: RecordedRobot) -> None:
    """Names for what a reader looks for: wrenches w, compliances c."""
    for number, leg in enumerate(recorded.legs, start=1):
        several = len(leg.wrenches) > 1
        for k, (w, mu) in enumerate(zip(leg.wrenches, leg.mu, strict=True), start=1):
            own = f"{number}_{k}" if several else f"{number}"
            if isinstance(mu, Entry):
                mu.named(f"c_{own}")
            for i, x in enumerate(w, start=1):
                if isinstance(x, Entry):
                    x.named(f"w_{own}_{i}")


def _shared_out(
    definitions: Sequence[Definition], record: Record, of_legs: Sequence[Sequence[Any]]
) -> list[tuple[Definition, ...]]:
    """Definitions by the leg that is the first to need them; the rest belongs to the sum."""
    by_name = {d.symbol.name: d for d in definitions}
    left = dict(by_name)
    parts = []
    for results in of_legs:
        own, waiting = [], [x for x in results if isinstance(x, Entry)]
        names = _needed_names(waiting, record, by_name)
        own = [d for name, d in left.items() if name in names]
        for definition in own:
            del left[definition.symbol.name]
        parts.append(tuple(own))
    return parts


def _needed_names(
    entries: Sequence[Entry], record: Record, by_name: Mapping[str, Definition]
) -> set[str]:
    """Names of all definitions on which entries depend."""
    found: set[str] = set()
    waiting = {record.names.get(entry.step) for entry in entries}
    waiting = {name for name in waiting if name in by_name}
    while waiting:
        name = waiting.pop()
        found.add(str(name))
        used = {symbol.name for symbol in by_name[str(name)].expression.free_symbols}
        waiting |= (used & by_name.keys()) - found
    return found


def _written(leg: PlacedLeg, read: ClosedReading) -> PlacedLeg:
    elements = []
    for element in leg.elements:
        point = _array(element.point, read)
        if isinstance(element, PlacedFreedom):
            role = element.role
            stiffness = getattr(role, "stiffness", None)
            if isinstance(stiffness, Entry):
                role = type(role)(stiffness=read(stiffness))
            elements.append(
                PlacedFreedom(element.name, element.motion, point, _array(element.axis, read), role)
            )
            continue
        elasticity = Elasticity(
            _array(element.elasticity.compliance, read),
            _array(element.elasticity.freedoms, read),
        )
        elements.append(
            type(element)(element.name, point, _array(element.rotation, read), elasticity)
        )
    return PlacedLeg(leg.name, tuple(elements), _array(leg.end, read))


def _array(values: np.ndarray, read: ClosedReading) -> np.ndarray:
    found = np.empty(values.shape, dtype=object)
    for place in np.ndindex(values.shape):
        found[place] = read(values[place])
    return found


def _passive(leg: PlacedLeg) -> tuple[str, ...]:
    names = []
    for element in leg.elements:
        if isinstance(element, PlacedFreedom):
            if element.is_passive:
                names.append(element.name)
        else:
            count = element.elasticity.freedoms.shape[1]
            names += [f"{element.name}.free[{i}]" for i in range(count)]
    return tuple(names)


def _elastic(leg: PlacedLeg) -> tuple[str, ...]:
    return tuple(
        element.name
        for element in leg.elements
        if not isinstance(element, PlacedFreedom) or element.stiffness is not None
    )


def _in_words(told: Mapping[str, Any] | None) -> str:
    if told is None:
        return "in the home configuration"
    return "at " + ", ".join(
        name if str(value) == name else f"{name} = {value}" for name, value in told.items()
    )
