"""Statuses of results, pose by pose."""

from __future__ import annotations

from enum import IntFlag


class Status(IntFlag):
    """Status of a pose; several flags may hold at once, and 0 means that nothing is to be reported.

    ``FREE_MOTIONS`` and ``REDUNDANT_JOINTS`` accompany a right answer. The others are bad: there is
    no stiffness matrix (``RIGID_DIRECTION``, ``FORM_DOES_NOT_HOLD``, ``UNREACHABLE``), or there is
    one to be used with care (``ILL_CONDITIONED``, ``BEYOND_LIMITS``). ``UNBALANCED`` is said of
    a load.

    Examples
    --------
    >>> status = Status.FREE_MOTIONS | Status.REDUNDANT_JOINTS
    >>> str(status), status.is_bad
    ('free-motions+redundant-joints', False)
    """

    OK = 0
    FREE_MOTIONS = 1
    REDUNDANT_JOINTS = 2
    ILL_CONDITIONED = 4
    BEYOND_LIMITS = 8
    RIGID_DIRECTION = 16
    FORM_DOES_NOT_HOLD = 32
    UNREACHABLE = 64
    UNBALANCED = 128

    @property
    def is_bad(self) -> bool:
        """Whether the result is missing or to be used with care."""
        return bool(self & BAD)

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


def words_of(status: IntFlag) -> str:
    """Names of the flags, joined by ``+``; ``ok`` without flags.

    Examples
    --------
    >>> words_of(Status.OK), words_of(Status.RIGID_DIRECTION)
    ('ok', 'rigid-direction')
    """
    names = (str(member.name) for member in type(status) if member & status)
    return "+".join(name.lower().replace("_", "-") for name in names) or "ok"


WITHOUT_STIFFNESS = Status.RIGID_DIRECTION | Status.FORM_DOES_NOT_HOLD | Status.UNREACHABLE
BAD = WITHOUT_STIFFNESS | Status.ILL_CONDITIONED | Status.BEYOND_LIMITS | Status.UNBALANCED

_ADVICE = {
    Status.FREE_MOTIONS: (
        "the platform can move without meeting stiffness: the matrix is singular, and only loads "
        "that do no work on the free motions can be carried"
    ),
    Status.REDUNDANT_JOINTS: (
        "a passive joint adds no freedom to those before it, and is not held by the platform (for "
        "instance the spin of a rod between two spherical joints): the stiffness is that of the "
        "posture at hand"
    ),
    Status.ILL_CONDITIONED: (
        "near a singular pose, a joint that is almost redundant, or springs of too different size: "
        "few digits of the matrix hold; move away from the pose, align the joint exactly, or give "
        "the very stiff parts as rigid"
    ),
    Status.BEYOND_LIMITS: "an actuator is beyond its limits: the machine cannot stand at this pose",
    Status.RIGID_DIRECTION: (
        "a wrench is carried without meeting any compliance, so the stiffness is infinite and no "
        "matrix exists: give a link or an actuator on that path its elasticity, or move an arm "
        "with rigid links out of its singular posture"
    ),
    Status.FORM_DOES_NOT_HOLD: (
        "the form asked for does not hold here: use the wrench basis form, which always does"
    ),
    Status.UNREACHABLE: (
        "a leg cannot reach the pose, or only in another assembly mode than at home: move the "
        "pose, or check the leg's dimensions"
    ),
    Status.UNBALANCED: (
        "the load does work on a free motion, so the platform runs away instead of deflecting: "
        "apply a load that the free motions do not feel, or hold them"
    ),
}
