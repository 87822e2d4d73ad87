"""Newton's method for the nearest closed posture, and the interface of its equations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

CLOSED = 1e-10
CONVERGED = 1e-14
_STANDSTILL = 1e-11
_NEAREST_ITERATIONS = 60
# Part by which a step may lessen the squares of gaps that many such steps leave as they are.
_STATIONARY = 1e-12
_LARGEST_STEP = 0.5


@dataclass(frozen=True)
class ClosurePart:
    """Equations whose determinant keeps its sign within an assembly mode."""

    loops: np.ndarray  # (n,) of int: equations of loops inside legs, which are taken first
    ends: np.ndarray  # (n,) of int: the other equations
    unknowns: np.ndarray  # (n,) of int

    @property
    def equations(self) -> np.ndarray:
        """All equations, those of loops first."""
        return np.concatenate([self.loops, self.ends])


class ClosureEquations(Protocol):
    """Equations of closure at postures x, one in each row.

    Gaps and unknowns are scaled to radians and parts of the length. ``given`` are the places in x
    of coordinates that are prescribed, ``parts`` what has an assembly mode of its own; the last of
    them has all equations and unknowns.
    """

    @property
    def given(self) -> Any:
        """Places (g,) of prescribed coordinates."""
        ...

    @property
    def parts(self) -> Any:
        """Parts with an assembly mode of their own, a sequence of `ClosurePart`, then all."""
        ...

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """Gaps (N, m)."""
        ...

    def rates(self, x: np.ndarray) -> np.ndarray:
        """Rates at which the unknowns close it (N, m, n)."""
        ...

    def gaps_and_rates(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Both, where bodies are placed once for them."""
        ...

    def moved(self, x: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Postures after steps (N, n) of the unknowns."""
        ...

    def lengths(self, x: np.ndarray) -> np.ndarray:
        """Lengths that must be positive (N, k) [m]."""
        ...


def nearest(equations: ClosureEquations, x: np.ndarray) -> np.ndarray:
    """Postures closed, or as nearly as possible, by Levenberg steps from guesses x (N, size).

    Steps are damped by the square of the gap. They may lead to another assembly mode. A posture is
    left where the sum of squares of its gaps is stationary: it remains as nearly closed as it is.
    """
    best, best_size = x.copy(), np.full(len(x), np.inf)
    going = np.arange(len(x))
    for _ in range(_NEAREST_ITERATIONS):
        e, J = equations.gaps_and_rates(x)
        size = np.max(np.abs(e), axis=-1, initial=0.0)
        better = size < best_size[going]
        best[going[better]], best_size[going[better]] = x[better], size[better]
        closed = (best_size[going] <= CONVERGED) | (~better & (best_size[going] < _STANDSTILL))
        step = _levenberg_step(e, J, size)
        J_step = np.einsum("...ij,...j->...i", J, step)
        falls = np.sum(e * J_step, axis=-1) > _STATIONARY * np.sum(e * e, axis=-1)
        on = ~closed & falls
        if not np.any(on):
            break
        going, x, step = going[on], x[on], step[on]
        longest = np.max(np.abs(step), axis=-1, keepdims=True)
        x = equations.moved(x, step * np.minimum(1.0, _LARGEST_STEP / np.maximum(longest, 1e-300)))
    return best


def _levenberg_step(e: np.ndarray, J: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Steps (N, n) that lessen gaps e (N, m) of given sizes (N,) by their rates J (N, m, n)."""
    if J.shape[-1] == 0:
        return np.zeros((len(e), 0))  # nothing can move
    J_T = np.swapaxes(J, -1, -2)
    wide = J.shape[-1] > J.shape[-2]
    A = J @ J_T if wide else J_T @ J
    trace = np.trace(A, axis1=-2, axis2=-1) / A.shape[-1]
    # Where nothing moves a gap, any damping keeps it at rest.
    damping = np.maximum(np.minimum(size, 1.0) ** 2, 1e-15) * np.where(trace > 0, trace, 1.0)
    A = A + damping[:, None, None] * np.eye(A.shape[-1])
    right = e[..., None] if wide else J_T @ e[..., None]
    found = np.linalg.solve(A, right)
    return (J_T @ found if wide else found)[..., 0]
