"""From written force laws of drives to those of the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

from robostiff.io.expression import exact_mathematics, parse
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_robot import WrittenLaw
from robostiff.io.units import Dimension, make_quantity, make_unit, to_si
from robostiff.kinematics import find_posture
from robostiff.model import ForceLaw, PlacedFreedom, Robot, StiffnessLaw

#: What a joint is called in formulas of its force or stiffness.
_MOTION = "q"


def stiffness_law(place: Place, written: str | float, turns: bool) -> StiffnessLaw | None:
    """Stiffness by the coordinate q of its joint; None where what is written does not depend on it.

    A parameter of the name q is a number as any other.
    """
    if not isinstance(written, str) or _MOTION in place.names:
        return None
    with place.complaints():
        expression = parse(written)
        if _MOTION not in expression.names:
            return None
        import sympy as sp

        k = _of_motion(
            place,
            written,
            Dimension.ROTATIONAL_STIFFNESS if turns else Dimension.TRANSLATIONAL_STIFFNESS,
            turns,
        )
        return StiffnessLaw.of(k, sp.Symbol(_MOTION, real=True), exact=place.is_exact)


def _of_motion(place: Place, written: str, dimension: Dimension, turns: bool) -> Any:
    """What is written of the motion q, in SI units."""
    import sympy as sp

    unit = make_unit({"rad": 1} if turns else {"m": 1})
    names = {**place.names, _MOTION: make_quantity(sp.Symbol(_MOTION, real=True), unit)}
    quantity = parse(written).evaluate(names, exact_mathematics())
    return sp.sympify(to_si(quantity, dimension, got=written))


def with_written_laws(place: Place, robot: Robot, written: Mapping[str, WrittenLaw]) -> Robot:
    """The robot with the force laws that are written for its joints.

    Parameters
    ----------
    place : Place
    robot : Robot
        Of numbers.
    written : mapping of str to expression or table
        By ``leg/joint``; ``*`` stands for any part of a name.
    """
    if not written:
        return robot
    from robostiff.statics.joint_laws import check_own_laws

    snapshot = find_posture(robot, None).snapshot.one(0)
    joints = {f"{leg.name}/{own.name}": own for leg in snapshot.legs for own in leg.freedoms}
    laws: dict[str, ForceLaw] = {}
    for pattern, law in written.items():
        here = place / pattern
        names = [name for name in joints if fnmatchcase(name, pattern)]
        if not names:
            raise here.error(
                "joint of a law",
                got=pattern,
                expected="leg/joint, such as " + ", ".join(map(repr, list(joints)[:3])),
                key=True,
            )
        for name in names:
            own = _law(here, law, joints[name])
            with here.complaints():
                check_own_laws({name: own}, snapshot)
            laws[name] = own
    return replace(robot, laws=laws)


def _law(place: Place, written: WrittenLaw, joint: PlacedFreedom) -> ForceLaw:
    turns = joint.turns
    force = Dimension.MOMENT if turns else Dimension.FORCE
    if isinstance(written, str):
        with place.complaints():
            return ForceLaw(_of_motion(place, written, force, turns))
    motion = Dimension.ANGLE if turns else Dimension.LENGTH
    table = [
        [(place / i / 0).number(q, motion), (place / i / 1).number(F, force)]
        for i, (q, F) in enumerate(written)
    ]
    with place.complaints():
        return ForceLaw(table)
