"""Springs between points of two bodies: gravity compensators, counterbalances, return springs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen
from robostiff.model.checks import vector3
from robostiff.spatial import as_float
from robostiff.spatial.formula import is_formula

#: Bodies that no part names.
BASE, PLATFORM = "base", "platform"


@frozen
class BodyPoint:
    """A point of a body of a robot.

    Attributes
    ----------
    body : str
        ``base``, ``platform``, or ``leg/part`` for the body behind that part.
    at : (3,) array
        In the world for the base, in the platform frame for the platform; elsewhere in the frame
        in which the part begins, or behind it where the part is a joint [m].
    """

    body: str
    at: Any = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", vector3(f"point of a spring on {self.body!r}", self.at))


@frozen
class BodySpring:
    """A spring between points of two bodies; it pulls or pushes along the line between them.

    Its tension at the distance l is ``stiffness (l - free_length)``; or ``preload`` in the home
    configuration, and ``stiffness`` times the change of l beyond. Stiffness 0 with a preload is a
    constant force: a gas spring that pushes has a negative one.

    Attributes
    ----------
    name : str
    between : two of BodyPoint
    stiffness : float or formula
        Zero or more [N/m].
    free_length : float, formula or None
        Distance without tension [m]; 0 for a spring of zero free length, and less for one that
        always pulls.
    preload : float, formula or None
        Tension in the home configuration, negative where it pushes [N].

    Raises
    ------
    InputError
        When the stiffness is negative, or not just one of free length and preload is given.

    Examples
    --------
    >>> ends = (BodyPoint("base", [0, 0, 0.4]), BodyPoint("arm/upper arm", [0.3, 0, 0]))
    >>> BodySpring("compensator", ends, stiffness=2000.0, free_length=0.0).preload is None
    True
    """

    name: str
    between: tuple[BodyPoint, BodyPoint]
    stiffness: Any
    free_length: Any = None
    preload: Any = None

    def __post_init__(self) -> None:
        subject = f"spring {self.name!r}"
        ends = tuple(self.between)
        if len(ends) != 2 or not all(isinstance(end, BodyPoint) for end in ends):
            raise InputError(f"ends of {subject}", got=self.between, expected="two BodyPoint")
        if ends[0].body == ends[1].body:
            raise InputError(
                f"bodies of {subject}", got=Words(f"{ends[0].body!r} twice"), expected="two bodies"
            )
        object.__setattr__(self, "between", ends)
        if (self.free_length is None) == (self.preload is None):
            raise InputError(
                subject,
                got="neither" if self.preload is None else "both",
                expected="free_length or preload, one of them",
            )
        for key, units in (("stiffness", "N/m"), ("free_length", "m"), ("preload", "N")):
            value = getattr(self, key)
            if value is None or is_formula(value):
                continue
            number = as_float(f"{key} of {subject}", value, f"one number [{units}]", units)
            object.__setattr__(self, key, number)
            if key == "stiffness" and number < 0:
                raise InputError(
                    f"stiffness of {subject}", got=number, expected="zero or more [N/m]"
                )
        if self.stiffness == 0 and self.preload is None:
            expected = "more than zero [N/m]"
            hint = "a constant force is stiffness 0 with a preload"
            raise InputError(f"stiffness of {subject}", got=0, expected=expected, hint=hint)


def refuse_springs(name: str, springs: Sequence[Any], subject: str) -> None:
    """Raise an InputError where a robot of that name has springs between bodies.

    The subject is the result that has no such springs, such as ``kernel``.
    """
    if springs:
        raise InputError(
            f"{subject} of {name!r}",
            got=Words(f"springs between bodies: {', '.join(spring.name for spring in springs)}"),
            expected="a robot of legs alone: those springs act under finite loads",
            hint="rs.equilibrium(robot, pose).K has them; robot.with_springs() has none",
        )
