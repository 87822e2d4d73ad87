"""Where the legs of a group are, and what their equations say there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MovingBody:
    """A rigid body of each leg: its axes (N, 3, 3), and where its own point is (N, 3) [m]."""

    R: np.ndarray
    p: np.ndarray


@dataclass(frozen=True)
class LegState:
    """Coordinates of the legs of a group."""

    x: tuple[np.ndarray, ...]  # of each chain
    # what the body at the end of each chain exerts on it, about that body's point [N, N m]
    W: tuple[np.ndarray, ...]
    bodies: tuple[MovingBody, ...]  # between the chains of a leg
    held: np.ndarray  # (N, c): what rigid couplings push their sums with [N or N m]


@dataclass(frozen=True)
class Beside:
    """Derivatives of what the platform exerts on springs between bodies, about its point."""

    by_unknown: np.ndarray  # (N, r, n)
    by_twist: np.ndarray  # (N, r, r)
    by_factor: np.ndarray  # (N, r): by the factor of the loads

    def steps(self, found: np.ndarray) -> np.ndarray:
        """With steps (N, n, 1 + r + 1) by themselves, by the twist, and by the factor."""
        own = self.by_unknown @ found
        own[..., 1:-1] += self.by_twist
        own[..., -1] += self.by_factor
        return own


@dataclass(frozen=True)
class LegEquations:
    """Residual and tangent of the legs of a group, platform apart."""

    A: np.ndarray  # (N, n, n): tangent by coordinates, bodies and wrenches
    r: np.ndarray  # (N, n): residual
    A_t: np.ndarray  # (N, n, r): derivative by the twist of the platform
    r_factor: np.ndarray  # (N, n): derivative by the factor of the loads
    carried: np.ndarray  # (N, r): what the platform exerts on the leg about its point [N, N m]
    # how that changes beside the wrenches of chains, where springs act on the platform
    beside: Beside | None = None


@dataclass(frozen=True)
class Share:
    """How much of preloads and of loads on legs acts, and how that grows with the factor."""

    value: float
    rate: float
