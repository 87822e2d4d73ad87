"""Paths of equilibria along a growing load, and the critical points on them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import cast

import numpy as np
from numpy.polynomial import Polynomial

from robostiff.frozen import frozen, replace
from robostiff.kinematics.turn import turn_by_vector
from robostiff.statics.equations.newton import (
    CAP,
    SHARP,
    TURNS,
    FoundEquilibrium,
    PathStep,
    equilibrium_at,
)
from robostiff.statics.equations.problem import EquilibriumProblem, LoadCase, solve_least
from robostiff.statics.equations.stability import (
    CriticalPoint,
    Regular,
    least_margin,
    leg_margins,
    may_be_singular,
    meets_stiffness,
    point_at,
)

# Of the margins around a critical point: where interpolation begins, and how many are tried before
# the interval is halved, and then.
_SMALL, _TRIALS, _HALVES = 1e-4, 30, 30
# Margin up to which equilibria around a critical point are taken, where on the arc, and how many
# are enough; how often the way there is corrected, and by what part of that margin they may be off
# a smooth way; and the margin below which equations are nearly singular.
_WIDE, _SECANTS, _SMOOTH, _BLURRED, _ENOUGH = 0.03, 2, 1e-5, 1.5e-3, 5
_NODES = 0.5 - 0.5 * np.cos(np.pi * (2 * np.arange(8) + 1) / 16)
# Of the interval: so far beside a point at which equations are singular.
_ASIDE = 1e-3
# Lateral parts of an arc, and of the length of the robot, by which equilibria are on one branch.
_TORN, _SAME = 10.0, 1e-6
# Of the arc to where none are: how far they are followed. Small margins up to which there may be
# none, equations being singular.
_TOWARDS, _NEARLY = 0.9, 100.0
# Of a step: where equilibria around a singular posture are looked for, and how near to it, of the
# determinant of closures before it, they are none.
_AROUND, _BESIDE = 1.5 * (0.5 - 0.5 * np.cos(np.pi * (np.arange(12) + 0.5) / 12)), 0.1


def refined(step: PathStep) -> CriticalPoint | float:
    """Where the margin vanishes between a stable and an unstable equilibrium, in either order.

    By polynomials on a smooth way; elsewhere by regula falsi (Illinois) up to where equations are
    nearly singular, and the load factor is interpolated from there. A margin that leaps past zero,
    where a leg turns singular, is enclosed by halves. Where equilibria leap to another branch, or
    there are none, an arc before that.
    """
    smooth = _on_a_smooth_way(step)
    if smooth is not None:
        return smooth
    problem, left, right, at_ends = step.here.problem, 0.0, step.arc, [step.here, step.found]
    found = step.found
    at_left, at_right = (least_margin(end).value for end in at_ends)
    best = min(at_ends, key=lambda end: abs(least_margin(end).value))
    smallest = min(abs(at_left), abs(at_right))
    small = _SMALL * min(1.0, max(abs(at_left), abs(at_right)))
    factors = {at_left: step.here.factor, at_right: found.factor}
    for trial in range(_TRIALS + _HALVES):
        h = (left * at_right - right * at_left) / (at_right - at_left)
        if trial >= _TRIALS:
            h = 0.5 * (left + right)
        found = step.along(h)
        if not found.converged:  # equations that are singular to rounding: a little aside
            h += _ASIDE * (left - h)
            found = step.along(h)
        one, other = (end.displacement * problem.scale for end in at_ends)
        near = _TORN * step.unit * abs(right - left) + _SAME * problem.length
        if not found.converged and smallest < _NEARLY * small:
            break
        if not found.converged or np.linalg.norm(one - other) > near:
            return _TOWARDS * h
        value = least_margin(found).value
        factors[value] = found.factor
        if abs(value) < smallest:
            smallest, best = abs(value), found
        if smallest < small:
            # A leg that buckles alone may follow the platform: then that lost its margin before.
            before = step.along(h + _ASIDE * (left - h))
            earlier = least_margin(before).value if before.converged else value
            if abs(earlier) <= 10 * small or earlier * at_left > 0:
                break
            h, found, value, smallest = h + _ASIDE * (left - h), before, earlier, np.inf
            factors = {margin: factor for margin, factor in factors.items() if margin * at_left > 0}
        if value * at_right < 0:
            left, at_left, at_ends[0] = right, at_right, at_ends[1]
        else:
            at_left *= 0.5
        right, at_right, at_ends[1] = h, value, found
    else:
        # It leaps at a corner, as where a cable becomes slack: the mode is that behind it.
        leaving = min(at_ends, key=lambda end: least_margin(end).value)
        return point_at(leaving)
    # the polynomial through the four points nearest to it
    nearest = sorted(factors.items(), key=lambda pair: abs(pair[0]))[:4]
    margins, values = zip(*nearest, strict=True)
    through = Polynomial.fit(margins, values, len(margins) - 1)
    return replace(point_at(best), factor=float(through(0.0)))


def _on_a_smooth_way(step: PathStep) -> CriticalPoint | None:
    """Where the margin vanishes, by polynomials through equilibria around it; None without them.

    Nearer to it equations are nearly singular, and equilibria may be those of another branch.
    """
    left, right = (0.0, least_margin(step.here).value), (step.arc, least_margin(step.found).value)
    h, beside = _secant(left, right)
    for _ in range(_SECANTS):
        if beside <= left[0]:
            break
        found = step.along(beside)
        if not found.converged:
            return None
        left = beside, least_margin(found).value
        if left[1] * right[1] >= 0:
            return None
        h, beside = _secant(left, right)
    low, high = beside, 2.0 * h - beside
    arcs, equilibria = [], []
    for arc in low + (high - low) * _NODES:
        found = step.along(arc)
        if found.converged and abs(least_margin(found).value) > _BLURRED:
            arcs, equilibria = [*arcs, arc], [*equilibria, found]
    values, most = np.array([least_margin(one).value for one in equilibria]), len(arcs) - 1
    if len(arcs) < _ENOUGH or np.min(values) > 0 or np.max(values) < 0:
        return None
    line = Polynomial.fit(arcs, values, most - 1)
    if np.max(np.abs(line(np.array(arcs)) - values)) > _SMOOTH * _WIDE:
        return None
    roots = Polynomial.fit(arcs, values, most).roots()
    inside = [root.real for root in roots if root.imag == 0 and low <= root.real <= high]
    if len(inside) != 1:
        return None
    factors = Polynomial.fit(arcs, [one.factor for one in equilibria], most)
    factor = float(factors(inside[0]))
    stable = np.flatnonzero(values > 0)
    best = int(stable[np.argmin(values[stable])])
    at = equilibria[best]
    # It is reached itself, or, a singular point of the equations, a little on the stable side.
    for arc in (inside[0], inside[0] + _ASIDE * (arcs[best] - inside[0])):
        trial = step.along(arc)
        if trial.converged and abs(trial.factor - factors(arc)) < _SMOOTH * abs(factor):
            at = trial
            break
    return replace(point_at(at), factor=factor)


def _secant(left: tuple[float, float], right: tuple[float, float]) -> tuple[float, float]:
    """Arc at which a margin vanishes, and an arc beside it with a margin of some size."""
    rate = (right[1] - left[1]) / (right[0] - left[0])
    h = left[0] - left[1] / rate
    return h, h - _WIDE / abs(rate)


def singular(step: PathStep) -> CriticalPoint | None:
    """Where rigid bars lie in a singular posture on the way; None where they do not.

    By the polynomials through equilibria around it: beside it equations are nearly singular.
    """
    regular = Regular.of(step.here.known)
    if regular.ratio(step.found.known) > _BESIDE:
        return None
    along, equilibria, ratios = [], [], []
    for h in _AROUND * step.arc:
        found = step.along(h)
        ratio = regular.ratio(found.known)
        if found.converged and abs(ratio) > _BESIDE:
            along, equilibria, ratios = [*along, h], [*equilibria, found], [*ratios, ratio]
    signs = np.flatnonzero(np.diff(np.sign(ratios)))
    if not len(signs):
        return None
    left, right = equilibria[signs[0]], equilibria[signs[0] + 1]
    if Regular.of(left.known).ratio(right.known) > 0:
        return None  # the posture has only turned far from that before the step
    ends, most = (along[signs[0]], along[signs[0] + 1]), len(along) - 1
    roots = Polynomial.fit(along, ratios, most).roots()
    h = next(root.real for root in roots if root.imag == 0 and ends[0] < root.real < ends[1])
    factor = float(Polynomial.fit(along, [one.factor for one in equilibria], most)(h))
    words = "rigid bars lie in a singular posture, where another assembly mode begins"
    return CriticalPoint(factor, words, None, np.zeros(left.problem.size), False, left)


#: A margin above which Newton's method has not passed a critical load, if its steps were direct.
SAFE = 0.3
# Part of a displacement.
_SHORTEST = 2.0**-4
# Steps at most, and how far one of them shifts the platform, by the robot's length.
_LONGEST, _FURTHEST = 250, 0.1
# The first of them, and how far it does: each may be 1.6 times the one before, 2.5 times on a way
# that is all but straight, so that none is long beside the way there, where a branch may be near.
_FIRST, _NEAREST = 0.02, 1e-5
# Steps of Newton's method after which the arc may be longer, by less after one less than these; of
# a straight way.
_EASILY, _STRAIGHT = 7, 3
# Part of a step that is left of it at least.
_LEAST = 0.02
# Arcs that may lead behind a corner; how often the first that does is halved.
_BEHIND, _HALVES = (1e-5, 1e-4, 1e-3), 30
# Part of the load by which a stable path may turn back: rounding; and by which two are so near that
# Newton's method leads from one to the other.
_BACK, _SAME_FACTOR = 1e-6, 1e-10


@frozen
class OnPath:
    """An equilibrium on a path, and the critical points since the one before, least load first.

    `step` leads there from the one before; None for the first.
    """

    found: FoundEquilibrium
    is_stable: bool
    critical: tuple[CriticalPoint, ...] = ()
    step: PathStep | None = None

    def at(self, factor: float) -> FoundEquilibrium:
        """The equilibrium at a factor between this one and the one before, on the path itself.

        By regula falsi (Illinois) along the arc, before a critical point on it: near that Newton's
        method at the load itself may leap to another branch.
        """
        if self.step is None or (self.found.factor <= factor and not self.critical):
            return self.found
        first = self.critical[0].factor if self.critical else self.found.factor
        if first < factor:
            return self.found.under(factor)
        best, low, high = self.step.here, 0.0, self.step.arc
        at_low, at_high = best.factor - factor, max(first, self.found.factor) - factor
        was_beyond: bool | None = None  # an end that stays twice counts half
        for _ in range(2 * _HALVES):
            if abs(best.factor - factor) <= _SAME_FACTOR * (1.0 + abs(factor)):
                break
            h = (low * at_high - high * at_low) / (at_high - at_low)
            found = self.step.along(h)
            if not found.converged:
                break
            over = found.factor - factor
            lost = bool(self.critical) and least_margin(found).value < 0
            beyond = over > 0 or lost
            part = 0.5 if beyond == was_beyond else 1.0
            if beyond:
                high, at_high, at_low = h, max(over, 0.5 * at_high if lost else 0.0), part * at_low
            else:
                best, low, at_low, at_high = found, h, over, part * at_high
            was_beyond = beyond
        return best.under(factor)


def path(problem: EquilibriumProblem, loading: LoadCase, largest: float = 0.25) -> Iterator[OnPath]:
    """Equilibria along a growing load from factor 0 on, through its turning points.

    The arc is measured by the motion of the platform and by the load factor. A step is halved that
    does not converge, turns far, or has leapt to another branch; the path ends where that does not
    help. Up to the whole load, steps of the load factor are at most `largest`; beyond it they grow
    with the load.
    """
    here, lost = _start(problem, loading)
    at_once = () if lost is None else (replace(lost, factor=0.0),)
    if not here.converged:
        yield from (OnPath(point.found, False, at_once) for point in at_once)
        return
    margin = least_margin(here).value
    if not at_once and margin <= 0:
        at_once = (point_at(here),)
    slope = 0.0  # of the margin along the arc
    is_stable, branches = margin >= 0, may_be_singular(problem)
    yield OnPath(here, is_stable, at_once)
    unit = _unit(here)
    h = min(_FIRST, _NEAREST * problem.length / unit)
    direction = _direction(here, None, unit)
    shortest, before, ahead = 1e-7 * h, h, None  # singular posture beyond a step
    for _ in range(_LONGEST):
        if h < shortest:
            if ahead is None and is_stable and problem.has_corners:
                ahead = _lost_at_corner(here, direction, unit)
            yield from (OnPath(here, is_stable, (point,)) for point in (ahead,) if point)
            return
        found = (step := PathStep(here, direction, h, unit, here)).along(h)
        following = _direction(found, direction, unit) if found.converged else direction
        if not found.converged or (h > SHARP and float(following @ direction) < TURNS):
            beyond = None
            if is_stable and h <= SHARP and problem.has_corners:
                beyond = _beyond_corner(here, h * abs(direction[-1]))
            if beyond is None:
                h *= 0.5
                continue
            found, following = beyond, _direction(beyond, None, unit)
        remains = (ahead_margin := least_margin(found).value) >= 0
        step = replace(step, found=found)
        point = refined(step) if remains != is_stable else None
        # On a stable branch the load grows: so the determinant of K and of this arc has its sign.
        leapt = isinstance(point, float | int)
        falls = (
            following[-1] < -_BACK
            if remains
            else isinstance(point, CriticalPoint)
            and point.factor < here.factor - _BACK * (1.0 + abs(here.factor))
        )
        if not falls and remains and margin + slope * h < 0 and h > _LEAST * before:
            middle = step.along(0.5 * h)  # stability may be lost there, and come back
            falls = middle.converged and least_margin(middle).value < 0
        if leapt or (is_stable and falls):
            h = max(point, _LEAST * h) if leapt else 0.5 * h
            continue
        known, ahead = ahead, None
        flat = known or (singular(step) if branches else None)
        if flat is not None and known is None and (flat.factor - found.factor) * following[-1] > 0:
            ahead, flat = flat, None
        critical = sorted(filter(None, [flat, point]), key=lambda one: one.factor)
        yield OnPath(found, remains, tuple(critical), step)
        direction, here, is_stable = following, found, remains
        margin, slope, before = ahead_margin, (ahead_margin - margin) / h, h
        if found.steps <= _EASILY:
            h = _next(replace(step, direction=direction), largest)


def _next(before: PathStep, largest: float) -> float:
    """Arc of the next step: longer after few Newton steps, unless load or platform move far."""
    steps, ahead, problem = before.found.steps, before.direction, before.here.problem
    of_load = largest * (1.0 + abs(before.found.factor)) / max(abs(float(ahead[-1])), 1e-12)
    shift = max(before.unit * float(np.linalg.norm(ahead[:-1])), 1e-12 * problem.length)
    more = 2.5 if steps <= _STRAIGHT else 1.6 if steps < _EASILY - 1 else 1.2
    return min(of_load, _FURTHEST * problem.length / shift, more * before.arc)


def _start(
    problem: EquilibriumProblem, loading: LoadCase
) -> tuple[FoundEquilibrium, CriticalPoint | None]:
    """The equilibrium at factor 0, and where stability is lost on the way to it.

    Loads that act throughout are followed from none of them, where Newton's method is in doubt.
    """
    here = equilibrium_at(problem, loading, 0.0, problem.unloaded)
    if loading.share == 0:
        return here, None
    if here.converged and here.direct and least_margin(here).value >= SAFE:
        return here, None
    growing = LoadCase(np.zeros(problem.size), 0.0, loading.share)
    ended, critical, searched_to = first_critical(path(problem, growing), 1.0)
    if critical is not None or ended is None or searched_to < 1.0:
        return here, critical
    return equilibrium_at(problem, loading, 0.0, ended.state), None


def _beyond_corner(here: FoundEquilibrium, more: float) -> FoundEquilibrium | None:
    """The stable equilibrium near by, under so much more of the load; None without one.

    The arc does not lead there where the path turns by a right angle or more.
    """
    found = here.under(here.factor + more)
    if not found.converged or least_margin(found).value < 0:
        return None
    moved = found.displacement - here.displacement
    return found if found.problem.size_of(moved) < SHARP else None


def _lost_at_corner(
    here: FoundEquilibrium, direction: np.ndarray, unit: float
) -> CriticalPoint | None:
    """The corner at which a stable path ends, if what is behind it is not stable; else None.

    Where nothing resists the load behind it, as where all cables are slack, it is a limit.
    """
    problem = here.problem

    def behind(arc: float) -> FoundEquilibrium:
        twist, more = arc * direction[:-1] * unit / problem.scale, arc * float(direction[-1])
        state, *_ = problem.after_step(here.state, here.known, twist, more, CAP)
        known = problem.linear_equations(state, here.loading, here.factor + more)
        return replace(here, state=state, known=known, factor=float(here.factor + more))

    def least(arc: float) -> float:
        return least_margin(behind(arc)).value

    low, high = 0.0, next((arc for arc in _BEHIND if least(arc) <= 0), 0.0)
    if high == 0 or not meets_stiffness(problem.at_rest):
        return None
    for _ in range(_HALVES):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if least(middle) <= 0 else (middle, high)
    found = behind(high)
    margin = least_margin(found)
    if margin.value == 0:
        pulled = margin.basis.T @ found.known.by_factor
        margin = replace(margin, form=-np.outer(pulled, pulled))
    return point_at(found, margin)


def first_critical(
    steps: Iterable[OnPath], up_to: float
) -> tuple[FoundEquilibrium | None, CriticalPoint | None, float]:
    """The first critical point on a path from factor 0 up to a factor.

    Returns the last stable equilibrium, at most at `up_to`, None where there is none from which to
    start; the critical point, None where none was met; and the factor up to which equilibria were
    found to be stable: `up_to`, unless the path ended before or a critical point was met.
    """
    here, furthest = None, 0.0
    for step in steps:
        if step.found.factor < 0:
            break
        furthest = max(furthest, step.found.factor)
        if step.critical:
            first = step.critical[0]
            if first.factor > up_to:
                last = step.at(up_to)
                if least_margin(last).value >= 0:
                    return last, None, up_to
                first = replace(first, factor=up_to)  # another margin is lost just before it
            return here, first, first.factor
        here = step.at(up_to)
        if here.factor >= up_to:
            break
    return here, None, min(up_to, furthest)


def held_equilibrium(
    problem: EquilibriumProblem, loading: LoadCase, displacement: np.ndarray
) -> FoundEquilibrium:
    """The equilibrium at a displacement (r,) of the platform, under the whole load.

    Where Newton's method finds none, or one that is unstable, the displacement and the loads grow
    together in parts.
    """
    full, state, done, part, at_once = np.zeros(6), problem.unloaded, 0.0, 1.0, None
    while part >= _SHORTEST:
        full[list(problem.rows)] = (done + part) * displacement
        target = turn_by_vector(full[3:]), problem.point + full[:3]
        found = equilibrium_at(problem, loading, done + part, state, target)
        at_once = at_once or found
        least = min((m.value for m in leg_margins(found.known).values()), default=1.0)
        if not found.converged or least < 0:
            part /= 2
        elif done + part == 1:
            return found
        else:
            state, done, part = found.state, done + part, min(2 * part, 1 - done - part)
    return cast("FoundEquilibrium", at_once)


def _unit(at: FoundEquilibrium) -> float:
    """Shift [m] that counts as much as the whole load: what the platform does under it."""
    K, load, problem = at.known.K_total, at.known.by_factor, at.problem
    twist = solve_least(K, load, problem.scale, problem.length)
    shift = float(np.linalg.norm(twist * problem.scale))
    return min(max(shift, 1e-9 * problem.length), problem.length)


def _direction(at: FoundEquilibrium, before: np.ndarray | None, unit: float) -> np.ndarray:
    """Unit direction (r + 1,) of the path in scaled twist and factor."""
    known, problem, r = at.known, at.problem, at.problem.size
    scaled = known.K_total / problem.scale[:, None] / problem.scale * unit
    load = known.by_factor / problem.scale
    system = np.column_stack([scaled, -load])
    size = np.linalg.norm(system, axis=1)
    v = np.linalg.svd(system / np.where(size > 0, size, 1.0)[:, None])[2][r]
    if before is None:
        return v if v[-1] >= 0 else -v
    return v if float(v @ before) >= 0 else -v
