"""Newton's method on coordinates, wrenches and platform pose at once, at a load or along a path."""

from __future__ import annotations

import numpy as np

from robostiff.frozen import frozen, replace
from robostiff.spatial.rotation import vector_of_rotation
from robostiff.statics.chains.legs import State
from robostiff.statics.equations.problem import (
    EquilibriumProblem,
    Linearised,
    LoadCase,
    solve_least,
)

#: Largest step of a rotation [rad], and of a shift by the robot's length.
CAP = 0.2
# After a step of this size the next would be rounding; near a critical load rounding is larger.
_DONE, _NEAR = 1e-9, 1e-7
# A step of this size leaves the equations as they are; after one below the other, it may come.
_NOTHING, _SOON = 1e-14, 3e-7
_STEPS = 40
#: Part of the one before that a step may be at most, how that falls from step to step, and what is
#: little: so shorten steps that meet no singular tangent, under no smaller load (Kantorovich).
HALF, FALLS, LITTLE = 0.5, 0.75, 0.1
#: Cosine of the angle of a step, and of the path behind it, with the path before it: below it, the
#: step may have leapt to another branch; one so short has met a corner, such as that of a law.
TURNS, SHARP = 0.9, 1e-2
_REFINEMENTS = 2
# Part by which sizes of equations and steps may differ that are the same; so many of them in a row.
_REPEATS, _ENDLESS = 1e-9, 4
# A step above this is no end of an iteration.
_FREE_RUN = 0.5 * CAP


@frozen
class FoundEquilibrium:
    """Where Newton's method ended."""

    loading: LoadCase
    state: State
    factor: float  # of the loads
    known: Linearised  # the equations there, refined
    converged: bool
    steps: int
    # every step was whole, at most half of the one before, and little or a smaller part than that
    direct: bool = False

    @property
    def problem(self) -> EquilibriumProblem:
        """Whose equilibrium it is."""
        return self.known.problem

    @property
    def displacement(self) -> np.ndarray:
        """Of the point of the platform, and its rotation vector, from the unloaded posture (r,)."""
        return self.problem.displacement(self.state)

    def under(self, factor: float) -> FoundEquilibrium:
        """The equilibrium near by under another factor of the loads."""
        return equilibrium_at(self.problem, self.loading, factor, self.state)


def equilibrium_at(
    problem: EquilibriumProblem,
    loading: LoadCase,
    factor: float,
    start: State,
    target: tuple[np.ndarray, np.ndarray] | None = None,
    steps: int = _STEPS,
) -> FoundEquilibrium:
    """Newton's method at one load factor, from a state, in so many steps at most.

    `target`: rotation and point at which the platform is held, if it is.
    """
    state, last, most, direct, done = start, np.inf, HALF, True, 0
    load = float(np.max(np.abs(factor * loading.wrench / problem.scale)))
    before, alike = np.zeros(3), 0
    for done in range(1, steps + 1):
        refined = _REFINEMENTS if last < _SOON else 0
        known = problem.linear_equations(state, loading, factor, refined)
        if target is not None:
            turn = vector_of_rotation(target[0] @ state.R.T)
            twist = np.concatenate([target[1] - state.p, turn])[list(problem.rows)]
        else:
            furthest = CAP * problem.length
            twist = solve_least(known.K_total, known.missing, problem.scale, furthest, load)
        here = state
        state, size, part = problem.after_step(state, known, twist, 0.0, CAP)
        if not np.isfinite(size):
            break
        # Between held ends a bent beam has other equilibria beyond its critical axial force, all
        # unstable; a straight one may have no other.
        if target is not None and done <= _STEPS // 2:
            state = problem.legs.short_of_buckling(here, state)
        # stiffness, load and step are the same where a robot has only turned
        scale = problem.scale
        scaled = known.K_total / np.outer(scale, scale), known.missing / scale, part * twist * scale
        now = np.array([np.linalg.norm(x) for x in scaled])
        alike = alike + 1 if np.all(np.abs(now - before) <= _REPEATS * now) else 0
        before = now
        # It slides or spins on for ever, unless a law of a joint has still to stop it.
        if alike == _ENDLESS and size > _FREE_RUN and not problem.has_laws:
            break
        direct = direct and part == 1 and size <= max(most * last, _DONE)
        most = HALF if done == 1 else min(HALF, max(FALLS * size / last, LITTLE))
        if refined and size < _NOTHING:
            return FoundEquilibrium(loading, state, factor, known, True, done, direct)
        if size < _DONE or (size < _NEAR and size > 0.3 * last):
            return _found_at(problem, loading, factor, state, done, direct)
        last = size
    return replace(_found_at(problem, loading, factor, start, done), converged=False)


def _found_at(
    problem: EquilibriumProblem,
    loading: LoadCase,
    factor: float,
    state: State,
    steps: int,
    direct: bool = False,
) -> FoundEquilibrium:
    known = problem.linear_equations(state, loading, factor, _REFINEMENTS)
    return FoundEquilibrium(loading, state, factor, known, True, steps, direct)


@frozen
class PathStep:
    """A step on a path of equilibria."""

    here: FoundEquilibrium  # where it begins
    direction: np.ndarray  # (r + 1,): in scaled twist and load factor
    arc: float  # its length
    unit: float  # shift that counts as much as the whole load [m]
    found: FoundEquilibrium  # where it ends

    def along(self, h: float) -> FoundEquilibrium:
        """The equilibrium a step h along the arc."""
        here, direction = self.here, self.direction
        problem, loading, r = here.problem, here.loading, here.problem.size
        scale, state, factor, known = problem.scale, here.state, here.factor, here.known
        moved, last = np.zeros(r + 1), np.inf
        for done in range(1, 13):
            system = np.zeros((r + 1, r + 1))
            system[:r, :r] = known.K_total / scale[:, None] / scale * self.unit
            system[:r, r] = -known.by_factor / scale
            system[r] = direction * (np.linalg.norm(system[:r], axis=1).mean() or 1.0)
            rest = h - float(direction @ moved)
            b = np.concatenate([known.missing / scale, [rest * (system[r] @ direction)]])
            try:
                step = np.linalg.solve(system, b)
            except np.linalg.LinAlgError:
                break
            twist = step[:r] * self.unit / scale
            state, size, part = problem.after_step(state, known, twist, float(step[r]), CAP)
            size = max(size, abs(float(step[r])) / (1.0 + abs(factor)))
            if not np.isfinite(size) or size > 4.0:
                break
            moved = moved + part * step
            factor += part * float(step[r])
            if size < _DONE or (size < _NEAR and size > 0.3 * last):
                if SHARP < abs(h) < TURNS * float(np.linalg.norm(moved)):
                    break
                return _found_at(problem, loading, factor, state, done)
            last = size
            known = problem.linear_equations(state, loading, factor)
        return replace(here, converged=False)
