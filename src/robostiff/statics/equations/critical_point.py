"""Where stability is lost along a growing load: the critical point, and its mode in words."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Polynomial

from robostiff.analysis.free_motion import free_motions_in_words
from robostiff.kept import kept
from robostiff.statics.equations.newton import FoundEquilibrium, PathStep
from robostiff.statics.equations.stability import (
    Margin,
    Regular,
    energies_of,
    leg_margins,
    platform_margin,
    whole_motion,
    with_modes,
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
# Of load times mode: below this the load does no work on the mode, and equilibria branch.
_BRANCHES = 1e-4
# Of a step: where equilibria around a singular posture are looked for, and how near to it, of the
# determinant of closures before it, they are none.
_AROUND, _BESIDE = 1.5 * (0.5 - 0.5 * np.cos(np.pi * (np.arange(12) + 0.5) / 12)), 0.1
# Difference of margins by which legs buckle together.
_TOGETHER = 1e-7


@dataclass(frozen=True)
class CriticalPoint:
    """The first equilibrium along a growing load that is not stable, or a singular posture.

    Attributes
    ----------
    factor : float
        Of the load.
    words : str
        How the robot leaves it.
    leg : str or None
        The leg that buckles while the platform is held; None where the platform moves.
    twist : (r,) array
        Of the platform, per metre or radian; zero of a leg that buckles by itself, and of
        singular postures.
    is_limit : bool
        Whether the load cannot grow further; it can, on an unstable branch, where equilibria
        branch.
    found : FoundEquilibrium
    """

    factor: float
    words: str
    leg: str | None
    twist: np.ndarray
    is_limit: bool
    found: FoundEquilibrium


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
    at_left, at_right = (least_margin(own).value for own in at_ends)
    best = min(at_ends, key=lambda own: abs(least_margin(own).value))
    smallest = min(abs(at_left), abs(at_right))
    small = _SMALL * min(1.0, max(abs(at_left), abs(at_right)))
    met = {at_left: step.here.factor, at_right: found.factor}
    for trial in range(_TRIALS + _HALVES):
        h = (left * at_right - right * at_left) / (at_right - at_left)
        if trial >= _TRIALS:
            h = 0.5 * (left + right)
        found = step.along(h)
        if not found.converged:  # equations that are singular to rounding: a little aside
            h += _ASIDE * (left - h)
            found = step.along(h)
        one, other = (own.displacement * problem.scale for own in at_ends)
        near = _TORN * step.unit * abs(right - left) + _SAME * problem.length
        if not found.converged and smallest < _NEARLY * small:
            break
        if not found.converged or np.linalg.norm(one - other) > near:
            return _TOWARDS * h
        value = least_margin(found).value
        met[value] = found.factor
        if abs(value) < smallest:
            smallest, best = abs(value), found
        if smallest < small:
            # A leg that buckles alone may follow the platform: then that lost its margin before.
            before = step.along(h + _ASIDE * (left - h))
            earlier = least_margin(before).value if before.converged else value
            if abs(earlier) <= 10 * small or earlier * at_left > 0:
                break
            h, found, value, smallest = h + _ASIDE * (left - h), before, earlier, np.inf
            met = {own: factor for own, factor in met.items() if own * at_left > 0}
        if value * at_right < 0:
            left, at_left, at_ends[0] = right, at_right, at_ends[1]
        else:
            at_left *= 0.5
        right, at_right, at_ends[1] = h, value, found
    else:
        # It leaps at a corner, as where a cable becomes slack: the mode is that behind it.
        leaving = min(at_ends, key=lambda own: least_margin(own).value)
        return point_at(leaving)
    return replace(point_at(best), factor=_at_zero(met))


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
    arcs, every = [], []
    for own in low + (high - low) * _NODES:
        found = step.along(own)
        if found.converged and abs(least_margin(found).value) > _BLURRED:
            arcs, every = [*arcs, own], [*every, found]
    values, most = np.array([least_margin(own).value for own in every]), len(arcs) - 1
    if len(arcs) < _ENOUGH or np.min(values) > 0 or np.max(values) < 0:
        return None
    line = Polynomial.fit(arcs, values, most - 1)
    if np.max(np.abs(line(np.array(arcs)) - values)) > _SMOOTH * _WIDE:
        return None
    roots = Polynomial.fit(arcs, values, most).roots()
    inside = [own.real for own in roots if own.imag == 0 and low <= own.real <= high]
    if len(inside) != 1:
        return None
    factors = Polynomial.fit(arcs, [own.factor for own in every], most)
    factor = float(factors(inside[0]))
    stable = np.flatnonzero(values > 0)
    best = int(stable[np.argmin(values[stable])])
    at = every[best]
    # It is met itself, or, a singular point of the equations, a little on the stable side.
    for own in (inside[0], inside[0] + _ASIDE * (arcs[best] - inside[0])):
        met = step.along(own)
        if met.converged and abs(met.factor - factors(own)) < _SMOOTH * abs(factor):
            at = met
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
    along, every, ratios = [], [], []
    for h in _AROUND * step.arc:
        found = step.along(h)
        ratio = regular.ratio(found.known)
        if found.converged and abs(ratio) > _BESIDE:
            along, every, ratios = [*along, h], [*every, found], [*ratios, ratio]
    signs = np.flatnonzero(np.diff(np.sign(ratios)))
    if not len(signs):
        return None
    left, right = every[signs[0]], every[signs[0] + 1]
    if Regular.of(left.known).ratio(right.known) > 0:
        return None  # the posture has only turned far from that before the step
    ends, most = (along[signs[0]], along[signs[0] + 1]), len(along) - 1
    roots = Polynomial.fit(along, ratios, most).roots()
    h = next(own.real for own in roots if own.imag == 0 and ends[0] < own.real < ends[1])
    factor = float(Polynomial.fit(along, [own.factor for own in every], most)(h))
    words = "rigid bars lie in a singular posture, where another assembly mode begins"
    return CriticalPoint(factor, words, None, np.zeros(left.problem.size), False, left)


def _at_zero(met: dict[float, float]) -> float:
    """Load factor at the margin 0, by the polynomial through the four points nearest to it."""
    nearest = sorted(met.items(), key=lambda own: abs(own[0]))[:4]
    total = 0.0
    for i, (m, factor) in enumerate(nearest):
        weight = 1.0
        for k, (other, _) in enumerate(nearest):
            if k != i:
                weight *= other / (other - m)
        total += weight * factor
    return total


@kept
def least_margin(found: FoundEquilibrium) -> Margin:
    """The least margin, of the platform or of a leg."""
    every = platform_margin(found.known), *leg_margins(found.known).values()
    return min(every, key=lambda own: own.value)


def point_at(found: FoundEquilibrium, least: Margin | None = None) -> CriticalPoint:
    """What happens at a critical equilibrium, by its least margin."""
    problem, least = found.problem, least or least_margin(found)
    if least.leg is not None:
        # Of legs that buckle together, rounding must not choose the one that is named.
        margins = leg_margins(found.known)
        leg = min(key for key in margins if margins[key].value <= least.value + _TOGETHER)
        least = margins[leg]
        g, i = least.at
        parts = energies_of(
            problem.legs, *whole_motion(problem.legs, problem.blocks[g], i, least.mode)
        )
        name, part, _ = max(parts, key=lambda own: own[2])
        words = f"leg {name!r} buckles while the platform stays: most in {part!r}"
        return CriticalPoint(found.factor, words, name, np.zeros(problem.size), False, found)
    mode = least.mode
    size = np.linalg.norm(mode * problem.scale)
    twist = mode / (size if size > 0 else 1.0)
    motion = free_motions_in_words(twist[None], found.state.p, problem.length)[0]
    load = found.known.by_factor
    work = abs(float(load @ twist))
    # rigid parts may carry the load, and leave rounding of it
    whole = float(
        np.linalg.norm(np.append(load, found.loading.wrench_rate) / np.tile(problem.scale, 2))
    )
    is_limit = work > _BRANCHES * whole
    how = "snaps through" if is_limit else "buckles"
    words = f"the platform {how}: {motion}{_bent_beam(found, twist)}"
    return CriticalPoint(found.factor, words, None, motion.twist, is_limit, found)


def _bent_beam(found: FoundEquilibrium, twist: np.ndarray) -> str:
    """The beam that bends most between its ends in a motion of the platform, if most bends so."""
    known, problem, legs = found.known, found.problem, found.problem.legs
    moved = known.by_twist[: legs.numbers.total] @ twist
    bent = np.zeros(legs.inner_modes.shape)
    for g, block in enumerate(problem.blocks):
        m, Q = block.free, with_modes(legs, known.equations, g)
        motion = moved[block.coordinates]
        bends = -np.linalg.pinv(Q[:, m:, m:]) @ Q[:, m:, :m] @ motion[..., None]
        for i, own in enumerate(bends[..., 0]):
            bent += whole_motion(legs, block, i, np.append(motion[i], own))[1]
    parts = energies_of(legs, moved, bent)
    inner = parts[: len(bent)]
    if not sum(own[2] for own in inner) > 0.5 * sum(own[2] for own in parts):
        return ""
    leg, part, _ = max(inner, key=lambda own: own[2])
    return f"; {part!r} of leg {leg!r} bends between its ends"
