"""Statuses of results of cable robots, pose by pose."""

from __future__ import annotations

from enum import IntFlag

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
