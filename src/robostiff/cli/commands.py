"""The commands ``check``, ``stiffness``, ``deflection``, ``indices``, ``verify`` and ``cables``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from robostiff.analysis.posed_stiffness import stiffness
from robostiff.cli.command import BAD_STATUS, answered, slips
from robostiff.cli.options_of_answers import (
    Check,
    PrintCables,
    PrintDeflection,
    PrintIndices,
    PrintStiffness,
    PrintVerification,
)
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
from robostiff.page.of_result import page_of

if TYPE_CHECKING:
    from robostiff.cables import TensionRule
    from robostiff.model.cable import CableRobot

METHODS: dict[str, Form] = {
    form.name: form for form in (WrenchBasis(), SaddlePoint(), Block(), Recursive(), IndexRules())
}


def check_robot(asked: Check) -> int:
    """Print the parts of a robot; reading the file checks it."""
    from robostiff.analysis.parts_at_home import mobility_at_home, parts_at_home
    from robostiff.page.facts import facts_of, facts_page

    picture = picture_beside(asked.plot, asked.answer)
    doubts: list[str] = []
    with slips(doubts.append):
        robot = asked.model.load()
        facts = facts_of(robot)
        if isinstance(robot, Robot) and robot.coordinates:
            facts["mobility"] = mobility_at_home(robot)
        if asked.parts and str(Status.UNREACHABLE) not in facts["home"]["status"]:
            facts["parts"] = parts_at_home(robot)
    if doubts:
        facts["warnings"] = doubts
    if picture is not None:
        from robostiff import plot

        drawn = plot.robot(robot, colouring=plot.Colouring.NAMES, backend=plot.PictureData())
        draw(drawn, picture)
        facts["picture"] = str(picture)
    return answered(facts_page(facts), asked.answer)


def print_stiffness(asked: PrintStiffness) -> int:
    """Print K at a pose."""
    form = chosen("--method", asked.method, METHODS)
    robot = loaded(asked.model, asked.place)
    result = stiffness(robot, method=form, **where_from(robot, asked.place))
    return answered(page_of(result), asked.answer)


def print_deflection(asked: PrintDeflection) -> int:
    """Print the deflection under small loads."""
    robot, written = loaded(asked.model, asked.place), asked.loads
    on_bodies = written.gravity is not None or written.weights or written.forces
    if written.wrench is None and not on_bodies:
        raise InputError(
            "load of a deflection",
            got="none",
            expected='--wrench, such as "0 0 -500 N 0 0 0", --gravity=-z, --load or --weight',
        )
    F: Any = None if written.wrench is None else wrench_from(written.wrench, robot.space)
    where = where_from(robot, asked.place)
    if on_bodies or (isinstance(robot, Robot | Snapshot) and robot.springs):
        # what legs alone do not decide takes twice as long to import
        from robostiff.cli.commands_loads import body_loads
        from robostiff.statics import deflection as deflection_by_bodies

        g, loads = gravity_from(written.gravity), body_loads(written)
        result = deflection_by_bodies(robot, wrench=F, loads=loads, gravity=g, **where)
    else:
        from robostiff.analysis import deflection

        result = deflection(robot, wrench=F, **where)
    return answered(page_of(result), asked.answer)


def print_indices(asked: PrintIndices) -> int:
    """Print the stiffness indices at a pose; 1 for a bad status."""
    from robostiff.analysis.indices import indices
    from robostiff.model.cable import CableRobot

    robot = loaded(asked.model, asked.place)
    if isinstance(robot, CableRobot):
        raise InputError(
            f"indices of {robot.name!r}",
            got="a cable robot",
            expected="a robot with legs: the stiffness of cables depends on their tensions",
        )
    result = stiffness(robot, **where_from(robot, asked.place))
    if not result.answered.all():
        from robostiff.page.indices import indices_page

        return answered(indices_page(result), asked.answer)
    return answered(page_of(indices(result, length=length_from(asked.length))), asked.answer)


def print_verification(asked: PrintVerification) -> int:
    """Print the distances between the methods at a pose; 1 when they disagree."""
    from robostiff.analysis.verification import verify

    robot, place = asked.model.load(), asked.place
    result = verify(robot, pose_from(robot, place), near=near_from(robot, place))
    answered(page_of(result), asked.answer)
    return 0 if result.agree else BAD_STATUS


_RULES = ("nearest", "closed-form")


def print_cables(asked: PrintCables) -> int:
    """Print tensions and stiffness at a pose, and the response to a load with locked winches."""
    from robostiff.analysis import cable_stiffness
    from robostiff.model.cable import CableRobot
    from robostiff.statics import cable_response

    robot, source = asked.model.load(), asked.model.source
    if not isinstance(robot, CableRobot):
        raise InputError(
            "robot of cables",
            got=source,
            expected="a robot with cables, such as cable-8",
            hint=f"write 'robostiff stiffness {source}' for a robot with legs",
        )
    wrench, balance = asked.wrench, asked.balance
    rule = _rule(robot, asked.rule, asked.level, asked.tensions)
    pose = pose_from(robot, asked.place)
    if wrench is not None:
        if balance is not None:
            raise InputError("--wrench and --balance", expected="one of them")
        load = wrench_from(wrench, robot.space)
        found = cable_response(robot, pose, load, tensions=rule)
        return answered(page_of(found), asked.answer)
    held = None if balance is None else wrench_from(balance, robot.space, "--balance")
    result = cable_stiffness(robot, pose, held, tensions=rule)
    return answered(page_of(result), asked.answer)


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
