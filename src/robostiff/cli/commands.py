"""The commands ``check``, ``stiffness``, ``deflection`` and ``indices``, after parsing."""

from __future__ import annotations

from typing import Any

from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.stiffness_at_pose import stiffness
from robostiff.cli.answer_commands import Details, Method, WrittenLoads
from robostiff.cli.command import answered, slips
from robostiff.cli.options import Answer, Length, Model, Place, Replacing
from robostiff.cli.output import draw, picture_beside, show
from robostiff.cli.written_arguments import (
    chosen,
    gravity_from,
    length_from,
    loaded,
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
from robostiff.io.results import deflection_data, deflection_text, stiffness_data, stiffness_text
from robostiff.model import Robot, Snapshot

METHODS: dict[str, Form] = {
    form.name: form for form in (WrenchBasis(), SaddlePoint(), Block(), Recursive(), IndexRules())
}


def check_robot(model: Model, details: Details, replacing: Replacing, answer: Answer) -> int:
    """Print the parts of a robot; reading the file checks it."""
    from robostiff.cli import robot_facts as facts_of
    from robostiff.model.cable import CableRobot
    from robostiff.network import Network

    picture = picture_beside(details.plot, replacing)
    doubts: list[str] = []
    with slips(doubts.append):
        robot = model.load()
        if isinstance(robot, CableRobot):
            from robostiff.cli.commands_cables import cable_robot_facts

            facts = cable_robot_facts(robot)
        elif isinstance(robot, Network):
            facts = facts_of.network_facts(robot)
            facts["home"] = facts_of.home_facts(stiffness(robot))
        else:
            facts = (
                facts_of.snapshot_facts(robot)
                if isinstance(robot, Snapshot)
                else facts_of.robot_facts(robot)
            )
        _add_details(facts, robot, details)
    if doubts:
        facts["warnings"] = doubts
    if picture is not None:
        from robostiff.plot.posed_robot import Colouring, picture_of_robot

        draw(picture_of_robot(robot, colouring=Colouring.NAMES), picture)
        facts["picture"] = str(picture)
    show(facts if answer.as_json else facts_of.facts_text(facts))
    return 0


def _add_details(facts: dict[str, Any], robot: Any, details: Details) -> None:
    """Freedoms of the platform at home; parts at home, where they are wanted."""
    from robostiff.analysis.parts_at_home import mobility_at_home, parts_at_home

    if isinstance(robot, Robot) and robot.coordinates:
        facts["mobility"] = mobility_at_home(robot)
    if details.parts and str(Status.UNREACHABLE) not in facts["home"]["status"]:
        facts["parts"] = parts_at_home(robot)


def print_stiffness(model: Model, place: Place, method: Method, answer: Answer) -> int:
    """Print K at a pose."""
    form = chosen("--method", method.method, METHODS)
    robot = loaded(model, place)
    result = stiffness(robot, method=form, **where_from(robot, place))
    if not isinstance(result, RobotStiffness):
        from robostiff.cli.commands_cables import print_cable_stiffness

        return print_cable_stiffness(result, answer)
    return answered(result, answer, stiffness_data, stiffness_text)


def print_deflection(model: Model, written: WrittenLoads, place: Place, answer: Answer) -> int:
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
    if on_bodies or getattr(robot, "springs", ()):
        result = _deflection_by_bodies(robot, F, written, where)
    else:
        from robostiff.analysis import deflection

        result = deflection(robot, wrench=F, **where)
    return answered(result, answer, deflection_data, deflection_text)


def _deflection_by_bodies(robot: Any, F: Any, written: WrittenLoads, where: dict[str, Any]) -> Any:
    """With what legs alone do not decide, which takes twice as long to import."""
    from robostiff.cli.commands_equilibrium import body_loads
    from robostiff.statics import deflection

    g = None if written.gravity is None else gravity_from(written.gravity)
    return deflection(robot, wrench=F, loads=body_loads(written), gravity=g, **where)


def print_indices(model: Model, place: Place, length: Length, answer: Answer) -> int:
    """Print the stiffness indices at a pose; 1 for a bad status."""
    from robostiff.analysis.indices import indices
    from robostiff.io.results.indices import indices_data, indices_text
    from robostiff.model.cable import CableRobot

    robot = loaded(model, place)
    if isinstance(robot, CableRobot):
        raise InputError(
            f"indices of {robot.name!r}",
            got="a cable robot",
            expected="a robot with legs: the stiffness of cables depends on their tensions",
        )
    result = stiffness(robot, **where_from(robot, place))
    found = indices(result, length=length_from(length)) if result.answered.all() else None
    return answered(
        result,
        answer,
        lambda own: indices_data(own, found),
        lambda own: stiffness_text(own) if found is None else indices_text(found),
    )
