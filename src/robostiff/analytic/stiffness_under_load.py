"""The stiffness of a robot to first order in its load, as a formula."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import BUDGET, FormulaTooLargeError, within
from robostiff.analytic.chain import Closed, Steps
from robostiff.analytic.derivation import Derivation, Formula
from robostiff.analytic.exact.definition import Condition, Definition
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.exact.operation_count import count_of
from robostiff.analytic.legs.first_order import LoadedTerms, loaded_terms
from robostiff.analytic.placement.agreement import sampled_robots
from robostiff.analytic.placement.conditions import conditions_of
from robostiff.analytic.placement.robot_placement import PlacedRobot, place_robot
from robostiff.analytic.placement.robot_pose import AtCoordinates, AtHome, AtSymbols, PoseFormula
from robostiff.analytic.reading.record_reading import ExactReading, StepReading
from robostiff.errors import DisagreementError, InputError, NoAnswerError
from robostiff.model import Robot
from robostiff.recorded import assembled
from robostiff.spatial import Space, exact_number
from robostiff.spatial.formula import is_formula

_NUMBER = re.compile(r"\d+(\.\d*)?([eE][-+]?\d{1,2})?|\.\d+([eE][-+]?\d{1,2})?")

# Most terms of an entry by default, and operations for each of them.
_READABLE = 100
_OPERATIONS_A_TERM = 10
_LONGEST_ON_THE_WAY = 1000  # terms of a fraction from which they follow


@dataclass(frozen=True)
class StiffnessUnderLoad(Formula):
    """``K = K0 + K1``: the rate of the wrench by the twist, to first order in the load.

    Attributes
    ----------
    name : str
        Of the robot.
    where : str
        The pose, in words.
    wrench : sympy.ImmutableMatrix
        On the platform at the reference point, which moves along (n x 1), world axes.
    K0 : sympy.ImmutableMatrix
        Stiffness without load (n x n).
    K1 : sympy.ImmutableMatrix
        What the load adds (n x n), linear in it; unsymmetric under a moment.
    definitions : tuple of Definition
        Named intermediates in the order in which they can be computed; empty in closed form.
    conditions : tuple of Condition
        What must hold besides regular denominators and roots.
    meanings : mapping of str to str
        Of given symbols, such as "length, 0.35 m in the model".
    """

    name: str
    where: str
    wrench: sp.ImmutableMatrix
    K0: sp.ImmutableMatrix
    K1: sp.ImmutableMatrix
    definitions: tuple[Definition, ...] = ()
    conditions: tuple[Condition, ...] = ()
    meanings: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

    @property
    def K(self) -> sp.ImmutableMatrix:
        """K0 + K1 (n x n)."""
        return sp.ImmutableMatrix(self.K0 + self.K1)

    @property
    def derivation(self) -> Derivation:
        """K with all that it follows from, as programs are written of it."""
        K = self.K
        own: dict[str, Any] = {"conditions": self.conditions, "meanings": self.meanings}
        return Derivation(self.name, K, (), K, self.definitions, **own)

    @property
    def _computed(self) -> Derivation:
        return self.derivation

    @property
    def _expressions(self) -> list[Any]:
        conditions = [c.expression for c in self.conditions]
        return [*self.K0, *self.K1, *self.wrench, *conditions]


def stiffness_under_load(
    robot: Robot,
    loaded_K: LoadedK,
    is_beam: Callable[[np.ndarray], bool],
    wrench: Sequence[Any] | str | None = None,
    pose: PoseFormula | None = None,
    form: Closed | Steps | None = None,
    budget: float | None = BUDGET,
) -> StiffnessUnderLoad:
    """Stiffness of a robot to first order in a wrench on its platform, as a formula.

    Parameters
    ----------
    robot : Robot
    loaded_K : callable
        Stiffness under load in numbers, with which the formula is compared.
    is_beam : callable
        Whether a compliance (6, 6) is that of a beam which bending shortens.
    wrench : sequence or str, optional
        Components at the reference point: numbers, names of symbols, formulas.
    pose, form, budget
        As for `derive_robot`.

    Raises
    ------
    InputError
        When the robot is none of legs of joints and elastic parts in series, has joints that the
        platform does not hold, or does not decide its posture under this wrench.
    DisagreementError
        When the formula and equilibria differ at random parameters.
    FormulaTooLargeError
        When a closed form exceeds its limit, or its budget of time.
    """
    if not (form is None or isinstance(form, Closed | Steps)):
        raise InputError("form of a formula", got=form, expected="Closed() or Steps()")
    robot.check_platform_is_rigid("formula under load")
    robot.check_has_no_springs("formula under load")
    if robot.laws:
        raise InputError(
            f"formula of {robot.name!r} under load",
            got="force laws of joints",
            expected="drives of constant stiffness",
            hint="ask rs.equilibrium, in numbers",
        )
    space = robot.space
    load = _load(robot, wrench, space)
    at = AtHome() if pose is None else pose
    if not isinstance(at, AtHome | AtSymbols | AtCoordinates):
        raise InputError(
            "pose of a formula", got=at, expected="AtHome(), AtSymbols() or AtCoordinates({...})"
        )
    # Numbers with many roots may grow without end, in steps as well.
    enough = None if budget is None else max(budget, BUDGET)

    def recorded(*, named: bool) -> _Loaded:
        def own() -> _Loaded:
            return _Loaded.of(place_robot(robot, at, with_names=named), load, is_beam)

        return within(enough, own, "record of a formula")

    formula, own = None, recorded(named=isinstance(form, Steps))
    if not isinstance(form, Steps):
        try:
            limit = _READABLE if form is None else form.limit
            formula = within(budget, lambda: own.closed(limit))
        except FormulaTooLargeError:
            if form is not None:
                raise
            # What was stopped may have left half of a step.
            own = recorded(named=True)
    if formula is None:
        formula = within(enough, own.in_steps, "formula in steps")
    check_under_load(formula, own.placed, loaded_K)
    return formula


@dataclass(frozen=True)
class _Loaded:
    """A robot on recorded entries, with what a load adds."""

    placed: PlacedRobot
    load: list[Any]  # components of the wrench
    components: list[int]  # those that there are
    terms: LoadedTerms

    @classmethod
    def of(
        cls, placed: PlacedRobot, load: list[Any], is_beam: Callable[[np.ndarray], bool]
    ) -> _Loaded:
        robot = assembled(
            placed.entries, placed.record, placed.platform, placed.legs, placed.length
        )
        components = [i for i, x in enumerate(load) if x != 0]
        return cls(placed, load, components, loaded_terms(placed, robot, components, is_beam))

    def closed(self, limit: int) -> StiffnessUnderLoad:
        placed, terms = self.placed, self.terms
        results = [*terms.K.flat, *terms.K_by.flat]
        read = ExactReading(placed.record, placed.symbols, results, max(limit, _LONGEST_ON_THE_WAY))
        formula = self._written(read)
        if max(map(count_of, (*formula.K0, *formula.K1))) > _OPERATIONS_A_TERM * limit:
            raise FormulaTooLargeError.beyond(limit)
        return formula

    def in_steps(self) -> StiffnessUnderLoad:
        placed, terms = self.placed, self.terms
        results = [*terms.K.flat, *terms.K_by.flat]
        read = StepReading(
            placed.record,
            placed.symbols,
            results,
            placed.springs,
            at_closed_postures=placed.follows.any,
        )
        symbols = {x.name for e in self.load for x in e.free_symbols}
        if shared := sorted(symbols & {d.symbol.name for d in read.definitions}):
            raise InputError(
                "wrench of a formula",
                got=", ".join(shared),
                expected="names that no step of the formula has",
            )
        return self._written(read, read.definitions)

    def _written(
        self, read: Callable[[Any], Any], definitions: Sequence[Definition] = ()
    ) -> StiffnessUnderLoad:
        n = len(self.load)
        K1 = sp.zeros(n)
        for m, i in enumerate(self.components):
            K1 += self.load[i] * sp.Matrix(n, n, lambda a, b, m=m: read(self.terms.K_by[a, b, m]))
        K0 = sp.ImmutableMatrix(n, n, lambda a, b: read(self.terms.K[a, b]))
        return StiffnessUnderLoad(
            name=self.placed.robot.name,
            where=self.placed.where,
            wrench=sp.ImmutableMatrix(self.load),
            K0=K0,
            K1=sp.ImmutableMatrix(K1),
            definitions=tuple(definitions),
            conditions=conditions_of(self.placed),
            meanings=self.placed.meanings,
        )


def _load(robot: Robot, wrench: Sequence[Any] | str | None, space: Space) -> list[Any]:
    """Components of the wrench as expressions, symbols of the robot those of the robot."""
    names = space.wrench_order
    given: Any = names if wrench is None else wrench.split() if isinstance(wrench, str) else wrench
    if not isinstance(given, Sequence | np.ndarray | sp.MatrixBase):
        raise InputError("wrench of a formula", got=given, expected=", ".join(names))
    given = given.flat() if isinstance(given, sp.MatrixBase) else list(given)
    if len(given) == 6 and space.size == 3:
        others = [x for i, x in enumerate(given) if i not in space.rows]
        if all(x == 0 for x in others):
            given = [given[i] for i in space.rows]
    if len(given) != space.size:
        raise InputError(
            "wrench of a formula", got=f"{len(given)} components", expected=", ".join(names)
        )
    own = {x.name: x for x in robot.symbols}
    found = []
    for name, value in zip(names, given, strict=True):
        if isinstance(value, str):
            bare = value.strip().removeprefix("-").strip()
            if _NUMBER.fullmatch(bare):
                found.append(sp.Rational(value.strip()))
                continue
            if not bare.isidentifier():
                raise InputError(
                    f"{name} of the wrench",
                    got=value,
                    expected="a number, the name of a symbol such as 'F' or '-F', or a formula",
                )
            symbol = own.get(bare, sp.Symbol(bare, real=True))
            found.append(-symbol if value.strip().startswith("-") else symbol)
        elif is_formula(value):
            found.append(value.xreplace({x: own.get(x.name, x) for x in value.free_symbols}))
        else:
            found.append(exact_number(value))
    if all(x == 0 for x in found):
        raise InputError(
            "wrench of a formula",
            got="no component",
            expected="a load",
            hint="derive(robot) has the stiffness without load",
        )
    return found


#: Largest relative difference of the formula and of differences of equilibria.
_AGREED = 1e-6
_DEFLECTION = 3e-5  # of the characteristic length, or rad: of the equilibria that are compared
_ROUNDING = 1e-10  # of K: what equilibria may miss
_SPREADS = (0.02, 0.005, 0.0)  # of the parameters
_SETS = 2
_SEED = 91

#: Stiffness of a robot at a pose under a wrench, by numbers: robot, pose, wrench (n,).
LoadedK = Callable[[Robot, Any, np.ndarray], np.ndarray]


def check_under_load(formula: StiffnessUnderLoad, placed: PlacedRobot, loaded_K: LoadedK) -> None:
    """Compare with differences of equilibria at random parameters, poses and loads.

    Raises
    ------
    DisagreementError
        When they differ.
    InputError
        When no equilibrium was found.
    """
    random = np.random.default_rng(_SEED)
    checked, complaint = 0, ""
    for spread in _SPREADS:
        for _ in range(_SETS):
            try:
                robot, each = sampled_robots(placed, random, spread, 1)
                for values, pose in each:
                    _compare(formula, placed, random, loaded_K, robot, pose, values)
                    checked += 1
            except (InputError, NoAnswerError) as error:
                complaint = str(error)
            if checked >= _SETS:
                return
    if not checked:
        raise InputError(
            f"formula of {formula.name!r} under load",
            got=f"no equilibrium with which it could be compared: {complaint}",
            expected="a robot that carries small loads",
        )


def _compare(
    formula: StiffnessUnderLoad,
    placed: PlacedRobot,
    random: np.random.Generator,
    loaded_K: LoadedK,
    robot: Robot,
    pose: Any,
    values: Mapping[str, float],
) -> None:
    n = formula.K0.rows
    drawn = {x: float(random.uniform(0.5, 1.5)) for x in formula.symbols}
    known = {x: values.get(x.name, drawn[x]) for x in formula.symbols}
    numbers = values_of(
        [*formula.K0, *formula.K1, *formula.wrench], known, formula.definitions, careful=False
    )
    flat = np.array(numbers, dtype=float)
    K0, K1 = flat[: n * n].reshape(n, n), flat[n * n : 2 * n * n].reshape(n, n)
    F = flat[2 * n * n :]
    sizes = np.array([1.0 if row < 3 else 1.0 / placed.length for row in placed.entries.space.rows])
    both = np.outer(sizes, sizes)
    K_even = K0 * both
    twist = np.linalg.lstsq(K_even, F * sizes, rcond=1e-10)[0]
    share = _DEFLECTION * placed.length / float(np.max(np.abs(twist)))
    rates = [
        (loaded_K(robot, pose, s * F) - loaded_K(robot, pose, -s * F)) / (2 * s)
        for s in (share, share / 2)
    ]
    expected = (4 * rates[1] - rates[0]) / 3
    unloaded = loaded_K(robot, pose, 0 * F)
    size = float(np.max(np.abs(K_even)))
    apart = float(np.max(np.abs(K0 - unloaded) * both)) / size
    off = np.abs(K1 - expected) * both
    limit = _AGREED * float(np.max(np.abs(expected) * both)) + _ROUNDING * size / share
    if apart > _AGREED or not np.max(off) <= limit:
        i, j = np.unravel_index(np.argmax(off), off.shape)
        at = ", ".join(f"{x} = {value:.6g}" for x, value in known.items())
        raise DisagreementError(
            "the formula and equilibria under small loads",
            f"by {max(apart, float(np.max(off)) / size):.1e} of K (the change of "
            f"K{i + 1}{j + 1} is {K1[i, j]:.9g} and {expected[i, j]:.9g})",
            f"{formula.name!r} {formula.where}, at {at}",
        )
