"""Status of a cable robot, and the rank and stability by which it is decided."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag

import numpy as np

from robostiff.elastostatics import Tolerance
from robostiff.elastostatics.status import words_of


class CableStatus(IntFlag):
    """Status of a pose; several flags may hold at once, and 0 means that nothing is to be reported.

    Examples
    --------
    >>> status = CableStatus.UNSTABLE | CableStatus.BEYOND_LIMITS
    >>> str(status), status.is_bad, status.has_stiffness
    ('beyond-limits+unstable', True, True)
    """

    OK = 0
    FREE_MOTIONS = 1
    UNTENSIONED = 2
    ILL_CONDITIONED = 4
    BEYOND_LIMITS = 8
    UNBALANCED = 16
    INFEASIBLE = 32
    UNSTABLE = 64
    NO_LENGTH = 128
    RULE_FAILED = 256
    SLACK = 512
    NO_EQUILIBRIUM = 1024

    @property
    def is_bad(self) -> bool:
        """Whether the result is missing or to be used with care."""
        return bool(self & ~(CableStatus.FREE_MOTIONS | CableStatus.SLACK))

    @property
    def has_stiffness(self) -> bool:
        """Whether there is a stiffness matrix."""
        return not self & WITHOUT_STIFFNESS

    @property
    def advice(self) -> tuple[str, ...]:
        """One sentence of advice for each flag."""
        return tuple(_ADVICE[member] for member in type(self) if member & self)

    def __str__(self) -> str:
        return words_of(self)


WITHOUT_STIFFNESS = CableStatus.INFEASIBLE | CableStatus.NO_LENGTH | CableStatus.RULE_FAILED

_ADVICE = {
    CableStatus.FREE_MOTIONS: (
        "the platform can move without meeting stiffness, neither of stretched cables nor of their "
        "tension: add cables, or tension"
    ),
    CableStatus.UNTENSIONED: (
        "a cable has no tension: the matrix counts it, which is right only for motions that pull "
        "it; taut_stiffness leaves it out"
    ),
    CableStatus.ILL_CONDITIONED: (
        "near a singular pose, or near the loss of stability: few digits of the matrix hold"
    ),
    CableStatus.BEYOND_LIMITS: "a cable carries less or more than its tension limits allow",
    CableStatus.UNBALANCED: (
        "the tensions do not balance weight and wrench: the matrix is that of the cables at this "
        "pose, and missing_wrench is the wrench that is lacking"
    ),
    CableStatus.INFEASIBLE: (
        "no tensions within their limits balance weight and wrench at this pose: cables only pull, "
        "so move the pose into the workspace, lower the least tensions, or raise the greatest"
    ),
    CableStatus.UNSTABLE: (
        "the equilibrium at this pose is unstable: the geometric stiffness of the tensions is "
        "negative and larger than the elastic stiffness, see unstable_motions; lower the tension, "
        "or attach cables further apart"
    ),
    CableStatus.NO_LENGTH: (
        "an attachment point lies at the exit point of its cable, which has no direction there"
    ),
    CableStatus.RULE_FAILED: (
        "the closed form finds no tensions within the limits, although there may be some: use "
        "NearestTensions, which finds them where they exist"
    ),
    CableStatus.SLACK: "a cable is slack under the load: it carries no force until taut again",
    CableStatus.NO_EQUILIBRIUM: (
        "there is no stable equilibrium up to the full load: the platform moves away at the "
        "reported load factor; support it, or apply less"
    ),
}


_ROUNDING = 1e-12


@dataclass(frozen=True)
class Stability:
    """Rank and stability at one pose; columns are displacements in scaled coordinates.

    Attributes
    ----------
    held : int
        Directions in which cables stretch: the rank of the structure matrix.
    rank : int
        Of the stiffness matrix.
    free : (n, f) array
        Motions without stiffness.
    unstable : (n, u) array
        Motions that grow by themselves.
    doubtful : bool
        Whether a decision was close.
    """

    held: int
    rank: int
    free: np.ndarray
    unstable: np.ndarray
    doubtful: bool


def stability(W: np.ndarray, K: np.ndarray, size: float, tolerance: Tolerance) -> Stability:
    """Rank and stability of K at one pose.

    Tension is a thousandth or less of what stretching resists, so a single scale would take its
    part for rounding. The displacements are split: those in which cables stretch are decided by the
    geometry of unit wrenches, as everywhere; in the others the stiffness left after the first have
    condensed, ``K_nn - K_nh K_hh^-1 K_hn``, is compared with that of the tensions.

    Parameters
    ----------
    W : (n, m) array
        Structure matrix of the cables that count, moments divided by a characteristic length.
    K : (n, n) array
        Stiffness matrix, scaled alike [N/m].
    size : float
        Of the stiffness that tension and weight give [N/m].
    tolerance : Tolerance

    Examples
    --------
    >>> pendulum = stability(np.array([[0.0], [1.0]]), np.diag([50.0, 1e6]), 50.0, Tolerance())
    >>> pendulum.held, pendulum.rank
    (1, 2)
    """
    n = len(K)
    U, values, _ = np.linalg.svd(W)
    r = int(np.count_nonzero(values > tolerance.independence))
    doubtful = bool(np.any(tolerance.leaves_in_doubt(values)))
    H, N = U[:, :r], U[:, r:]
    held, directions = np.linalg.eigh(H.T @ K @ H)
    largest = np.abs(held).max(initial=0.0)
    doubtful |= bool(np.any(np.abs(held) <= tolerance.near_rigidity * largest))
    unstable = [H @ directions[:, held < -_ROUNDING * largest]]
    if r == n:
        return Stability(r, n, np.zeros((n, 0)), unstable[0], doubtful)
    follow = np.zeros((r, n - r))
    if r and not np.any(held == 0):
        follow = -directions @ ((directions.T @ (H.T @ K @ N)) / held[:, None])
    left = N.T @ K @ (N + H @ follow)
    own, turned = np.linalg.eigh(0.5 * (left + left.T))
    motions = (N + H @ follow) @ turned
    # Rounding of the large elastic entries reaches the small ones.
    floor = max(tolerance.independence * size, 1e-15 * largest)
    lost = np.abs(own) <= floor
    unstable.append(motions[:, (own < 0) & ~lost])
    near = ~lost & (np.abs(own) <= max(tolerance.near_independence * size, 1e-13 * largest))
    return Stability(
        held=r,
        rank=n - int(np.count_nonzero(lost)),
        free=motions[:, lost],
        unstable=np.concatenate(unstable, axis=-1),
        doubtful=bool(doubtful or near.any()),
    )
