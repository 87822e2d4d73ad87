"""The commands ``check``, ``stiffness``, ``deflection``, ``indices``, ``verify`` and ``cables``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from robostiff.analysis.posed_stiffness import stiffness
from robostiff.analysis.result import Stiffness
from robostiff.cli.command import BAD_STATUS, answered, slips
from robostiff.cli.options import Answer, Length, Model, Posing
from robostiff.cli.options_of_answers import CheckDetails, Method, WrittenLoads, WrittenTensions
from robostiff.cli.output import draw, picture_beside
from robostiff.cli.written_arguments import (
    chosen,
    gravity_from,
    length_from,
    loaded,
    near_from,
    pose_from,
    where_from,
    wrench_from,
)
from robostiff.elastostatics import (
    Block,
    Form,
    IndexRules,
    Recursive,
    SaddlePoint,
    Status,
    WrenchBasis,
)
from robostiff.errors import InputError
from robostiff.model import Robot, Snapshot
from robostiff.page.stiffness import deflection_page, stiffness_page

if TYPE_CHECKING:
    from robostiff.cables import TensionRule
    from robostiff.model.cable import CableRobot

METHODS: dict[str, Form] = {
    form.name: form for form in (WrenchBasis(), SaddlePoint(), Block(), Recursive(), IndexRules())
}


def check_robot(model: Model, details: CheckDetails, answer: Answer) -> int:
    """Print the parts of a robot; reading the file checks it."""
    from robostiff.analysis.parts_at_home import mobility_at_home, parts_at_home
    from robostiff.page.facts import facts_of, facts_page

    picture = picture_beside(details.plot, answer)
    doubts: list[str] = []
    with slips(doubts.append):
        robot = model.load()
        facts = facts_of(robot)
        if isinstance(robot, Robot) and robot.coordinates:
            facts["mobility"] = mobility_at_home(robot)
        if details.parts and str(Status.UNREACHABLE) not in facts["home"]["status"]:
            facts["parts"] = parts_at_home(robot)
    if doubts:
        facts["warnings"] = doubts
    if picture is not None:
        from robostiff.plot.posed_robot import Colouring, picture_of_robot

        draw(picture_of_robot(robot, colouring=Colouring.NAMES), picture)
        facts["picture"] = str(picture)
    return answered(facts_page(facts), answer)


def print_stiffness(model: Model, place: Posing, method: Method, answer: Answer) -> int:
    """Print K at a pose."""
    form = chosen("--method", method.method, METHODS)
    robot = loaded(model, place)
    result = stiffness(robot, method=form, **where_from(robot, place))
    if not isinstance(result, Stiffness):
        from robostiff.page.cables import cable_stiffness_page

        return answered(cable_stiffness_page(result), answer)
    return answered(stiffness_page(result), answer)


def print_deflection(model: Model, written: WrittenLoads, place: Posing, answer: Answer) -> int:
    """Print the deflection under small loads."""
    robot = loaded(model, place)
    on_bodies = written.gravity is not None or written.weights or written.forces
    if written.wrench is None and not on_bodies:
        raise InputError(
            "load of a deflection",
            got="none",
            expected='--wrench, such as "0 0 -500 N 0 0 0", --gravity=-z, --load or --weight',
        )
    F: Any = None if written.wrench is None else wrench_from(written.wrench, robot.space)
    where = where_from(robot, place)
    if on_bodies or (isinstance(robot, Robot | Snapshot) and robot.springs):
        # what legs alone do not decide takes twice as long to import
        from robostiff.cli.commands_loads import body_loads
        from robostiff.statics import deflection as deflection_by_bodies

        g, loads = gravity_from(written.gravity), body_loads(written)
        result = deflection_by_bodies(robot, wrench=F, loads=loads, gravity=g, **where)
    else:
        from robostiff.analysis import deflection

        result = deflection(robot, wrench=F, **where)
    return answered(deflection_page(result), answer)


def print_indices(model: Model, place: Posing, length: Length, answer: Answer) -> int:
    """Print the stiffness indices at a pose; 1 for a bad status."""
    from robostiff.analysis.indices import indices
    from robostiff.model.cable import CableRobot
    from robostiff.page.indices import indices_page

    robot = loaded(model, place)
    if isinstance(robot, CableRobot):
        raise InputError(
            f"indices of {robot.name!r}",
            got="a cable robot",
            expected="a robot with legs: the stiffness of cables depends on their tensions",
        )
    result = stiffness(robot, **where_from(robot, place))
    found = indices(result, length=length_from(length)) if result.answered.all() else None
    return answered(indices_page(result, found), answer)


def print_verification(model: Model, place: Posing, answer: Answer) -> int:
    """Print the distances between the methods at a pose; 1 when they disagree."""
    from robostiff.analysis.verification import verify
    from robostiff.page.stiffness import verification_page

    robot = model.load()
    result = verify(robot, pose_from(robot, place), near=near_from(robot, place))
    answered(verification_page(result), answer)
    return 0 if result.agree else BAD_STATUS


_RULES = ("nearest", "closed-form")


def print_cables(model: Model, place: Posing, written: WrittenTensions, answer: Answer) -> int:
    """Print tensions and stiffness at a pose, and the response to a load with locked winches."""
    from robostiff.analysis import cable_stiffness
    from robostiff.model.cable import CableRobot
    from robostiff.page.cables import cable_response_page, cable_stiffness_page
    from robostiff.statics import cable_response

    robot, source = model.load(), model.source
    if not isinstance(robot, CableRobot):
        raise InputError(
            "robot of cables",
            got=source,
            expected="a robot with cables, such as cable-8",
            hint=f"write 'robostiff stiffness {source}' for a robot with legs",
        )
    wrench, balance = written.wrench, written.balance
    rule = _rule(robot, written.rule, written.level, written.tensions)
    pose = pose_from(robot, place)
    if wrench is not None:
        if balance is not None:
            raise InputError("--wrench and --balance", expected="one of them")
        load = wrench_from(wrench, robot.space)
        found = cable_response(robot, pose, load, tensions=rule)
        return answered(cable_response_page(found), answer)
    held = None if balance is None else wrench_from(balance, robot.space, "--balance")
    result = cable_stiffness(robot, pose, held, tensions=rule)
    return answered(cable_stiffness_page(result), answer)


def _rule(
    robot: CableRobot, name: str, level: float | None, given: str | None
) -> TensionRule | None:
    from robostiff.cables import ClosedFormTensions, GivenTensions, NearestTensions
    from robostiff.io.units import Dimension, parse_quantities

    if name not in _RULES:
        raise InputError("--rule", got=name, expected=" or ".join(_RULES))
    if given is not None:
        if level is not None or name != _RULES[0]:
            other = "--rule" if level is None else "--level"
            raise InputError(f"--tensions and {other}", expected="one of them")
        count = len(robot.cables)
        values = parse_quantities(given, [Dimension.FORCE] * count, robot.cable_names, "--tensions")
        return GivenTensions(values)
    if name == "closed-form":
        return ClosedFormTensions() if level is None else ClosedFormTensions(level)
    return None if level is None else NearestTensions(level)
