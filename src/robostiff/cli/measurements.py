"""Commands about measured robots and their paths: identify, plan and compensate."""

from __future__ import annotations

from typing import Any

import click

from robostiff.cli.command import print_answer
from robostiff.cli.options import (
    Answer,
    Command,
    Model,
    Posing,
    argument,
    gravity_option,
    group,
    named_values,
    option,
    output_option,
    plot_option,
    repeatable,
)
from robostiff.cli.output import draw, output_beside, picture_beside, write_to
from robostiff.errors import InputError, Words, warn_of_slip
from robostiff.frozen import frozen


@frozen
class Sought:
    """What is to be found of a robot, and the markers that show it."""

    unknowns: tuple[str, ...] = repeatable(
        "--parameters",
        "NAMES",
        "What is to be found: drives and springs by name, as arm/joint* (their compliance); "
        "arm/forearm.factor, arm/joint3.zero, arm/joint2.play; or parameters of the model file",
    )
    fixed: tuple[str, ...] = repeatable("--fixed", "NAMES", "Names of them that keep their values")
    markers: tuple[str, ...] = repeatable(
        "--marker", "NAME=X Y Z", "Where a marker is in the platform frame, or about where"
    )
    gravity: str | None = gravity_option()

    def robot(self, model: Model) -> Any:
        """The robot with the parameters of its file that are sought as symbols."""
        from fnmatch import fnmatchcase

        from robostiff.cli.arguments import check_kind
        from robostiff.io.model_file import ALL_PARAMETERS

        robot, patterns = model.load(), self.unknowns
        check_kind(robot, {"robot"}, "robot to identify", expected="a robot of legs, or an arm")
        if any("/" not in p for p in patterns):
            whole = model.load(symbols=ALL_PARAMETERS)
            fits = {str(x) for x in whole.symbols for p in patterns if fnmatchcase(str(x), p)}
            return model.load(symbols=tuple(sorted(fits))) if fits else robot
        return robot

    def places(self) -> dict[str, list[float]]:
        """Places of the markers in the platform frame."""
        from robostiff.cli.arguments import three_lengths

        pairs = named_values("--marker", self.markers, "NAME=X Y Z")
        return {name: three_lengths(text, "--marker") for name, text in pairs}


class Compensate(Command, name="compensate"):
    """Write the commands by which a loaded robot follows a path.

    The path is a CSV file with units in its headings: pose coordinates or joints, and the process
    force, such as x [mm], y [mm], z [mm], Fz [N]. Everything in it stays, commands come behind.

    $ compensate hexapod path.csv -o corrected.csv
    $ compensate six-joint-arm path.csv --gravity=-z --axes tool -o corrected.csv --plot path.svg

    Exit status: 0 for commands, 1 where a point has a bad status, 2 for bad input.
    """

    model: Model = group(Model)
    path: str = argument("FILE.csv", "The path: a line of headings with units, a line a point.")
    method: str = option(
        "--method",
        metavar="NAME",
        default="exact",
        help="exact, until nothing is missing; or mirror, the deviation of the target taken off.",
    )
    axes: str = option(
        "--axes",
        metavar="NAME",
        default="world",
        help="Axes of the process force: world; tool, those of the platform; or path, x along the "
        "direction of travel.",
    )
    angles: str | None = option(
        "--angles",
        metavar="ORDER",
        help="Order of Euler angles in the columns rx, ry, rz: zyx about axes that stay, ZYX about "
        "axes that move along. By default they are a rotation vector.",
    )
    gravity: str | None = gravity_option()
    output: str | None = output_option("The path with commands, a new file.", None)
    plot: str | None = plot_option("Draw how far the path is off", ".png, .svg or .pdf")
    answer: Answer = group(Answer)

    def run(self) -> int:
        """Write the commands of a path; 1 where a point has a bad status."""
        from robostiff.cli import arguments as written
        from robostiff.compensation.compensate import Axes, Exact, Mirror, compensate
        from robostiff.compensation.program_file import read_program, write_program

        method = written.choice("--method", self.method, {"exact": Exact(), "mirror": Mirror()})
        axes = written.choice("--axes", self.axes, {axis.value: axis for axis in Axes})
        output = output_beside(self.output, self.answer)
        picture = picture_beside(self.plot, self.answer, is_scene=False)
        robot = self.model.load()
        expected = "a robot of legs, whose drives take commands"
        written.check_kind(robot, {"robot"}, "robot to compensate", expected=expected)
        program = read_program(robot, self.path, angles=self.angles)
        options = {"axes": axes, "gravity": written.gravity(self.gravity)}
        if not program.wrenches.any() and self.gravity is None and robot.gravity is None:
            axes_of_load = " ".join(robot.space.wrench_order)
            warn_of_slip(f"{self.path}: no load, in columns {axes_of_load} or as --gravity")
        result = compensate(robot, program.poses, program.wrenches, method, **options)
        if output is not None:
            write_program(program, result, output)
        if picture is not None:
            from robostiff.plot.bars_and_curves import compensation_picture

            draw(compensation_picture(result), picture)
        return print_answer(result, self.answer)


class Identify(Command, name="identify"):
    """Find compliances, lengths and zeros of a robot from measurements under load.

    The measurements are a CSV file with units in its headings: joints or pose, loads, and what was
    read of markers, such as joint1 [deg], Fz [N], marker, x [mm], y [mm], z [mm], sigma [um].

    $ identify arm.yaml campaign.csv --parameters "arm/joint*" -o arm-identified.yaml
    $ identify hexapod.yaml gauges.csv --parameters "leg*/strut" --marker "m1=0.2 0 0.05"

    Exit status: 0 for values, 1 where one asked for is not identified or the fit is bad, 2 for bad
    input.
    """

    model: Model = group(Model)
    path: str = argument("FILE.csv", "The measurements: a line of headings, a line a reading.")
    sought: Sought = group(Sought)
    shared: bool = option("--shared", help="A name with * is one number for all parts it fits.")
    instrument: str | None = option(
        "--instrument",
        metavar='"x y z rx ry rz"',
        help="Where the instrument is in the world, and the rotation vector that takes components "
        "in world axes to those in instrument axes; to be found by default.",
    )
    postures: str | None = option(
        "--postures", metavar="FILE.csv", help="Those of the points of a tracker export, and loads."
    )
    columns: str | None = option(
        "--columns",
        metavar="HEADINGS",
        help="Of a file without them, with commas between: 'n1.x [mm],n1.y [mm],n1.z [mm],"
        "joint1 [deg],,'; what has none is passed over.",
    )
    hooks: tuple[str, ...] = repeatable(
        "--hook",
        "NAME=[BODY] X Y Z",
        "Where a hook that the column at names is, in the frame of the platform or of a body, such "
        "as elbow=arm/joint3 0.1 0 0",
    )
    sigma: str | None = option(
        "--sigma",
        metavar='"LENGTH ANGLE"',
        help="Standard deviation of a reading, where the file has none: of lengths, and of turns.",
    )
    loss: str = option(
        "--loss", metavar="NAME", default="squares", help="squares; or robust, for outliers."
    )
    output: str | None = output_option(
        "The model file with these values, or the side file of a description, anew.", None
    )
    plot: str | None = plot_option(
        "Draw residuals", ".png, .svg or .pdf; or .html, with all tables above"
    )
    answer: Answer = group(Answer)

    def run(self) -> int:
        """Print what measurements tell of a robot; 1 where a parameter is not identified."""
        from robostiff.cli import arguments as written
        from robostiff.identification.identify import KnownFrames, UnknownFrames, identify
        from robostiff.identification.measurements import Measurements
        from robostiff.identification.search import Robust, Squares
        from robostiff.io.units import Dimension, parse_quantities
        from robostiff.robots.shipped import robot_file, shipped_names

        losses = {"squares": Squares(), "robust": Robust()}
        loss = written.choice("--loss", self.loss, losses)
        output = output_beside(self.output, self.answer)
        picture = picture_beside(self.plot, self.answer)
        sought = self.sought
        robot, markers = sought.robot(self.model), sought.places()
        frames: Any = UnknownFrames()
        if self.instrument is not None or markers:
            place = self.instrument and written.six_coordinates(self.instrument, "--instrument")
            frames = KnownFrames(markers or None, place)
        units, names = (Dimension.LENGTH, Dimension.ANGLE), ("length", "angle")
        sigma = parse_quantities(self.sigma, units, names, "--sigma") if self.sigma else ()
        expected = "NAME=[BODY] X Y Z"
        measured = Measurements.read(
            self.path,
            robot,
            joints=self.postures,
            columns=None if self.columns is None else self.columns.split(","),
            hooks={name: _hook(x) for name, x in named_values("--hook", self.hooks, expected)},
            sigma=sigma,
        )
        result = identify(
            robot,
            measured,
            sought.unknowns,
            fixed=sought.fixed,
            shared=self.shared,
            frames=frames,
            loss=loss,
            gravity=written.gravity(sought.gravity),
        )
        status = print_answer(result, self.answer)
        if output is not None:
            source = self.model.side or self.model.source
            result.write(output, robot_file(source) if source in shipped_names() else source)
        if picture is not None:
            from robostiff.markup import escaped
            from robostiff.plot.bars_and_curves import residuals_picture
            from robostiff.plot.in_notebooks import picture_html

            if picture.suffix.lower() == ".html":  # tables, advice and residuals, as in notebooks
                title = f"<title>{escaped(result.robot.name)}, identified</title>"
                head = (
                    f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">{title}</head>'
                )
                body = f"<body>{result._repr_html_()}{picture_html(result)}</body>"
                write_to(picture, f"{head}\n{body}</html>\n")
            else:
                draw(residuals_picture(result), picture)
        return status


class Plan(Command, name="plan"):
    """Choose postures at which measurements determine parameters best.

    $ plan arm.yaml --parameters "arm/joint*" --count 20 --force "0 0 -1500 N" -o plan.csv
    $ plan arm.yaml --parameters "arm/joint*" --criterion test-pose --wrench "0 0 -500 N 0 0 0"

    Exit status: 0 for postures, 1 where no choice determines all, 2 for bad input.
    """

    model: Model = group(Model)
    sought: Sought = group(Sought)
    count: int = option(
        "--count", metavar="N", type=click.IntRange(min=1), default=20, help="Postures to choose."
    )
    candidates: int = option(
        "--candidates",
        metavar="N",
        type=click.IntRange(min=1, max=100_000),
        default=500,
        help="Postures to choose from, all over the range of the robot.",
    )
    forces: tuple[str, ...] = repeatable(
        "--force", '"Fx Fy Fz"', "A load that is hung on at every posture, beside no load"
    )
    hook: str | None = option(
        "--hook",
        metavar='"[BODY] x y z"',
        help="Where loads act, in the frame of the platform or of a body.",
    )
    sigma: str = option(
        "--sigma", metavar="LENGTH", default="20 um", help="Standard deviation of a coordinate."
    )
    criterion: str = option(
        "--criterion",
        metavar="NAME",
        default="d",
        help="d, the volume of all errors; a, the sum of their squares; or test-pose, the error "
        "left after compensation at --pose or --joints under --wrench.",
    )
    wrench: str | None = option(
        "--wrench", metavar='"Fx Fy Fz Mx My Mz"', help="Load at the test pose."
    )
    seed: int = option(
        "--seed", metavar="NUMBER", type=int, default=0, help="Seed of random poses."
    )
    output: str | None = output_option("The postures as a CSV file, a new file.", None)
    place: Posing = group(Posing, "pose", "joints")
    answer: Answer = group(Answer)

    def run(self) -> int:
        """Print, and write, postures to measure at."""
        from robostiff.cli import arguments as written
        from robostiff.identification.choice_of_poses import (
            AOptimal,
            DOptimal,
            choose_poses,
            random_postures,
        )
        from robostiff.page.calibration_and_design import chosen_poses_page

        output = output_beside(self.output, self.answer)
        sought = self.sought
        robot = sought.robot(self.model)
        criteria: dict[str, Any] = {"d": DOptimal(), "a": AOptimal(), "test-pose": None}
        criterion = written.choice("--criterion", self.criterion, criteria)
        criterion = criterion or self._test_pose(robot)
        body, place = _hook(self.hook) if self.hook else ("", None)
        choice = choose_poses(
            robot,
            random_postures(robot, self.candidates, self.seed),
            self.count,
            sought.unknowns,
            sought.places() or {"marker": [0.0, 0.0, 0.0]},
            criterion=criterion,
            forces=[written.force(text, "--force") for text in self.forces] or None,
            hook=place,
            body=body,
            sigma=written.length(self.sigma, "--sigma") or 0.0,
            fixed=sought.fixed,
            gravity=written.gravity(sought.gravity),
            seed=self.seed,
        )
        if output is not None:
            write_to(output, _table(robot, choice.postures))
        return print_answer(chosen_poses_page(robot.name, choice), self.answer)

    def _test_pose(self, robot: Any) -> Any:
        """The error at a pose under a wrench, as a criterion."""
        from robostiff.cli import arguments as written
        from robostiff.identification.choice_of_poses import TestPose
        from robostiff.kinematics import JointCoordinates, find_posture

        if self.wrench is None:
            expected = "the load at the pose"
            raise InputError("--criterion test-pose", got=Words("no --wrench"), expected=expected)
        pose = written.pose(robot, self.place)
        if not isinstance(pose, JointCoordinates):
            posture = find_posture(robot.numeric, pose)
            if not posture.reached.all():
                got, why = Words("a pose out of reach"), "; ".join(posture.complaints)
                raise InputError("test pose", got=got, expected="one in reach", hint=why)
            pose = posture.pose[:, robot.coordinate_places]
            if robot.is_posed_by_joints:
                pose = JointCoordinates(posture.coordinates[0])
        return TestPose(pose, written.wrench(self.wrench, robot.space))


def _hook(text: str) -> tuple[str, list[float]]:
    """A body, the platform without one, and a place in its frame."""
    from robostiff.cli.arguments import three_lengths

    first, _, rest = text.strip().partition(" ")
    body, place = (first, rest) if "/" in first else ("", text)
    return body, three_lengths(place, "--hook")


def _table(robot: Any, postures: Any) -> str:
    """A file of postures, to be completed by readings, in degrees and millimetres."""
    import numpy as np

    from robostiff.analysis.maps.pose_columns import POSE_UNITS, coordinate_units
    from robostiff.identification.measurement_kinds import coordinates_of
    from robostiff.kinematics import JointCoordinates

    units = coordinate_units(robot)
    if not isinstance(postures, JointCoordinates):
        units = {f"pose_{c.value}": POSE_UNITS[c.value] for c in robot.coordinates}
    shown = {"rad": ("deg", 180 / np.pi), "m": ("mm", 1e3)}
    lines = [",".join(["posture", *(f"{name} [{shown[u][0]}]" for name, u in units.items())])]
    rows = coordinates_of(postures) * [shown[u][1] for u in units.values()]
    lines += [",".join([str(k), *(f"{x:.6f}" for x in row)]) for k, row in enumerate(rows, 1)]
    return "\n".join(lines) + "\n"
