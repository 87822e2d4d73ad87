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
    """Coordinates of the legs of a group.

    Attributes
    ----------
    x : tuple of (N, n) arrays
        Of each chain.
    W : tuple of (N, r) arrays
        What the body at the end of each chain exerts on it, about that body's point [N, N m].
    bodies : tuple of MovingBody
        Between the chains of a leg.
    held : (N, c) array
        What rigid couplings push their sums with [N or N m].
    """

    x: tuple[np.ndarray, ...]
    W: tuple[np.ndarray, ...]
    bodies: tuple[MovingBody, ...]
    held: np.ndarray


@dataclass(frozen=True)
class Beside:
    """Derivatives of what the platform exerts on springs between bodies, about its point.

    Attributes
    ----------
    by_unknown : (N, r, n) array
    by_twist : (N, r, r) array
    by_factor : (N, r) array
        By the factor of the loads.
    """

    by_unknown: np.ndarray
    by_twist: np.ndarray
    by_factor: np.ndarray

    def steps(self, found: np.ndarray) -> np.ndarray:
        """With steps (N, n, 1 + r + 1) by themselves, by the twist, and by the factor."""
        own = self.by_unknown @ found
        own[..., 1:-1] += self.by_twist
        own[..., -1] += self.by_factor
        return own


@dataclass(frozen=True)
class LegEquations:
    """Residual and tangent of the legs of a group, platform apart.

    Attributes
    ----------
    A : (N, n, n) array
        Tangent by coordinates, bodies and wrenches.
    r : (N, n) array
        Residual.
    A_t : (N, n, r) array
        Derivative by the twist of the platform.
    r_factor : (N, n) array
        Derivative by the factor of the loads.
    carried : (N, r) array
        What the platform exerts on the leg about its point [N, N m].
    beside : Beside or None
        How that changes beside the wrenches of chains, where springs act on the platform.
    """

    A: np.ndarray
    r: np.ndarray
    A_t: np.ndarray
    r_factor: np.ndarray
    carried: np.ndarray
    beside: Beside | None = None


@dataclass(frozen=True)
class Share:
    """How much of preloads and of loads on legs acts, and how that grows with the factor."""

    value: float
    rate: float
