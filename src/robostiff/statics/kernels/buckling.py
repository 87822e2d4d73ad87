"""How soon the struts of a robot buckle between their ends, by their length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.spatial import move_wrench
from robostiff.statics.chains.chain import FiniteChain
from robostiff.statics.chains.element import FiniteJoint, FiniteSpring
from robostiff.statics.chains.leg_state import LegState, Share
from robostiff.statics.equations.problem import EquilibriumProblem
from robostiff.statics.equations.stability import margins_of

_DEGREE = 3
# Between the lengths of a fit: a part of it, and how many times what it misses at these.
_PART, _MISSED = 1.03, 2.0
# Of the rates of the other sign: rounding.
_NONE = 1e-6


@dataclass(frozen=True)
class Buckling:
    """Bounds of what a force t [N] along a strut does to its margin: ``1 - t g``, ``1 + t h``."""

    # lengths between which they hold [m]
    shortest: float
    longest: float
    # (4,): polynomials g and h of the length, the constant last [1/N]; zero where nothing happens
    pull: np.ndarray
    push: np.ndarray

    def checks(self, t: Any, length: Any, safe: float) -> list[Any]:
        """Entries that are positive where the margin is above `safe`."""
        found = []
        for sign, own in ((1.0, self.push), (-1.0, self.pull)):
            if np.any(own):
                g: Any = float(own[0])
                for c in own[1:]:
                    g = g * length + float(c)
                found.append(1.0 - safe + t * g * sign)
        if found:
            size = 1 / self.longest
            found += [(length - self.shortest) * size, (self.longest - length) * size]
        return found


def buckling_of(
    problems: Sequence[EquilibriumProblem], struts: Sequence[int], force: float
) -> dict[int, Buckling]:
    """Of some legs, from the same robot at several postures, by a trial force [N].

    The second order of the energy is proportional to the force, in beams through their strain, so
    that margins are linear in it.
    """
    seen: dict[int, list[tuple[float, float, float]]] = {k: [] for k in struts}
    for problem in problems:
        for group in problem.groups:
            if not set(group.indices) & set(struts):
                continue
            start = group.unloaded()
            # about which the struts turn
            free = [e for e in group.chains[0].elements if not np.any(e.stiffness)]
            turning = [e.point for e in free if isinstance(e, FiniteJoint) and e.turns]
            ends = np.stack([turning[0], turning[-1]], axis=1)
            d = ends[:, 1] - ends[:, 0]
            lengths = np.linalg.norm(d, axis=1)
            along = d / lengths[:, None]
            W = np.zeros((group.count, 6))
            for i in range(group.count):
                unit = np.concatenate([along[i], np.zeros(3)])
                W[i] = move_wrench(unit, problem.point - ends[i, 1])
            x = _stretched(group.chains[0], along)
            rates = []
            for sign in (1.0, -1.0):
                state = LegState((sign * force * x,), (sign * force * W,), start.bodies, start.held)
                (eq,) = group.family.equations([state], np.eye(3), problem.point, Share(0.0, 0.0))
                found = margins_of(group, eq.A, problem.length)
                # nothing is lost where the platform holds all, or something spins
                lost = [1.0 - own.value if own and own.value else 0.0 for own in found]
                rates.append([max(0.0, own) / force for own in lost])
            for i, index in enumerate(group.indices):
                if index in seen:
                    seen[index].append((lengths[i], rates[0][i], rates[1][i]))
    return {index: _bounds(np.array(rows)) for index, rows in seen.items()}


def _stretched(chain: FiniteChain, along: np.ndarray) -> np.ndarray:
    """Coordinates (N, n) under a force of one newton along the line."""
    x = np.zeros((len(along), chain.size))
    for element, place in zip(chain.elements, chain.places, strict=True):
        if isinstance(element, FiniteSpring):
            own = np.einsum("nji,nj->ni", element.rotation, along)
            force = np.einsum("njm,nj->nm", element.modes[:, :3], own)
            x[:, place] = force / np.where(element.stiffness > 0, element.stiffness, np.inf)
        elif np.all(element.stiffness > 0):
            force = element.slide * np.einsum("ni,ni->n", element.axis, along)
            x[:, place.start] = force / element.stiffness
    return x


def _bounds(rows: np.ndarray) -> Buckling:
    length = rows[:, 0]
    spread = np.ptp(length) > 1e-6 * length.max()
    found = []
    for rates in (rows[:, 1], rows[:, 2]):
        fit = np.zeros(_DEGREE + 1)
        if np.any(rates > _NONE * rows[:, 1:].max()):
            degree = min(_DEGREE, len(np.unique(length.round(9))) - 1) if spread else 0
            own = np.polyfit(length, rates, degree)
            off = float(np.max(np.abs(np.polyval(own, length) - rates)))
            fit[-len(own) :] = own * _PART
            fit[-1] += _MISSED * off
        found.append(fit)
    edge = 0.0 if spread else 1e-6 * float(length.max())
    return Buckling(float(length.min()) - edge, float(length.max()) + edge, *found)
