"""Commands that write formulas, model files and other formats."""

from __future__ import annotations

import click

from robostiff.cli.options import (
    Answer,
    Command,
    Model,
    Posing,
    argument,
    group,
    option,
    output_option,
    plot_option,
    repeatable,
)

FORMATS = ("text", "latex", "pdf", "md", "html", "json", "python", "c", "julia", "matlab")
_GRAVITY = "Acceleration of free fall: -z, or three numbers with units; by default the model's."
_PARAMETERS = (
    "What is to be found: drives and springs by name, as arm/joint* (their compliance); "
    "arm/forearm.factor, arm/joint3.zero, arm/joint2.play; or parameters of the model file"
)
_OUTPUT = "The file to write; standard output when left out."


class Derive(Command, name="derive", run="commands_derive:print_formula"):
    """Write the stiffness matrix of a robot as a formula.

    It is text, LaTeX, PDF, Markdown, HTML, JSON, Python, C, Julia or MATLAB.

    $ derive gough-stewart-b
    $ derive gough-stewart-a --rank --free-motions
    $ derive 3-rpr --pose symbolic --steps -o stiffness.pdf
    $ derive hexapod --pose symbolic --angles ZXZ
    $ derive hexapod --symbols R,r --pose "z=0.85, gamma=10 deg" -o hexapod.py
    $ derive gough-stewart-b-beams --leg leg1
    $ derive delta --snippet

    Exit status: 0 for a formula, 2 for bad input or a formula beyond the limit, 130 when
    interrupted.
    """

    model: Model = group(Model, "source", "settings")
    pose: str = option(
        "--pose",
        metavar="POSE",
        default="home",
        help="home; symbolic, a general pose in symbols; joints, the joint coordinates of the legs "
        "in symbols; or coordinates with units, such as "
        "'x=100 mm, gamma=10 deg' (q1, q2 ... of a serial arm). Others stay at home.",
    )
    angles: str | None = option(
        "--angles",
        metavar="NAME",
        help="Coordinates of the rotation of --pose: rpy, quaternion, or Euler angles such as ZXZ "
        "(axes that move along) or xyz (axes that stay).",
    )
    symbols: str = option(
        "--symbols",
        metavar="NAMES",
        default="all",
        help="Parameters that are symbols, such as R,r,h; all; or none. The others are numbers. "
        "all,cylinder=c gives a symbol a shorter name.",
    )
    leg: str | None = option(
        "--leg",
        metavar="NAME",
        help="One leg alone: its stiffness without passive joints, then joint by joint.",
    )
    steps: bool = option(
        "--steps",
        help="Named steps of moderate size, entry by entry; away from home the default where "
        "the legs have no form in vectors.",
    )
    closed: bool = option("--closed", help="One expression for each entry; the default at home.")
    limit: int | None = option(
        "--limit",
        metavar="TERMS",
        type=click.IntRange(min=1),
        help="Most terms of an entry of a closed form, at least 1.",
    )
    budget: float = option(
        "--budget",
        metavar="SECONDS",
        type=float,
        default=20.0,
        help="Computing time of a closed form; named steps are the answer when it ends.",
    )
    derivative: str | None = option(
        "--derivative", metavar="SYMBOL", help="dK by a symbol in place of K."
    )
    rank: bool = option("--rank", help="Print the rank of K and where it drops, in place of K.")
    free_motions: bool = option("--free-motions", help="Print the free motions, in place of K.")
    format: str | None = option(
        "--format",
        metavar="NAME",
        help=f"{', '.join(FORMATS)}; that of the file's name, or text, when left out.",
    )
    output: str | None = output_option(_OUTPUT, None)
    snippet: bool = option(
        "--snippet", help="LaTeX of the matrix, or of one leg, with nothing around it: for a paper."
    )
    answer: Answer = group(Answer)

    @property
    def asks(self) -> bool:
        """Whether properties of the formula are printed in place of it."""
        return self.rank or self.free_motions


class Compensate(Command, name="compensate", run="commands_compensate:write_commands"):
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
    gravity: str | None = option("--gravity", metavar="AXIS", help=_GRAVITY)
    output: str | None = output_option("The path with commands, a new file.", None)
    plot: str | None = plot_option("Draw how far the path is off", ".png, .svg or .pdf")
    answer: Answer = group(Answer)


class Identify(Command, name="identify", run="commands_identify:identify_robot"):
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
    unknowns: tuple[str, ...] = repeatable("--parameters", "NAMES", _PARAMETERS)
    fixed: tuple[str, ...] = repeatable("--fixed", "NAMES", "Names of them that keep their values")
    shared: bool = option("--shared", help="A name with * is one number for all parts it fits.")
    markers: tuple[str, ...] = repeatable(
        "--marker", "NAME=X Y Z", "Where a marker is in the platform frame, or about where"
    )
    instrument: str | None = option(
        "--instrument",
        metavar='"x y z rx ry rz"',
        help="Where the instrument is in the world, and the rotation vector from world to "
        "instrument axes; to be found by default.",
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
        "--hook", "NAME=X Y Z", "Where a hook that the column at names is, in the platform frame"
    )
    sigma: str | None = option(
        "--sigma",
        metavar='"LENGTH ANGLE"',
        help="Standard deviations of lengths and turns that the file does not have.",
    )
    loss: str = option(
        "--loss", metavar="NAME", default="squares", help="squares; or robust, for outliers."
    )
    gravity: str | None = option("--gravity", metavar="AXIS", help=_GRAVITY)
    output: str | None = output_option("The model file with these values, a new file.", None)
    plot: str | None = plot_option("Draw residuals", ".png, .svg or .pdf")
    answer: Answer = group(Answer)


class Plan(Command, name="plan", run="commands_identify:plan_campaign"):
    """Choose postures at which measurements determine parameters best.

    $ plan arm.yaml --parameters "arm/joint*" --count 20 --force "0 0 -1500 N" -o plan.csv
    $ plan arm.yaml --parameters "arm/joint*" --criterion test-pose --wrench "0 0 -500 N 0 0 0"

    Exit status: 0 for postures, 1 where no choice determines all, 2 for bad input.
    """

    model: Model = group(Model)
    unknowns: tuple[str, ...] = repeatable("--parameters", "NAMES", _PARAMETERS)
    fixed: tuple[str, ...] = repeatable("--fixed", "NAMES", "Names of them that keep their values")
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
        "--hook", metavar='"x y z"', help="Where loads act, in the platform frame."
    )
    markers: tuple[str, ...] = repeatable(
        "--marker", "NAME=X Y Z", "Where a marker is in the platform frame, or about where"
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
    gravity: str | None = option("--gravity", metavar="AXIS", help=_GRAVITY)
    seed: int = option(
        "--seed", metavar="NUMBER", type=int, default=0, help="Seed of random poses."
    )
    output: str | None = output_option("The postures as a CSV file, a new file.", None)
    place: Posing = group(Posing, "pose", "joints")
    answer: Answer = group(Answer)


class PrintSchema(Command, name="schema", run="commands_files:print_schema"):
    """Print the JSON schema of a file format, by which editors complete and explain keys.

    $ schema model -o robostiff.schema.json

    Exit status: 0 for a schema, 2 for bad input.
    """

    form: str = argument("[model|snapshot|graph]", "The file format.", "model")
    output: str | None = output_option(_OUTPUT, None)
    answer: Answer = group(Answer)


class WriteNew(Command, name="new", run="commands_files:write_new"):
    """Write a model file to begin with, which can be used as it is. Nothing is replaced.

    $ new my-arm --template arm
    $ new my-delta --template delta

    Exit status: 0 for a new file, 2 for bad input.
    """

    new_name: str = argument("NAME", "Of the robot, and of NAME.yaml.")
    template: str = option(
        "--template",
        metavar="NAME",
        default="parallel",
        help="arm (by a table of Denavit and Hartenberg), beams (an arm element by element), "
        "parallel, planar, cables, or a shipped robot to copy.",
    )
    answer: Answer = group(Answer, "as_json")


class Convert(Command, name="convert", run="commands_files:convert"):
    """Write a robot at a pose as a file: a snapshot, or a finite element model.

    $ convert hexapod --pose "0 0 0.85 0 0 0" --to graph -o hexapod.json
    $ convert hexapod --pose "0 0 0.85 0 0 0" --to opensees -o hexapod.tcl

    Exit status: 0 for a file, 1 when the pose is out of reach, 2 for bad input.
    """

    model: Model = group(Model)
    form: str = option(
        "--to",
        metavar="snapshot|graph|opensees|calculix",
        default="snapshot",
        help="By legs, or as bodies and joints (.json or .yaml); or a model of OpenSees (.tcl or "
        ".py) or CalculiX (.inp).",
    )
    output: str | None = output_option(_OUTPUT, None)
    place: Posing = group(Posing, "pose", "joints", "near")
    answer: Answer = group(Answer)
