"""Equilibrium of a platform in cables with locked winches: large displacements, slack."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.cables.stiffness_matrix import (
    PlacedCables,
    elastic_stiffness,
    geometric_stiffness,
    structure_matrix,
    weight_stiffness,
    weight_wrench,
    wrench_derivative,
)
from robostiff.spatial.rotation import matrix_of_rotation, vector_of_rotation

_ITERATIONS = 50
_HALVINGS = 12  # of a step, before it leads nowhere
_SHORTEST_STEP = 1e-4  # of the load, before the path is given up
_TOLERANCE = 1e-12
_TAUT = 1e-10


@dataclass(frozen=True)
class Hanging:
    """A platform in cables whose winches are locked, at some displacement from a first pose."""

    placed: PlacedCables  # at the first pose, a single one
    axial: np.ndarray  # (m,): stiffness of every cable [N/m]
    # (m,): length from exit point to attachment below which a cable is slack [m]
    slack_lengths: np.ndarray
    size: float  # characteristic length, by which moments are compared with forces [m]
    shift: np.ndarray  # (3,): displacement of the reference point [m]
    R: np.ndarray  # (3, 3): rotation since the first pose
    pushing: np.ndarray | bool = False  # (m,): which cables would push rather than become slack

    @classmethod
    def at_rest(cls, placed: PlacedCables, axial: np.ndarray, tensions: np.ndarray) -> Hanging:
        """The platform at the first pose, where the cables have given tensions (m,) [N]."""
        slack = placed.lengths - tensions / axial
        size = float(placed.characteristic_length)
        return cls(placed, axial, slack, size, np.zeros(3), np.eye(3))

    @cached_property
    def now(self) -> PlacedCables:
        """The cables at the present displacement."""
        origin = self.placed.reference_point
        return replace(
            self.placed,
            attachments=origin + self.shift + self.placed.arms @ self.R.T,
            reference_point=origin + self.shift,
            weight_point=origin + self.shift + self.R @ self.placed.weight_arm,
        )

    @cached_property
    def pulls(self) -> np.ndarray:
        """Stiffness times stretch (m,) [N]: the tension, or negative for a slack cable."""
        return self.axial * (self.now.lengths - self.slack_lengths)

    @cached_property
    def tensions(self) -> np.ndarray:
        """Tensions (m,) [N]; zero for slack cables."""
        return np.where(self._taut, self.pulls, 0.0)

    @cached_property
    def _taut(self) -> np.ndarray:
        return self.pushing | (self.pulls >= 0)

    @cached_property
    def holding(self) -> np.ndarray:
        """Wrench that must be applied to hold the platform here (n,) [N, N m]."""
        now = self.now
        return -(structure_matrix(now) @ self.tensions + weight_wrench(now))

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Second derivative of the energy (n, n), of the cables that are taut."""
        now = self.now
        return (
            elastic_stiffness(now, np.where(self._taut, self.axial, 0.0))
            + geometric_stiffness(now, self.tensions)
            + weight_stiffness(now)
        )

    @property
    def is_stable(self) -> bool:
        """Whether the platform returns after a small push."""
        s = self.scale
        values = np.linalg.eigvalsh(self.stiffness / np.outer(s, s))
        return bool(values[0] > 1e-14 * values[-1])

    @cached_property
    def scale(self) -> np.ndarray:
        """Factors (n,) that turn a displacement into lengths."""
        space = self.placed.space
        turns = space.size - space.translations
        return np.array([1.0] * space.translations + [self.size] * turns)

    def moved(self, x: np.ndarray) -> Hanging:
        """Displaced by a translation of the reference point and then a turn about it (n,)."""
        six = np.zeros(6)
        six[list(self.placed.space.rows)] = x
        turn = matrix_of_rotation(six[3:])
        return replace(self, shift=self.shift + six[:3], R=turn @ self.R)

    def at_equilibrium(self, wrench: np.ndarray) -> Hanging | None:
        """The equilibrium under a wrench (n,) of constant direction; None if there is none.

        Newton's method on the balance of forces, with steps that do not increase the residual.
        """
        state, s = self, self.scale
        missing = (wrench - state.holding) / s
        # Rounding of forces that cancel.
        floor = _TOLERANCE * max(
            float(np.abs(wrench / s).max()),
            float(state.tensions.max()),
            float(np.abs(self.placed.weight_force).max()),
        )
        for _ in range(_ITERATIONS):
            if np.abs(missing).max() <= floor:
                return state
            tangent = wrench_derivative(state.stiffness, state.holding) / np.outer(s, s)
            try:
                step = np.linalg.solve(tangent, missing) / s
            except np.linalg.LinAlgError:
                return None
            turn = np.linalg.norm(step[state.placed.space.translations :])
            factor = min(1.0, 0.3 / turn) if turn > 0 else 1.0
            for _ in range(_HALVINGS):
                trial = state.moved(factor * step)
                left = (wrench - trial.holding) / s
                if np.linalg.norm(left) < np.linalg.norm(missing):
                    break
                factor *= 0.5
            else:  # no step is better: this is rounding, or no rest nearby
                return state if np.abs(missing).max() <= 1e3 * floor else None
            state, missing = trial, left
        return None


Rest = Callable[[float, Hanging], Hanging | None]
"""Equilibrium under a part of the load, found from another state."""


def load_path(
    rest: Rest, start: tuple[float, Hanging], last: float
) -> Iterator[tuple[float, Hanging]]:
    """Stable equilibria under a growing load: load factors and states, after `start` up to `last`.

    The path ends early where the next rest is lost or not stable.
    """
    factor, state = start
    step = min(1.0, last - factor)
    while factor < last:
        target = min(factor + step, last)
        found = rest(target, state)
        if found is not None and found.is_stable and _near(state, found):
            factor, state = target, found
            yield factor, state
            step *= 2.0
            continue
        step *= 0.5
        if step < _SHORTEST_STEP * last:
            return


def first_slack(
    rest: Rest, before: tuple[float, Hanging], after: tuple[float, Hanging]
) -> tuple[float, int] | None:
    """Load factor at which the first cable becomes slack on a part of the path, and its number."""
    start = before[1]
    # A cable may be just taut, within rounding.
    margin = _TAUT * float(start.tensions.max())
    taut = start.pulls >= -margin
    if not np.any(after[1].pulls[taut] < -margin):
        return None

    # Cables that would push have a smooth force where they become slack, and are alike before it.
    known = {before[0]: replace(start, pushing=taut)}

    def at(factor: float) -> Hanging | None:
        nearest = min(known, key=lambda own: abs(own - factor))
        found = rest(factor, known[nearest])
        if found is not None:
            known[factor] = found
        return found

    def least(factor: float) -> float:
        found = at(factor)
        # If Newton's method finds no equilibrium, the cable is already slack.
        return -1.0 if found is None else float(found.pulls[taut].min()) + margin

    if least(before[0]) <= 0:
        return before[0], int(np.argmin(np.where(taut, start.pulls, np.inf)))
    if least(after[0]) > 0:  # another rest is nearer to the start: the path decides
        return after[0], int(np.argmin(np.where(taut, after[1].pulls, np.inf)))
    from scipy.optimize import root_scalar

    found = root_scalar(least, bracket=(before[0], after[0]), method="brentq", xtol=1e-12)
    factor = float(found.root)
    state = at(factor) or after[1]
    return factor, int(np.argmin(np.where(taut, state.pulls, np.inf)))


def _near(before: Hanging, after: Hanging) -> bool:
    """Whether two states are neighbours on a path, not separate equilibria."""
    turn = np.linalg.norm(vector_of_rotation(after.R @ before.R.T))
    shift = np.linalg.norm(after.shift - before.shift)
    return bool(turn < 0.3 and shift < 0.1 * before.size)
