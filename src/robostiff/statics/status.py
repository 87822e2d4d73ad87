"""What can be said of an equilibrium, entry by entry."""

from __future__ import annotations

from enum import IntFlag

from robostiff.elastostatics import Status
from robostiff.elastostatics.status import words_of


class EquilibriumStatus(IntFlag):
    """What happened to a robot under load; several may hold at once, and 0 is a plain answer.

    Those that `Status` has, too, have its numbers and its advice.

    Examples
    --------
    >>> status = EquilibriumStatus.UNSTABLE | EquilibriumStatus.BEYOND_CRITICAL_LOAD
    >>> str(status), status.is_bad, status.has_stiffness
    ('unstable+beyond-critical-load', True, True)
    """

    OK = 0
    FREE_MOTIONS = int(Status.FREE_MOTIONS)
    REDUNDANT_JOINTS = int(Status.REDUNDANT_JOINTS)
    ILL_CONDITIONED = int(Status.ILL_CONDITIONED)
    BEYOND_LIMITS = int(Status.BEYOND_LIMITS)
    RIGID_DIRECTION = int(Status.RIGID_DIRECTION)
    UNREACHABLE = int(Status.UNREACHABLE)
    UNSTABLE = 256
    NO_EQUILIBRIUM = 512
    BEYOND_CRITICAL_LOAD = 1024

    @property
    def is_bad(self) -> bool:
        """Whether the answer is missing or to be used with care."""
        return bool(self & ~(EquilibriumStatus.FREE_MOTIONS | EquilibriumStatus.REDUNDANT_JOINTS))

    @property
    def has_stiffness(self) -> bool:
        """Whether there is an equilibrium with a stiffness matrix."""
        return not self & WITHOUT_STIFFNESS

    @property
    def advice(self) -> tuple[str, ...]:
        """One sentence of advice for each thing that happened."""
        return tuple(
            _ADVICE[member] if member in _ADVICE else Status(int(member)).advice[0]
            for member in type(self)
            if member & self
        )

    def __str__(self) -> str:
        return words_of(self)


WITHOUT_STIFFNESS = (
    EquilibriumStatus.RIGID_DIRECTION
    | EquilibriumStatus.UNREACHABLE
    | EquilibriumStatus.NO_EQUILIBRIUM
)

_ADVICE = {
    EquilibriumStatus.UNSTABLE: (
        "the robot does not stay in this equilibrium: the least disturbance moves it away; lower "
        "the load, stiffen what the mode of critical_load names, or guide the platform"
    ),
    EquilibriumStatus.NO_EQUILIBRIUM: (
        "no equilibrium was found from the unloaded posture: the load is too large, or drives a "
        "motion that nothing resists; apply it in smaller parts, or hold the platform"
    ),
    EquilibriumStatus.BEYOND_CRITICAL_LOAD: (
        "on the way to the full load the robot buckles, snaps through or meets a singular posture, "
        "at the factor critical_factor of the load: what is found beyond need not be where it ends"
    ),
}
