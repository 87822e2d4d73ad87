"""Conditions for the formula of a robot: its parts exist, and its legs close."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from itertools import combinations
from operator import add
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD, solve_snapshot
from robostiff.analytic.exact.closed import factored_fraction
from robostiff.analytic.exact.definition import Condition, count_of
from robostiff.analytic.placement.closed_posture import gap_of
from robostiff.analytic.placement.robot_placement import PlacedRobot, home_frame
from robostiff.analytic.placement.robot_pose import platform_pose
from robostiff.analytic.reading.record_reading import ClosedReading
from robostiff.analytic.reading.rewriting import shortest_trigonometry
from robostiff.elastostatics.tolerance import DEFAULT_TOLERANCE
from robostiff.errors import OpenAtHomeError
from robostiff.kinematics import FormulaPose, place_leg, posture_finder
from robostiff.kinematics.closure.body import tidy_numbers
from robostiff.kinematics.formula import place_leg_at_joints
from robostiff.kinematics.formula_modes import other_modes
from robostiff.model import CoupledFreedom, PlacedFreedom, PlacedLeg, with_entries
from robostiff.model.entries import bounds_of
from robostiff.record import Entry, Operation, Record, is_zero
from robostiff.recorded import LegRecorder, RecordedLeg, entry_reader
from robostiff.recorded.elimination import Transmitted, WorkingFrame, local_leg, transmitted_by
from robostiff.recorded.leg import at_samples, lower_bound
from robostiff.spatial import cross, exact_number
from robostiff.spatial.batch import poses_side_by_side

# Square of the largest gap of a closed leg, relative to the length, or rad
_CLOSED = sp.Rational(1, 10**14)
_STRETCHED = sp.Rational(1, 10**14)  # square of a sine
_SHORT = 80  # operations that are worth to be multiplied out
_SAME = 1e-9
_ALIKE = 1e-6  # ratios of squares that differ by a number
_ROUNDING = sp.Rational(1, 10**12)  # of what may be at a bound
_AWAY = 0.05
_SEED = 5


def conditions_of(
    placed: PlacedRobot, only: str | None = None, firsts: Mapping[int, int] | None = None
) -> tuple[Condition, ...]:
    """Conditions in the given symbols, beside denominators that do not vanish; of one leg alone.

    `firsts`: numbers of legs that are turned with those of the legs from which they are.

    Where the legs decide some of the symbols, the formula is right only for values at which they
    close; the gaps say so. They are written at postures that are not closed, as they would vanish
    at those of the record.
    """
    read = ClosedReading(placed.record, placed.written_out)
    names = [leg.name for leg in placed.robot.legs]
    wanted = [i for i, name in enumerate(names) if only in (None, name)]
    part = placed.robot if only is None else placed.robot.legs[wanted[0]]
    found: list[Condition] = []
    known: set[Any] = set()
    # That parts exist: a wall leaves a hollow, a stiffness is positive. Once of legs alike.
    for name, bounds in bounds_of(part, part.name):
        is_open = bounds.is_open and bounds.subject != "mass"  # K has no mass
        for words, difference in bounds.differences.items() if is_open else ():
            expression: Any = difference + _ROUNDING if bounds.or_at else difference
            if not expression.is_positive and expression not in known:
                known.add(expression)
                subject = f"{bounds.subject} of {name!r}"
                found.append(Condition(f"{subject} is {words}", _decisive(expression)))
    of_firsts: dict[int, list[Condition]] = {}  # a leg that is turned has those of the first
    for i in wanted:
        first = (firsts or {}).get(i, i)
        if placed.robot.legs[i].chain.has_blocks:  # whose words name branches
            first = i
        if first not in of_firsts:
            of_firsts[first] = list(_of_leg(placed, first, read, is_alone=only is not None))
        for c in of_firsts[first]:
            words = c.words.replace(f"leg {c.leg!r}", f"leg {names[i]!r}")
            found.append(replace(c, words=words, leg=names[i]) if i != first else c)
    found += _nearest_to_home(placed, {names[i] for i in wanted}, read)
    return (*found, *(_following(placed, read) if placed.following else ()))


def _of_leg(
    placed: PlacedRobot, number: int, read: ClosedReading, *, is_alone: bool
) -> Iterator[Condition]:
    """That a leg reaches, closes, and that its passive joints are independent.

    `is_alone`: whether it is eliminated joint by joint, so that any of these may be redundant.
    """
    leg = placed.place(number)
    name = leg.leg.name
    for length in leg.lengths:
        if isinstance(length, Entry) and lower_bound(placed.record, length.step) < 0:
            words = f"a beam of a telescope of leg {name!r} has a positive length"
            # Squares of lengths are multiplied out where that is shorter.
            expression: Any = read(length)
            short: dict[Any, Any] = {}
            for root in expression.atoms(sp.Pow):
                if root.exp == sp.S.Half and count_of(root.base) <= _SHORT:
                    found = shortest_trigonometry(factored_fraction(root.base))
                    short[root] = min(root, sp.sqrt(found), key=count_of)
            yield Condition(words, expression.xreplace(short), leg=name)
    if not placed.following:
        yield from _closing(name, leg.gap, read)
    stretched = list(_conditions_of_stretch(leg.leg, read))
    yield from (condition for condition, _ in stretched)
    # Legs on a flexible platform are eliminated as one.
    if not is_alone and placed.robot.platform is None:
        joints = (
            placed.eliminated[number]
            if placed.eliminated
            else _transmitted_wrenches(placed, leg.leg)
        )
        yield from _independent(name, joints, read, stretched)


def _nearest_to_home(
    placed: PlacedRobot, wanted: Container[str], read: ClosedReading
) -> Iterator[Condition]:
    """That numbers choose the assembly modes of the formula: at home, by home coordinates.

    Modes count that have another stiffness at values nearby.
    """
    if not placed.symbols or not any(x.recorded_form for x in placed.solvers):
        return
    names = {str(x) for x in placed.robot.symbols}
    values = {x: float(placed.record.input(x).sample[0]) for x in names}
    robot = placed.robot.substituted(values)
    try:
        finder = posture_finder(robot)
        at = [x.home for x in finder.solvers]
    except OpenAtHomeError:  # there is no home near the nominal values, where numbers begin
        return
    home = FormulaPose(*home_frame(placed.entries))
    every = list(zip(placed.entries.legs, placed.solvers, finder.solvers, strict=True))
    modes: dict[int, dict[Any, np.ndarray]] = {}
    for i, (leg, solver, near) in enumerate(every):
        if solver.recorded_form is not None and leg.name in wanted:
            close = dict(zip(*near.that_close(finder.home_pose), strict=True))
            modes[i] = {x: close[x] for x in solver.modes if x in close}
    postures = [[*at[:i], q, *at[i + 1 :]] for i, close in modes.items() for q in close.values()]
    matrices: Iterator[np.ndarray] = iter(())
    if postures:  # at home (m, n, n); no numbers where it has none
        request: Any = finder.request(np.tile(finder.home_pose, (len(postures), 1)))
        rows = [poses_side_by_side(np.array(q), 1) for q in zip(*postures, strict=True)]
        posture = finder.placed((len(postures),), request.coordinates, request.R, rows)
        answer = solve_snapshot(posture.snapshot, DEFAULT_METHOD, DEFAULT_TOLERANCE)
        matrices = iter(np.where(answer.answered[:, None, None], answer.matrix, np.nan))
    for i, close in modes.items():
        leg, solver, _ = every[i]
        form, K = solver.recorded_form, dict(zip(close, matrices, strict=False))
        if form is None or form.mode not in K:
            continue
        K_here = K[form.mode]
        scale = _SAME * np.abs(K_here).max()
        others = [x for x in K if not np.abs(K[x] - K_here).max() <= scale]
        words = (
            f"leg {leg.name!r} at home is nearer to its home coordinates than in another posture"
        )
        found: dict[Any, None] = {}
        for other in other_modes(leg, home, solver, others):
            ways = other.nearer, other.inside, other.other_inside
            nearer, inside, outside = ([sp.sympify(read(x)) for x in entries] for entries in ways)
            outside = [-x for x in outside]
            if other.inside:  # within its limits, or both without: then the nearer one
                within = _all_of(inside)
                nearer = [_any_of((x, _all_of((_any_of(outside), within)))) for x in nearer]
                nearer.append(_any_of((*outside, within)))
            found |= dict.fromkeys(nearer)
        open_ones = [x for x in found if not x.is_positive]
        yield from (Condition(words, _decisive(x), leg=leg.name) for x in open_ones)


def _any_of(values: Iterable[Any]) -> Any:
    """What is positive where one of them is."""
    values = list(values)
    # A long difference stays as it is: SymPy would multiply it out to find its sign.
    joined = reduce(lambda a, b: (a + b + sp.Abs(a - b, evaluate=False)) / 2, values)
    return next((x for x in values if x.is_positive), joined)


def _all_of(values: Iterable[Any]) -> Any:
    """What is positive where all of them are."""
    return -_any_of([-x for x in values])


def _transmitted_wrenches(placed: PlacedRobot, leg: PlacedLeg) -> Transmitted:
    """Wrenches that a leg transmits, in the frame in which fewest entries of its twists vary."""
    record, length, space = placed.record, placed.length, placed.entries.space
    recorder = LegRecorder(record, placed.reference, space, length)
    passive = tuple(f for f in leg.freedoms if f.is_passive)
    if not passive:
        return Transmitted([], [], (), ())
    e, p = (at_samples([getattr(f, x) for f in passive], record.count) for x in ("axis", "point"))

    def varying(frame: WorkingFrame) -> int:
        R, at = at_samples(frame.R, record.count), at_samples(frame.p, record.count)
        twists = np.stack([e, np.cross(p - at[:, None], e) / length], axis=1) @ R[:, None]
        return int(np.sum(np.ptp(twists, axis=0) > _SAME))

    frame = min(recorder.frames(leg), key=varying)
    local = local_leg(replace(leg, elements=passive), frame, record, length)
    twists = [[twist[row] for row in space.rows] for twist in local.twists]
    scale = [1.0 if row < 3 else length for row in space.rows]
    return transmitted_by(twists, np.eye(len(scale), dtype=int).tolist(), scale)


def _independent(
    name: str,
    leg: RecordedLeg | Transmitted,
    read: ClosedReading,
    stretched: Sequence[tuple[Condition, np.ndarray]],
) -> Iterator[Condition]:
    """That no further passive joint of a leg depends on those before it: it would transmit more.

    `stretched`: the conditions that are there, see `_conditions_of_stretch`.
    """
    known, product, record = [1.0, *(x for _, x in stretched)], sp.Integer(1), read.record
    # What its wrenches are divided by and does not vanish, at the samples, and the squares of it.
    entries = (x for w in leg.wrenches for x in w)
    for step in record.steps_needed(x.step for x in entries if isinstance(x, Entry)):
        if record.operations[step] is Operation.RECIPROCAL:
            at = record.sample(record.arguments(step)[0])
            known += [at, at**2]
    expressions = [condition.expression for condition, _ in stretched]
    for entry in leg.alone:
        at = entry.sample if isinstance(entry, Entry) else np.ones(1)
        with np.errstate(all="ignore"):
            ratios = [np.abs(at / x) for x in known]
        if any(np.ptp(x) <= _ALIKE * np.max(x) for x in ratios):  # they differ by a number alone
            continue
        known.append(at)
        square = sp.sympify(read(entry))
        if _may_vanish(square, expressions):
            product *= square / sp.Integer(10) ** int(np.log10(np.mean(at)))
    if product != 1:
        words = f"the passive joints of leg {name!r} are independent"
        yield Condition(words, product - _STRETCHED, leg=name)


def _may_vanish(square: Any, positive: Sequence[Any]) -> bool:
    """Whether a square may be zero where expressions are positive that conditions have."""
    if count_of(square) > _SHORT:
        return not square.is_positive
    above = sp.fraction(sp.together(square))[0]
    if above.atoms(sp.sin, sp.cos):
        above = sp.collect(
            above, [x for x in square.free_symbols if x.is_positive], shortest_trigonometry
        )
    elif not above.is_positive and count_of(above) <= _SHORT:
        above = factored_fraction(above)
    factors = [x.as_base_exp()[0] for x in sp.Mul.make_args(above)]
    return not all(x.is_number or x.is_positive or {x, -x} & {*positive} for x in factors)


def _conditions_of_stretch(
    leg: PlacedLeg, read: ClosedReading
) -> Iterator[tuple[Condition, np.ndarray]]:
    """That no passive joints in a plane or about a point depend on others: they transmit more.

    Each with the values at the samples of the square that vanishes where they do.
    """
    for block in leg.blocks:
        for branch in block.branches:
            yield from _conditions_of_stretch(branch, read)
    free = (x for x in leg.own_parts if isinstance(x, PlacedFreedom) and x.is_passive)
    single = [x for x in free if not isinstance(x, CoupledFreedom) and not (x.turns and x.slides)]
    for some in (*combinations(single, 2), *combinations(single, 3)):
        sides = _sides_of(some)
        if sides is None:
            continue
        a, b = sides
        squares = tidy_numbers(np.array([a @ a, b @ b, (a - b) @ (a - b)], dtype=object))
        aa, bb, ab = at_samples(squares, read.record.count).T
        area = aa * bb - ((aa + bb - ab) / 2) ** 2
        if np.ptp((aa + bb - ab) ** 2 / (aa * bb)) <= _SAME:
            continue  # an angle between axes of one joint
        aa, bb, ab = (sp.sympify(read(x)) for x in squares)
        names = ", ".join(x.name for x in some)
        words = f"joints {names} of leg {leg.name!r} are independent"
        if len(some) == 3 and all(x.turns for x in some):
            words = f"leg {leg.name!r} is neither stretched nor folded"
        square = aa * bb - ((aa + bb - ab) / 2) ** 2
        short = not square.atoms(sp.sin, sp.cos) and count_of(square) <= _SHORT
        product = factored_fraction(square) if short else square
        factors = [x for x in sp.Mul.make_args(product) if x.free_symbols]
        # A difference of squares may be more than nothing by its rounding; its factors are not.
        found = square - _STRETCHED * aa * bb if len(factors) == 1 else _decisive(product)
        yield Condition(words, found, leg=leg.name), area
        # A symbol that is positive may be given as zero, and K has another limit there.
        for x in factors:
            if x.as_base_exp()[0].is_Symbol and x.is_positive:
                yield Condition(words, x.as_base_exp()[0], leg=leg.name), area


def _decisive(expression: Any) -> Any:
    """The factors of an expression that decide whether it is positive; of a root its square."""
    number, rest = expression.as_independent(*expression.free_symbols, as_Add=False)
    sign = -1 if number.is_negative else 1 if number.is_positive else number
    unknown: list[Any] = [x for x in sp.Mul.make_args(rest) if not x.is_positive]
    roots = [x for x in unknown if x.is_Pow and abs(x.exp) == sp.S.Half]
    above = [x.base for x in roots if x.exp.is_positive]
    if len(roots) == len(unknown) and len(above) == 1 and sign == 1:
        below = [x.base for x in roots if x.exp.is_negative]
        if all((x - above[0]).is_nonnegative for x in below):
            return above[0]
    return sign * sp.Mul(*unknown).primitive()[1]


def _sides_of(some: Sequence[PlacedFreedom]) -> tuple[Any, Any] | None:
    """Two sides of a triangle without area where two or three joints depend; None of others.

    Of turns about one point they are axes: two that coincide, or three in a plane. Of three joints
    in a plane they are motions of the axis of one turn by the two others.
    """
    if all(
        x.turns and all(is_zero(y) for y in tidy_numbers(x.point - some[0].point)) for x in some
    ):
        a, b = some[0].axis, some[-1].axis
        return (cross(some[1].axis, a), cross(some[1].axis, b)) if len(some) == 3 else (a, b)
    turning = [x for x in some if x.turns]
    if not turning or len(some) < 3:
        return None
    middle = turning[len(turning) // 2]
    others = [x for x in some if x is not middle]
    across = [cross(middle.axis, x.axis) if x.turns else [middle.axis @ x.axis] for x in others]
    if not all(is_zero(x) for x in tidy_numbers(np.concatenate(across))):
        return None
    arms = (x.point - middle.point if x.turns else cross(middle.axis, x.axis) for x in others)
    a, b = (cross(middle.axis, x) for x in arms)
    return a, b


def _closing(name: str, gap: Sequence[Any], read: ClosedReading) -> list[Condition]:
    entries = [x for x in gap if isinstance(x, Entry)]
    if not entries:
        return []
    total = read(reduce(add, entries))
    if not total.free_symbols:
        return []
    return [Condition(f"leg {name!r} meets the platform", _CLOSED - total, leg=name)]


def _following(placed: PlacedRobot, read: ClosedReading) -> list[Condition]:
    """Conditions that the legs close at the values of the symbols that follow from them."""
    random = np.random.default_rng(_SEED)
    inputs = {}
    for name in placed.record.inputs:
        usual = placed.record.input(name).sample
        inputs[name] = usual + _AWAY * (np.abs(usual) + 1.0) * random.uniform(-1, 1, usual.shape)
    record = Record(inputs)
    entry = entry_reader(record, exact=True)
    robot = with_entries(with_entries(placed.robot, exact_number), entry)
    given = placed.given
    coordinates = None if given is None else {name: entry(x) for name, x in given.items()}
    again = ClosedReading(record, placed.written_out)
    each = {
        i: np.array([entry(read(x)) for x in q], dtype=object) for i, q in placed.closed.items()
    }
    if placed.follows.at_joints:
        platform = place_leg_at_joints(robot.legs[0], each[0]).platform
    else:
        home = FormulaPose(*home_frame(robot))
        platform = platform_pose(home, coordinates, placed.rotation)
    found, following = [], {placed.record.input(name).step for name in placed.following}
    for i, leg in enumerate(robot.legs):
        if i in placed.closed:
            q = each[i]
            of_first = i == 0 and placed.follows.at_joints
            steps = [x.step for x in placed.closed[i] if isinstance(x, Entry)]
            if of_first or following.isdisjoint(placed.record.steps_needed(steps)):
                continue
            gap = gap_of(leg, q, platform.R, platform.p, placed.length)
            if placed.follows.at_joints:
                end = place_leg_at_joints(leg, q).platform
                equations = _differences(end, platform, again)
                found += [replace(x, equations=equations) for x in _closing(leg.name, gap, again)]
                continue
        else:
            gap = place_leg(leg, platform, placed.solvers[i]).gap if placed.follows.pose else ()
        found += _closing(leg.name, gap, again)
    return found


def _differences(a: FormulaPose, b: FormulaPose, read: ClosedReading) -> tuple[Any, ...]:
    """What vanishes where two legs hold the platform in one place, each once up to its sign."""
    found: list[Any] = []
    for x, y in zip([*a.p, *a.R.flat], [*b.p, *b.R.flat], strict=True):
        each: list[Any] = [sp.sympify(read(z)) for z in (x, y)]
        terms = [[shortest_trigonometry(t) for t in sp.Add.make_args(z)] for z in each]
        one, other = (shortest_trigonometry(sp.Add(*z)) for z in terms)
        difference = one - other
        if difference.free_symbols and not {difference, -difference} & set(found):
            found.append(difference)
    return tuple(found)
