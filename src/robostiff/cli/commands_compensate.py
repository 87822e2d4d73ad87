"""The command ``compensate``: a path with process forces, and the commands that follow it."""

from __future__ import annotations

from robostiff.cli.command import answered
from robostiff.cli.options_of_files import Compensate
from robostiff.cli.output import draw, new_file, picture_beside
from robostiff.cli.written_arguments import chosen, gravity_from
from robostiff.compensation.compensate import Axes, Exact, Mirror, compensate
from robostiff.compensation.program_file import read_program, write_program
from robostiff.errors import InputError
from robostiff.model import Robot
from robostiff.page.compensation import compensation_page


def write_commands(asked: Compensate) -> int:
    """Write the commands of a path; 1 where a point has a bad status."""
    methods = {"exact": Exact(), "mirror": Mirror()}
    method = chosen("--method", asked.method, methods)
    axes = chosen("--axes", asked.axes, {each.value: each for each in Axes})
    output = None if asked.output is None else new_file("-o", asked.output, asked.answer.overwrite)
    picture = picture_beside(asked.plot, asked.answer, is_scene=False)
    robot = asked.model.load()
    if not isinstance(robot, Robot):
        raise InputError(
            "robot to compensate",
            got=asked.model.source,
            expected="a robot of legs, whose drives take commands",
        )
    program = read_program(robot, asked.path, angles=asked.angles)
    found = compensate(
        robot,
        program.poses,
        program.wrenches,
        method,
        axes=axes,
        gravity=gravity_from(asked.gravity),
    )
    if output is not None:
        write_program(program, found, output)
    if picture is not None:
        from robostiff.plot.residuals import compensation_picture

        draw(compensation_picture(found), picture)
    return answered(compensation_page(found), asked.answer)
