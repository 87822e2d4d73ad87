"""The stiffness of a robot with symbols as a formula: closure, legs and sum."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from typing import Any

import sympy as sp

from robostiff.analytic.budget import (
    BUDGET,
    FormulaTooLargeError,
    OutOfTimeError,
    checked_budget,
    within,
)
from robostiff.analytic.chain import Closed, Steps
from robostiff.analytic.derivation import InNames, LegDerivation, RobotDerivation
from robostiff.analytic.exact.atoms import OutsideFieldError
from robostiff.analytic.exact.closed import closed_sum
from robostiff.analytic.exact.definition import Definition, Unwritten, used_definitions
from robostiff.analytic.legs import elastic_parts, passive_freedoms
from robostiff.analytic.placement.agreement import RobotInNumbers
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
from robostiff.analytic.placement.turned_legs import with_mirrored
from robostiff.analytic.reading.record_reading import ClosedReading, StepReading, written_size
from robostiff.analytic.series_form import is_arm, series_form
from robostiff.analytic.springs.sampled_leg import SampledLeg
from robostiff.analytic.springs.sum_of_springs import SpringLeg, sum_of_springs
from robostiff.analytic.springs.unit_wrenches import WrenchSearch
from robostiff.analytic.vectors.forms import InSeries, VectorForm
from robostiff.analytic.vectors.vector_form import vector_form
from robostiff.errors import InputError
from robostiff.model import CoupledFreedom, PlacedLeg, Robot
from robostiff.record import Entry, is_zero
from robostiff.recorded import RecordedLeg, RecordedRobot

# Most terms of an entry by default: found in a second.
_READABLE = 500
_ENTRIES = 10  # all entries of all legs have as many terms as so many: nobody reads more

# Operations of a written-out formula for each allowed term, before like terms are added.
_OPERATIONS_A_TERM = 200


def derive_robot(
    robot: Robot,
    pose: PoseFormula | None = None,
    form: Closed | Steps | None = None,
    budget: float | None = BUDGET,
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

    Returns
    -------
    RobotDerivation

    Raises
    ------
    InputError
        When the robot has symbols without a nominal value, a leg has no closed form for its
        closure away from home, or a transmitted wrench meets no compliance.
    DisagreementError
        When the formula and the numerical form differ at random parameters and poses.
    FormulaTooLargeError
        When a closed form would exceed the limit, or its budget of time; or when numbers with many
        roots grow beyond it.

    Examples
    --------
    >>> import robostiff as rs
    >>> derivation = derive_robot(rs.load("gough-stewart-b", symbols=("R", "r", "h", "k")))
    >>> derivation.K[0, 0]
    3*k*(R**2 - R*r + r**2)/(R**2 - R*r + h**2 + r**2)
    """
    pose = AtHome() if pose is None else pose
    if not isinstance(pose, AtHome | AtSymbols | AtCoordinates | AtJoints):
        raise InputError(
            "pose of a formula",
            got=pose,
            expected="AtHome(), AtSymbols(), AtCoordinates({...}) or AtJoints()",
            hint='write pose=AtCoordinates({"x": 0.1})',
        )
    if not (form is None or isinstance(form, Closed | Steps)):
        raise InputError("form of a formula", got=form, expected="Closed() or Steps()")
    if budget is not None:
        checked_budget(budget)
    _check_platform(robot)
    robot.check_has_no_springs("formula")
    # Steps have no budget, but numbers with many roots may grow without end on the way to them.
    enough = None if budget is None else max(budget, BUDGET)
    at_joints = isinstance(pose, AtJoints) and not robot.is_posed_by_joints
    is_home = isinstance(pose, AtHome) or at_joints or is_short_in_angles(robot)
    asked = isinstance(form, Steps)

    def in_series(placed: PlacedRobot) -> bool:
        # K of several links is the inverse of a sum, which no one writes out.
        return form is None and bool(placed.symbols) and is_arm(placed, links=2)

    def recorded() -> PlacedRobot:
        placed = place_robot(robot, pose)
        if not (is_home and placed.symbols) or isinstance(form, Steps) or in_series(placed):
            _ = placed.recorded
        return placed

    placed = within(enough, recorded, "record of a formula")
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
    # On a record of its own: this one has steps of the elimination, longer for the same values.
    return _in_steps(
        placed, lambda: _at_vector_level(place_robot(robot, pose)), remark, asked=asked
    )


def _readable(placed: PlacedRobot, limit: int, *, is_home: bool, closed: bool) -> RobotDerivation:
    """A sum of springs where the robot is one, a closed form otherwise."""
    if is_home and placed.robot.platform is None:
        # What is long as a sum of springs is longer as one fraction.
        with suppress(*[FormulaTooLargeError] * closed):
            derivation = _by_springs(placed)
            if derivation is not None:
                return derivation
    of_all = math.inf if closed else _ENTRIES * limit
    return _closed(placed, limit, of_all)


def _by_springs(placed: PlacedRobot) -> RobotDerivation | None:
    """Unit wrenches, and compliances that stay sums; None where a leg has no such basis."""
    if not placed.symbols:
        return None  # all of it is numbers
    space, turned = placed.entries.space, placed.turned
    legs = {i: placed.place(i).leg for i in range(len(placed.entries.legs)) if i not in turned}
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
        search = WrenchSearch(placed.record, placed.reference, space, placed.length)
        each = ((i, SampledLeg.of(own, search)) for i, own in legs.items() if in_series)
        sampled = {i: own for i, own in each if own is not None}
        turned = with_mirrored(turned, lambda i: sampled[i].stiffness, space.rows)
        found = sum_of_springs(placed, turned)
    if found is None:
        return None
    ways = [placed.turned.get(i, (i, None)) for i in range(len(placed.entries.legs))]
    if in_series:
        redundant = [sampled[first].redundant for first, _ in ways]
    else:
        redundant = [own.redundant for own in placed.recorded.legs]
    each = zip(placed.entries.legs, redundant, ways, strict=True)
    bare = [
        replace(_bare_leg(placed.place(first).leg, lost), name=leg.name)
        for leg, lost, (first, _) in each
    ]
    ways = [turned.get(i, (i, None)) for i in range(len(bare))]
    of_legs = [found.leg(first, way) for first, way in ways]
    named = tuple(_with_springs(own, leg) for own, leg in zip(bare, of_legs, strict=True))
    of_legs = list(map(found.without_names, of_legs))
    legs = [_with_springs(own, leg, found.K.rows) for own, leg in zip(bare, of_legs, strict=True)]
    plain = found.before or found
    in_names = InNames(found.K, named, found.definitions, (plain.definitions, plain.K))
    return _derivation(placed, found.K, legs, found.definitions, in_names, found.written_out)


def _with_springs(bare: LegDerivation, leg: SpringLeg, n: int = 0) -> LegDerivation:
    """With its wrenches and compliances; with K (n x n) where n is given."""

    def stiffness() -> sp.ImmutableMatrix:
        products = (w * w.T / c for w, c in zip(leg.wrenches, leg.compliances, strict=True))
        return sp.ImmutableMatrix(sum(products, sp.zeros(n)))

    wrenches, compliances = Unwritten(lambda: leg.wrenches), Unwritten(lambda: leg.compliances)
    K = Unwritten(stiffness) if n else None
    return replace(bare, wrenches=wrenches, compliances=compliances, K=K)


def _in_steps(
    placed: PlacedRobot, level: Callable[[], Any], remark: str, *, asked: bool
) -> RobotDerivation:
    """The record itself, its steps named."""
    recorded = placed.recorded
    for number, leg in enumerate(recorded.legs, start=1):
        _give_names(leg, number)
    n = recorded.space.size
    K_entries = _added(recorded)
    of_legs = [[*(x for w in leg.wrenches for x in w), *leg.mu] for leg in recorded.legs]
    results = [*K_entries.values(), *(x for leg in of_legs for x in leg)]
    reading = StepReading(
        placed.record,
        placed.symbols,
        results,
        placed.springs,
        at_closed_postures=placed.follows.any,
    )
    K = sp.ImmutableMatrix(n, n, lambda i, j: reading(K_entries[min(i, j), max(i, j)]))
    of_legs = [[reading(x) for x in leg] for leg in of_legs]
    legs = []
    each = _bare_legs(placed, recorded)
    for i, own in enumerate(_shared_out(reading.definitions, of_legs)):
        w = tuple(sp.ImmutableMatrix([reading(x) for x in w]) for w in recorded.legs[i].wrenches)
        c = tuple(reading(mu) for mu in recorded.legs[i].mu)
        legs.append(replace(each[i], wrenches=w, compliances=c, definitions=own))
    return _derivation(
        placed, K, legs, reading.definitions, remark=remark, level=level, steps_asked=asked
    )


def _added(recorded: RecordedRobot) -> dict[tuple[int, int], Any]:
    """Upper triangle of K; many wrenches that meet one compliance are divided by it as a sum."""
    groups: dict[Any, tuple[Any, list[Any]]] = {}
    for leg in recorded.legs:
        for w, mu in zip(leg.wrenches, leg.mu, strict=True):
            key = mu.step if isinstance(mu, Entry) else ("number", mu)
            groups.setdefault(key, (mu, []))[1].append(w)
    K: dict[tuple[int, int], Any] = dict.fromkeys(recorded.K, 0)
    for mu, wrenches in groups.values():
        at_last = len(K) < sum(not is_zero(x) for w in wrenches for x in w)
        first = [w if at_last else [x / mu for x in w] for w in wrenches]
        for (i, j), so_far in K.items():
            total = sum((a[i] * b[j] for a, b in zip(first, wrenches, strict=True)), 0)
            K[i, j] = so_far + (total / mu if at_last else total)
    return K


def _closed(placed: PlacedRobot, limit: int, of_all: float) -> RobotDerivation:
    """Wrenches and compliances written out and summed in exact arithmetic."""
    recorded = placed.recorded
    wanted = [x for leg in recorded.legs for x in (*(e for w in leg.wrenches for e in w), *leg.mu)]
    if written_size(placed.record, wanted) > _OPERATIONS_A_TERM * limit:
        raise FormulaTooLargeError.beyond(limit)
    read = ClosedReading(placed.record, placed.written_out)
    written = [
        ([[read(x) for x in w] for w in leg.basis], [[read(x) for x in row] for row in leg.energy])
        for leg in recorded.legs
    ]
    found = closed_sum(written, recorded.space.size, limit, of_all)
    each = zip(
        _bare_legs(placed, recorded), found.wrenches, found.compliances, found.legs, strict=True
    )
    legs = [replace(leg, wrenches=w, compliances=c, K=K) for leg, w, c, K in each]
    return _derivation(placed, found.K, legs)


def _derivation(
    placed: PlacedRobot,
    K: sp.ImmutableMatrix,
    legs: Sequence[LegDerivation],
    definitions: tuple[Definition, ...] = (),
    named: InNames | None = None,
    written_out: Callable[[Any], Any] | None = None,
    remark: str = "",
    level: Callable[[], Any] | None = None,
    *,
    steps_asked: bool = False,
) -> RobotDerivation:
    """What was found, compared with numbers; names may be written out, and compared, later."""
    numbers = RobotInNumbers.of(placed)
    numbers.check(K, definitions)
    whole: Any = K
    if written_out is not None:

        def write() -> sp.ImmutableMatrix:
            plain = written_out(K)
            numbers.check(plain)
            return plain

        whole, definitions = Unwritten(cache(write)), ()

    own: dict[str, Any] = {
        "name": placed.robot.name,
        "following": placed.following,
        "conditions": Unwritten(cache(lambda: conditions_of(placed, recorded=placed.recorded))),
        "meanings": placed.meanings,
    }

    def in_vectors() -> Any:
        form = level() if level else _at_vector_level(placed)
        return form and replace(form, **own)

    return RobotDerivation(
        **own,
        K0=whole,
        stages=(),
        K=whole,
        definitions=definitions,
        legs=tuple(legs),
        where=placed.where,
        coordinates=placed.coordinates,
        remark=remark,
        named=named and replace(named, **own),
        at_vector_level=Unwritten(in_vectors),
        general_rank=numbers.rank,
        steps_asked=steps_asked,
    )


def _at_vector_level(placed: PlacedRobot) -> VectorForm | InSeries | None:
    if placed.robot.platform is not None:
        return None
    return vector_form(placed) or series_form(placed)


def _check_platform(robot: Robot) -> None:
    """Raise where the parts of a flexible platform leave motions free."""
    for part in () if robot.platform is None else robot.platform.parts:
        if part.elasticity.freedoms.size:
            raise InputError(
                f"formula of {robot.name!r}",
                got=f"part {part.name!r} of the platform, which leaves motions free",
                expected="parts of platforms that hold in all directions",
                hint="use stiffness(robot, poses)",
            )


def _shared_out(
    definitions: Sequence[Definition], parts: Sequence[Iterable[sp.Expr]]
) -> list[tuple[Definition, ...]]:
    """For each part the definitions that it is the first to need, in order.

    Examples
    --------
    >>> a, b, c = sp.symbols("a b c")
    >>> definitions = (Definition(b, a + 1), Definition(c, b**2))
    >>> [[str(d.symbol) for d in own] for own in _shared_out(definitions, [[b], [c], [a]])]
    [['b'], ['c'], []]
    """
    shared: list[tuple[Definition, ...]] = []
    for results in parts:
        before = {d.symbol for own in shared for d in own}
        own = used_definitions(definitions, results)
        shared.append(tuple(d for d in own if d.symbol not in before))
    return shared


def _give_names(leg: RecordedLeg, number: int) -> None:
    """Names for wrenches w and compliances c."""
    several = len(leg.wrenches) > 1
    for k, (w, mu) in enumerate(zip(leg.wrenches, leg.mu, strict=True), start=1):
        own = f"{number}_{k}" if several else f"{number}"
        if isinstance(mu, Entry):
            mu.named(f"c_{own}")
        for i, x in enumerate(w, start=1):
            if isinstance(x, Entry):
                x.named(f"w_{own}_{i}")


def _bare_leg(placed: PlacedLeg, redundant: Sequence[bool]) -> LegDerivation:
    """A leg by its passive freedoms, those that are redundant, and its elastic parts."""
    joints = passive_freedoms(placed)
    lost = tuple(joint for joint, own in zip(joints, redundant, strict=True) if own)
    return LegDerivation(placed.name, joints, lost, elastic_parts(placed))


def _bare_legs(placed: PlacedRobot, recorded: RecordedRobot) -> list[LegDerivation]:
    """Each leg; of legs on a flexible platform one, together with its parts."""
    legs = [own.leg for own in placed.legs]
    if placed.robot.platform is None:
        return [_bare_leg(leg, own.redundant) for leg, own in zip(legs, recorded.legs, strict=True)]
    joints = tuple(f"{leg.name}/{joint}" for leg in legs for joint in passive_freedoms(leg))
    lost = tuple(x for x, own in zip(joints, recorded.legs[0].redundant, strict=True) if own)
    elastic = [f"{leg.name}/{part}" for leg in legs for part in elastic_parts(leg)]
    elastic += [f"platform/{part.name}" for part in placed.robot.platform.parts]
    return [LegDerivation("all legs, on the flexible platform", joints, lost, tuple(elastic))]
