"""The commands ``identify`` and ``plan``: parameters from measurements, and where to measure."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from robostiff.cli.command import answered
from robostiff.cli.options import Model, named_values
from robostiff.cli.options_of_files import Identify, Plan
from robostiff.cli.output import draw, new_file, picture_beside
from robostiff.cli.written_arguments import chosen, gravity_from, pose_from, wrench_from
from robostiff.errors import InputError
from robostiff.identification.choice_of_poses import (
    AOptimal,
    DOptimal,
    TestPose,
    choose_poses,
    random_postures,
)
from robostiff.identification.frames import KnownFrames, UnknownFrames
from robostiff.identification.identified import FitStatus
from robostiff.identification.identify import Robust, Squares, identify
from robostiff.identification.measurements import Measurements, coordinates_of
from robostiff.io.units import Dimension, parse_quantities
from robostiff.io.whole_file import whole_file
from robostiff.kinematics import ActuatorCoordinates, JointCoordinates, find_posture
from robostiff.kinematics.pose import joint_units
from robostiff.model import Robot
from robostiff.page.identification import chosen_poses_page, identification_page
from robostiff.robots.shipped import robot_file, shipped_names

_POSE = (*(Dimension.LENGTH,) * 3, *(Dimension.ANGLE,) * 3)


def identify_robot(asked: Identify) -> int:
    """Print what measurements tell of a robot; 1 where something asked for is not identified."""
    losses = {"squares": Squares(), "robust": Robust()}
    loss = chosen("--loss", asked.loss, losses)
    output = None if asked.output is None else new_file("-o", asked.output, asked.answer.overwrite)
    picture = picture_beside(asked.plot, asked.answer, is_scene=False)
    robot = _robot(asked.model, asked.unknowns)
    markers = _markers(asked.markers)
    frames: Any = UnknownFrames()
    if asked.instrument is not None or markers:
        place = asked.instrument and parse_quantities(
            asked.instrument, _POSE, ("x", "y", "z", "rx", "ry", "rz"), "--instrument"
        )
        frames = KnownFrames(markers or None, place)
    sigma = parse_quantities(
        asked.sigma or "", (Dimension.LENGTH, Dimension.ANGLE), ("sigma", "turn"), "--sigma"
    ) if asked.sigma else ()  # fmt: skip
    columns = None if asked.columns is None else asked.columns.split(",")
    given = {"columns": columns, "hooks": _markers(asked.hooks, "--hook"), "sigma": sigma}
    measured = Measurements.read(asked.path, robot, joints=asked.postures, **given)
    found = identify(
        robot,
        measured,
        asked.unknowns,
        fixed=asked.fixed,
        shared=asked.shared,
        frames=frames,
        loss=loss,
        gravity=gravity_from(asked.gravity),
    )
    if output is not None and found.status is not FitStatus.TOO_FEW_ROWS:
        source = asked.model.source
        found.write(output, robot_file(source) if source in shipped_names() else source)
    if picture is not None and found.status is not FitStatus.TOO_FEW_ROWS:
        from robostiff.plot.residuals import residuals_picture

        draw(residuals_picture(found), picture)
    return answered(identification_page(found), asked.answer)


def plan_campaign(asked: Plan) -> int:
    """Print, and write, postures to measure at."""
    output = None if asked.output is None else new_file("-o", asked.output, asked.answer.overwrite)
    robot = _robot(asked.model, asked.unknowns)
    if asked.criterion == "test-pose":
        if asked.wrench is None:
            raise InputError(
                "--criterion test-pose", got="no --wrench", expected="the load at the pose"
            )
        pose = pose_from(robot, asked.place)
        if isinstance(pose, ActuatorCoordinates):
            pose = JointCoordinates(find_posture(robot.numeric, pose).coordinates[0])
        elif pose is None:
            home = find_posture(robot.numeric)
            pose = home.pose[:, robot.coordinate_places]
            if robot.is_posed_by_joints:
                pose = JointCoordinates(home.coordinates[0])
        criterion: Any = TestPose(pose, wrench_from(asked.wrench, robot.space))
    else:
        named = {"d": DOptimal(), "a": AOptimal(), "test-pose": None}
        criterion = chosen("--criterion", asked.criterion, named)
    lengths, force = (Dimension.LENGTH,) * 3, (Dimension.FORCE,) * 3
    (sigma,) = parse_quantities(asked.sigma, [Dimension.LENGTH], ["sigma"], "--sigma")
    hook = asked.hook and parse_quantities(asked.hook, lengths, ("x", "y", "z"), "--hook")
    forces = [parse_quantities(own, force, ("Fx", "Fy", "Fz"), "--force") for own in asked.forces]
    candidates = random_postures(robot, asked.candidates, asked.seed)
    found = choose_poses(
        robot,
        candidates,
        asked.count,
        asked.unknowns,
        _markers(asked.markers) or {"marker": np.zeros(3)},
        criterion=criterion,
        forces=forces or None,
        hook=hook or None,
        sigma=sigma,
        fixed=asked.fixed,
        gravity=gravity_from(asked.gravity),
        seed=asked.seed,
    )
    if output is not None:
        with whole_file(output) as begun:
            begun.write_text(_table(robot, found.postures), encoding="utf-8")
    return answered(chosen_poses_page(robot.name, found), asked.answer)


def _robot(model: Model, patterns: Sequence[str]) -> Robot:
    """The robot with the parameters of its file that fit the patterns as symbols."""
    robot = model.load()
    if not isinstance(robot, Robot):
        raise InputError(
            "robot to identify", got=model.source, expected="a robot of legs, or an arm"
        )
    from robostiff.io.model_file import ALL_PARAMETERS

    if any("/" not in own for own in patterns):
        whole = model.load(symbols=ALL_PARAMETERS)
        fits = {str(x) for x in whole.symbols for own in patterns if fnmatchcase(str(x), own)}
        return model.load(symbols=tuple(sorted(fits))) if fits else robot
    return robot


def _markers(texts: tuple[str, ...], option: str = "--marker") -> dict[str, list[float]]:
    """Places of markers, or hooks, in the platform frame."""
    pairs = named_values(option, texts, "NAME=X Y Z")
    lengths = (Dimension.LENGTH,) * 3
    return {name: parse_quantities(own, lengths, ("x", "y", "z"), option) for name, own in pairs}


def _table(robot: Robot, postures: Any) -> str:
    """A file of postures, to be completed by readings, in degrees and millimetres."""
    if isinstance(postures, JointCoordinates):
        chain = robot.numeric.legs[0].chain
        names, units = chain.coordinate_names, joint_units(chain)
    else:
        names = tuple(f"pose_{own.value}" for own in robot.coordinates)
        units = tuple("rad" if name[5] == "r" else "m" for name in names)
    words = [f"{name} [{'deg' if unit == 'rad' else 'mm'}]"
             for name, unit in zip(names, units, strict=True)]  # fmt: skip
    factor = [180 / np.pi if unit == "rad" else 1e3 for unit in units]
    rows = [
        ",".join([str(k + 1), *(f"{x:.6f}" for x in row * factor)])
        for k, row in enumerate(coordinates_of(postures))
    ]
    return "\n".join([",".join(["posture", *words]), *rows]) + "\n"
