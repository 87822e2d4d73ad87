"""The stiffness of a robot, or of a snapshot, as a formula: closure, legs and sum."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial
from itertools import chain
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analysis import stiffness
from robostiff.analytic.budget import (
    BUDGET,
    FormulaTooLargeError,
    OutOfTimeError,
    checked_budget,
    within,
)
from robostiff.analytic.chain import Closed, Steps
from robostiff.analytic.derivation import InNames, LegDerivation, RobotDerivation, SnapshotFormula
from robostiff.analytic.exact.closed import closed_sum
from robostiff.analytic.exact.definition import (
    Condition,
    Definition,
    Unwritten,
    in_given_symbols,
    used_definitions,
)
from robostiff.analytic.exact.element import OutsideFieldError
from robostiff.analytic.legs import bare_leg, bare_legs
from robostiff.analytic.modules import machine_formula
from robostiff.analytic.placement.agreement import (
    AGREED,
    Image,
    check_that_postures_differ,
    check_value,
    images_of_legs,
    numbers_of,
    random_values,
)
from robostiff.analytic.placement.conditions import conditions_of
from robostiff.analytic.placement.robot_placement import PlacedRobot, place_robot
from robostiff.analytic.placement.robot_pose import (
    AtCoordinates,
    AtHome,
    AtJoints,
    AtSymbols,
    PoseFormula,
    is_short_in_angles,
)
from robostiff.analytic.reading.record_reading import ClosedReading, StepReading, written_size
from robostiff.analytic.series_form import is_arm, series_form
from robostiff.analytic.springs.sum_of_springs import sum_of_springs
from robostiff.analytic.springs.unit_wrenches import WrenchSearch
from robostiff.analytic.vectors.forms import VectorForm
from robostiff.analytic.vectors.vector_form import vector_form
from robostiff.errors import InputError, Words
from robostiff.kept import kept
from robostiff.model import CoupledFreedom, Robot, Snapshot, with_entries
from robostiff.model.entries import formulas
from robostiff.record import Entry, Record, is_zero
from robostiff.recorded import LegRecorder, entry_reader
from robostiff.spatial import exact_number

_POSES = {"home": "AtHome()", "symbolic": "AtSymbols()", "joints": "AtJoints()"}  # by words
_READABLE = 500  # most terms of an entry by default: found in a second
_ENTRIES = 10  # all entries of all legs have as many terms as so many: nobody reads more
_OPERATIONS_A_TERM = 200  # of a formula written out, for each allowed term, before it is simplified


def derive_robot(
    robot: Robot,
    pose: PoseFormula | None = None,
    form: Closed | Steps | None = None,
    budget: float | None = BUDGET,
    known: Sequence[Definition] = (),
) -> RobotDerivation:
    """Stiffness matrix of a robot as a formula of its symbols and of its pose.

    The legs are closed in formulas, placed, and their stiffness is found by the wrench basis form,
    K = W (W^T C W)^-1 W^T, one transmitted wrench after the other; the legs are summed about the
    reference point, eq. (12). World axes. Working modes are those of home. What the legs decide,
    coordinates of joints that are found by iteration and of the platform, is a number or a formula
    where it is one; otherwise it is a symbol of its own (`RobotDerivation.following`), and the
    formula holds at values at which the legs close.

    Parameters
    ----------
    robot : Robot
        Its symbols have nominal values, at which branches of the closure and pivots are chosen.
    pose : AtHome, AtSymbols, AtCoordinates or AtJoints
        Home when left out.
    form : Closed or Steps
        One canonical expression an entry, in exact arithmetic; or named steps, which never explode.
        When left out, closed at home as long as that can be read, and steps otherwise; of a chain
        in the plane with passive joints closed at any joint coordinates.
    budget : float or None
        Seconds of computing for a closed form; None for no limit. When it does not end in time,
        the answer is in steps, and its `remark` says so; with `Closed()` it is an error.
    known : sequence of Definition
        Names of lengths and the like that it takes over, as a module does those of others.

    Raises
    ------
    InputError
        When the robot has symbols without a nominal value, a leg has no closed form for its
        closure away from home, or a transmitted wrench meets no compliance.
    DisagreementError
        When the formula and the numerical form differ at random parameters and poses.
    FormulaTooLargeError
        When a closed form would exceed its limit or budget of time, or numbers with roots a limit.
    """
    pose = AtHome() if pose is None else pose
    if not isinstance(pose, AtHome | AtSymbols | AtCoordinates | AtJoints):
        raise InputError(
            "pose of a formula",
            got=pose,
            expected="AtHome(), AtSymbols(), AtCoordinates({...}) or AtJoints()",
            hint="write pose=rs." + _POSES.get(str(pose), 'AtCoordinates({"x": 0.1})'),
        )
    if not (form is None or isinstance(form, Closed | Steps)):
        raise InputError("form of a formula", got=form, expected="Closed() or Steps()")
    if budget is not None:
        checked_budget(budget)
    for part in () if robot.platform is None else robot.platform.parts:
        if part.elasticity.freedoms.size:
            raise InputError(
                f"formula of {robot.name!r}",
                got=Words(f"part {part.name!r} of the platform, which leaves motions free"),
                expected="parts of platforms that hold in all directions",
                hint="use stiffness(robot, poses)",
            )
    robot.check_has_no_springs("formula")
    # Steps have no budget, but numbers with many roots may grow without end on the way to them.
    enough = None if budget is None else max(budget, BUDGET)
    at_joints = isinstance(pose, AtJoints) and not robot.is_posed_by_joints
    is_home = isinstance(pose, AtHome) or at_joints or is_short_in_angles(robot)
    steps_asked = isinstance(form, Steps)

    def in_series(placed: PlacedRobot) -> bool:
        # K of several links is the inverse of a sum, which no one writes out.
        return form is None and bool(placed.symbols) and is_arm(placed, links=2)

    def recorded() -> PlacedRobot:
        placed = place_robot(robot, pose).knowing(known)
        if placed.given is not None:  # before anything is closed that does not reach
            numbers_of(placed)
        if not (is_home and placed.symbols) or isinstance(form, Steps) or in_series(placed):
            _ = placed.recorded
        return placed

    placed = within(enough, recorded, "record of a formula")
    if form is None and isinstance(pose, AtHome) and robot.legs[0].chain.has_blocks:
        derive = partial(derive_robot, budget=budget)
        machine = within(enough, lambda: machine_formula(placed, derive), "formula of modules")
        if machine is not None:
            return machine
    if isinstance(form, Closed):
        limit = form.limit
        return within(budget, lambda: _readable(placed, limit, is_home=is_home, closed=True))
    remark = ""
    if form is None and is_home and robot.platform is None and not in_series(placed):
        try:
            return within(budget, lambda: _readable(placed, _READABLE, is_home=True, closed=False))
        except OutOfTimeError:
            remark = f"A closed form did not end within {budget:g} s of computing."
            # What was stopped may have left half of a step.
            form = Steps()
            placed = within(enough, recorded, "record of a formula")
        except (FormulaTooLargeError, OutsideFieldError):
            pass  # too long, or with the size of a length of either sign
    return _in_steps(placed, remark, steps_asked=steps_asked)


def _readable(placed: PlacedRobot, limit: int, *, is_home: bool, closed: bool) -> RobotDerivation:
    """A sum of springs where the robot is one, a closed form otherwise."""
    if is_home and placed.robot.platform is None:
        # What is long as a sum of springs is longer as one fraction.
        with suppress(*[FormulaTooLargeError] * closed):
            derivation = _by_springs(placed)
            if derivation is not None:
                return derivation
    of_all = math.inf if closed else _ENTRIES * limit
    return _closed_form(placed, limit, of_all)


def _by_springs(placed: PlacedRobot) -> RobotDerivation | None:
    """Unit wrenches, and compliances that stay sums; None where a leg has no such basis."""
    if not placed.symbols:
        return None  # all of it is numbers
    turned, count = dict[int, tuple[int, Image]](), len(placed.entries.legs)
    check_that_postures_differ(placed)
    with suppress(InputError):  # of a robot without an answer the wrenches say why
        turned = _legs_turned(placed)
    legs = {i: placed.place(i).leg for i in range(count) if i not in turned}
    in_series = not any(
        leg.blocks
        or any(isinstance(x, CoupledFreedom) for x in leg.parts)
        or any(x.elasticity.freedoms.shape[1] for x in leg.springs)
        for leg in legs.values()
    )
    if not in_series:
        turned, _ = {}, placed.legs
    # Neither sees steps of the other, of the same values, only longer.
    with placed.record.tentative():
        search = WrenchSearch.of(placed)
        sampled = {i: search.sampled(leg) for i, leg in legs.items() if in_series}
        found = sum_of_springs(placed, turned)
    if found is None:
        return None
    of_legs: Any = sampled if in_series else placed.recorded.legs
    named: list[LegDerivation] = []
    for i, leg in enumerate(placed.entries.legs):
        first, way = turned.get(i, (i, None))
        bare = bare_leg(placed.place(first).leg, of_legs[first].redundant)
        w, c = found.leg(first, way)
        named.append(replace(bare, name=leg.name, wrenches=w, compliances=c))
    in_names = InNames(found.K, tuple(named), found.definitions)
    full = cache(lambda: in_given_symbols(found.definitions))
    legs = [_in_given_symbols(leg, full, found.K.rows) for leg in named]
    return _derivation(placed, found.K, legs, found.definitions, in_names)


@kept
def _legs_turned(placed: PlacedRobot) -> dict[int, tuple[int, Image]]:
    """Legs that hold as an earlier one, turned or mirrored, at home."""
    numbers = numbers_of(placed)
    is_other = placed.given is not None or placed.follows.any or placed.robot.platform is not None
    if is_other or placed.robot.is_posed_by_joints or not numbers.are_general:
        return {}
    return images_of_legs(placed.robot, numbers.leg_stiffness, placed.length)


def _in_given_symbols(leg: LegDerivation, full: Callable[[], Any], n: int) -> LegDerivation:
    """A leg without names, and with K (n x n); written when it is first looked at."""

    def stiffness() -> sp.ImmutableMatrix:
        both = zip(found.wrenches, found.compliances, strict=True)
        return sp.ImmutableMatrix(sum((w * w.T / c for w, c in both), sp.zeros(n)))

    found = replace(
        leg,
        wrenches=Unwritten(lambda: tuple(w.xreplace(full()) for w in leg.wrenches)),
        compliances=Unwritten(lambda: tuple(c.xreplace(full()) for c in leg.compliances)),
        K=Unwritten(stiffness),
    )
    return found


def _in_steps(placed: PlacedRobot, remark: str, *, steps_asked: bool) -> RobotDerivation:
    """The record itself, its steps named."""
    recorded = placed.recorded
    # Wrenches and compliances; self-stresses of a loop, without a resultant, add nothing to K.
    pairs = [
        [(w, mu) for w, mu in zip(leg.wrenches, leg.mu, strict=True) if not all(map(is_zero, w))]
        for leg in recorded.legs
    ]
    for number, own in enumerate(pairs, start=1):
        for k, (w, mu) in enumerate(own, start=1):
            index = f"{number}_{k}" if len(own) > 1 else f"{number}"
            names = f"c_{index}", *(f"w_{index}_{i}" for i in range(1, len(w) + 1))
            for name, x in zip(names, (mu, *w), strict=True):
                if isinstance(x, Entry):
                    x.named(name)
    n = recorded.space.size
    # The upper triangle of K; many wrenches that meet one compliance are divided by it as a sum.
    groups: dict[Any, tuple[Any, list[Any]]] = {}
    for w, mu in chain.from_iterable(pairs):
        key = mu.step if isinstance(mu, Entry) else ("number", mu)
        groups.setdefault(key, (mu, []))[1].append(w)
    upper: dict[tuple[int, int], Any] = dict.fromkeys(recorded.K, 0)
    for mu, wrenches in groups.values():
        at_last = len(upper) < sum(not is_zero(x) for w in wrenches for x in w)
        first = [w if at_last else [x / mu for x in w] for w in wrenches]
        for (i, j), so_far in upper.items():
            total = sum((a[i] * b[j] for a, b in zip(first, wrenches, strict=True)), 0)
            upper[i, j] = so_far + (total / mu if at_last else total)
    of_legs = ([*(x for w, _ in own for x in w), *(mu for _, mu in own)] for own in pairs)
    reading = StepReading(
        placed.record,
        placed.symbols,
        [*upper.values(), *chain.from_iterable(of_legs)],
        placed.springs,
        at_closed_postures=placed.follows.any,
    )
    K = sp.ImmutableMatrix(n, n, lambda i, j: reading(upper[min(i, j), max(i, j)]))
    legs = []
    named: set[Any] = set()
    for leg, own in zip(bare_legs(placed, recorded), pairs, strict=True):
        w = tuple(sp.ImmutableMatrix([reading(x) for x in w]) for w, _ in own)
        c = tuple(reading(mu) for _, mu in own)
        used = used_definitions(reading.definitions, [*(x for v in w for x in v.flat()), *c])
        new = tuple(d for d in used if d.symbol not in named)  # that the leg is the first to need
        named |= {d.symbol for d in new}
        legs.append(replace(leg, wrenches=w, compliances=c, definitions=new))
    parts = placed, K, legs, reading.definitions
    return _derivation(*parts, remark=remark, in_steps=True, steps_asked=steps_asked)


def _closed_form(placed: PlacedRobot, limit: int, of_all: float) -> RobotDerivation:
    """Wrenches and compliances written out and summed in exact arithmetic."""
    recorded = placed.recorded
    wanted = [x for leg in recorded.legs for x in (*(e for w in leg.wrenches for e in w), *leg.mu)]
    if written_size(placed.record, wanted) > _OPERATIONS_A_TERM * limit:
        raise FormulaTooLargeError.beyond(limit)
    read = ClosedReading(placed.record, placed.written_out)
    found = closed_sum(_in_formulas(recorded.legs, read), recorded.space.size, limit, of_all)
    bare = bare_legs(placed, recorded)
    each = zip(bare, found.wrenches, found.compliances, found.legs, strict=True)
    legs = [replace(leg, wrenches=w, compliances=c, K=K) for leg, w, c, K in each]
    return _derivation(placed, found.K, legs)


def _in_formulas(legs: Sequence[Any], read: ClosedReading) -> list[Any]:
    """Of each leg the wrenches that it transmits, and what they meet."""
    both = ((leg.basis, leg.energy) for leg in legs)
    return [[[[read(x) for x in row] for row in rows] for rows in matrices] for matrices in both]


def _derivation(
    placed: PlacedRobot,
    K: sp.ImmutableMatrix,
    legs: Sequence[LegDerivation],
    definitions: tuple[Definition, ...] = (),
    named: InNames | None = None,
    *,
    remark: str = "",
    in_steps: bool = False,
    steps_asked: bool = False,
) -> RobotDerivation:
    """What was found, compared with numbers; names may be written out, and compared, later."""
    numbers = numbers_of(placed)
    numbers.check(K, definitions)

    def conditions() -> tuple[Condition, ...]:
        # Mirror images of one leg are turns of one another.
        kinds: dict[Any, list[int]] = {}
        for i, (first, way) in _legs_turned(placed).items():
            is_image = way.mirror is not None
            kinds.setdefault((first, is_image), [] if is_image else [first]).append(i)
        firsts = {i: kind[0] for kind in kinds.values() for i in kind}
        return conditions_of(placed, None, firsts)

    whole: Any = K
    if named is not None:

        def write() -> sp.ImmutableMatrix:
            plain = K.xreplace(in_given_symbols(named.definitions))
            numbers.check(plain)
            return plain

        whole, definitions = Unwritten(cache(write)), ()

    about: dict[str, Any] = {
        "name": placed.robot.name,
        "following": placed.following,
        "conditions": Unwritten(cache(conditions)),
        "meanings": placed.meanings,
    }

    def in_vectors() -> VectorForm | None:
        if placed.robot.platform is not None:
            return None
        # On a record of its own: that of steps has longer ones for the same values.
        at = place_robot(placed.robot, placed.pose) if in_steps else placed
        at = at.knowing(named.definitions if named else ())
        form = vector_form(at) or series_form(at)
        if form is not None:
            numbers.check(form.K, form.definitions)
        return form and replace(form, **about)

    return RobotDerivation(
        **about,
        K0=whole,
        stages=(),
        K=whole,
        definitions=definitions,
        legs=tuple(legs),
        where=placed.where,
        coordinates=placed.coordinates,
        remark=remark,
        named=named and replace(named, **about),
        at_vector_level=Unwritten(in_vectors),
        general_rank=max(int(result.rank) for _, result, _ in numbers.places),
        steps_asked=steps_asked,
    )


_LIMIT = 1_000_000  # terms that an entry may have on the way
_SAMPLES = 5
_SEED = 11


def snapshot_formula(snapshot: Snapshot) -> SnapshotFormula:
    """Stiffness of a robot whose points, axes and springs are formulas, K = W (W^T C W)^-1 W^T.

    Recorded as a robot is, and written out in exact arithmetic.

    Parameters
    ----------
    snapshot : Snapshot
        One pose; its arrays hold SymPy expressions, numbers or both. Axes are unit vectors, and
        square roots in them are kept with their relation.

    Returns
    -------
    SnapshotFormula

    Raises
    ------
    DisagreementError
        When formula and numerical form differ at random values of the symbols.
    InputError
        When a transmitted wrench meets no compliance, so that no matrix exists, or the platform
        is flexible.
    """
    if snapshot.platform is not None:
        raise InputError(
            f"formula of snapshot {snapshot.name!r}",
            got=Words("a flexible platform"),
            expected="a rigid one",
            hint="use stiffness(snapshot), or derive(robot) of a model file",
        )
    given = list(formulas(snapshot))
    drawn = list(random_values(given, _SEED))
    if len(drawn) < _SAMPLES:
        raise _without_values(snapshot, "entries without a real value")
    symbols = {str(x): x for x in drawn[0][0]}
    samples = drawn[:_SAMPLES]
    record = Record({name: np.array([at[x] for at, _ in samples]) for name, x in symbols.items()})
    twin = _in_numbers(snapshot, given, drawn[0][1])
    exact = with_entries(snapshot, exact_number)
    entries = with_entries(exact, entry_reader(record, exact=True))
    length = float(twin.characteristic_length) or 1.0
    recorder = LegRecorder(record, entries.reference_point, snapshot.space, length)
    read = ClosedReading(record, symbols)
    legs = [recorder.leg(leg) for leg in entries.legs]
    found = closed_sum(_in_formulas(legs, read), snapshot.space.size, _LIMIT)
    # Compared with the numerical form at random values of the symbols.
    for values, numbers in random_values(given, _SEED + 1):
        try:
            twin = _in_numbers(snapshot, given, numbers)
            result = stiffness(twin)
        except InputError:  # such as a compliance that is not positive at these values
            continue
        if result.answered:
            where, length = f"snapshot {snapshot.name!r}", float(twin.characteristic_length) or 1.0
            check_value(found.K, (), values, result.K, AGREED, where, length)
            return SnapshotFormula(found.K, found.legs, name=snapshot.name)
    raise _without_values(snapshot, "no stiffness to compare with")


def _in_numbers(snapshot: Snapshot, entries: list[Any], values: np.ndarray) -> Snapshot:
    known = dict(zip(entries, values.tolist(), strict=True))
    return with_entries(snapshot, lambda x: known.get(x, x))


def _without_values(snapshot: Snapshot, got: str) -> InputError:
    return InputError(
        f"formula of snapshot {snapshot.name!r}",
        got=Words(f"{got} at random values of its symbols between 0.1 and 1.5"),
        expected="formulas that hold there: scale lengths to metres near 1",
    )
