"""Commands of ``robostiff``; heavy imports happen inside them, so that help is fast."""

from __future__ import annotations

from typing import Annotated

import typer

from robostiff.cli import cable_options, check_options, derive_options, map_options, report_options
from robostiff.cli.equilibrium_command import equilibrium, modes
from robostiff.cli.failure import ready_streams, reported
from robostiff.cli.file_formats import convert, new, schema
from robostiff.cli.shared_options import (
    AtOption,
    JointsOption,
    JsonOption,
    NearOption,
    OverwriteOption,
    PoseOption,
    RobotArgument,
    SetOption,
    SideOption,
    XacroOption,
)
from robostiff.cli.view_command import view
from robostiff.version import __version__

app = typer.Typer(
    name="robostiff",
    help="Cartesian stiffness of robots with elastic links, elastic actuators and passive joints.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"robostiff {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    pass


@app.command()
@reported
def robots(json_: JsonOption = False) -> int:
    """List the shipped robots with their sources."""
    from robostiff.cli.commands_robots import list_robots

    return list_robots(json_)


@app.command()
@reported
def check(
    robot: RobotArgument,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    parts: check_options.PartsOption = False,
    plot: check_options.PlotOption = None,
    overwrite: OverwriteOption = False,
    json_: JsonOption = False,
) -> int:
    """Check a model or snapshot file, and list the parts of the robot.

    Example: robostiff check hexapod --parts --plot hexapod.png

    Exit status: 0 when it can be used, 2 when it cannot.
    """
    from robostiff.cli.commands import Details, check_robot
    from robostiff.cli.written_arguments import SideFile

    described = SideFile(side, allow_xacro)
    return check_robot(robot, set_ or [], json_, described, Details(parts, plot, overwrite))


@app.command()
@reported
def stiffness(
    robot: RobotArgument,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    at: AtOption = None,
    method: Annotated[
        str,
        typer.Option(
            "--method",
            metavar="NAME",
            help="wrench-basis, saddle-point, block, recursive or index-rules.",
        ),
    ] = "wrench-basis",
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Print the Cartesian stiffness matrix of a robot at a pose, its rank and free motions.

    Example: robostiff stiffness gough-stewart-b --pose "10 mm 0 0.8 0 0 10 deg"

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands import print_stiffness
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    described, place = SideFile(side, allow_xacro), PoseArguments(pose, joints, at, near)
    return print_stiffness(robot, place, method, set_ or [], json_, described)


@app.command()
@reported
def deflection(
    robot: RobotArgument,
    wrench: Annotated[
        str,
        typer.Option(
            "--wrench",
            metavar='"fx fy fz mx my mz"',
            help="Force [N] and moment [N m] on the platform about the reference point.",
        ),
    ],
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    at: AtOption = None,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Print deflection, elastic energy of parts and actuator loads of a robot under a load.

    Example: robostiff deflection gough-stewart-b-beams --wrench "200 N 0 -500 0 0 0"

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands import print_deflection
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    described, place = SideFile(side, allow_xacro), PoseArguments(pose, joints, at, near)
    return print_deflection(robot, place, wrench, set_ or [], json_, described)


for _command in (equilibrium, modes):
    app.command()(_command)


@app.command()
@reported
def indices(
    robot: RobotArgument,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    at: AtOption = None,
    length: Annotated[
        str | None,
        typer.Option(
            "--length",
            metavar="LENGTH",
            help="Characteristic length of the indices that need one [m]; by default that of "
            "the robot at the pose.",
        ),
    ] = None,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Print stiffness indices: principal stiffnesses, directions, centres and axes.

    Example: robostiff indices hexapod --pose "60 mm 0 0.9 0 10 deg 0" --length "100 mm"

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands_indices import print_indices
    from robostiff.cli.written_arguments import PoseArguments

    return print_indices(robot, PoseArguments(pose, joints, at, near), length, set_ or [], json_)


@app.command()
@reported
def verify(
    robot: RobotArgument,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Compute the stiffness matrix by all methods, and report whether they agree.

    Example: robostiff verify gough-stewart-b --pose "10 mm 0 0.8 0 0 10 deg"

    Exit status: 0 when the methods agree, 1 when they do not, 2 for bad input.
    """
    from robostiff.cli.commands_verify import print_verification
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    described, place = SideFile(side, allow_xacro), PoseArguments(pose, joints, None, near)
    return print_verification(robot, place, set_ or [], json_, described)


@app.command()
@reported
def report(
    robot: RobotArgument,
    output: report_options.OutputOption,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    at: AtOption = None,
    wrench: report_options.WrenchOption = None,
    map_: report_options.MapOption = None,
    finite: report_options.FiniteOption = False,
    pdf: report_options.PdfOption = False,
    compare: report_options.CompareOption = None,
    project: report_options.ProjectOption = "",
    author: report_options.AuthorOption = "",
    date: report_options.DateOption = "",
    revision: report_options.RevisionOption = "",
    overwrite: OverwriteOption = False,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Write all results about a robot as one self-contained HTML page, or as a PDF.

    Example: robostiff report hexapod --wrench "500 N 0 0 0 0 0" -o hexapod.html

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands_report import Pages, make_report
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    block = report_options.title_block(project, author, date, revision)
    pages = Pages(wrench, map_, output, pdf, overwrite, finite, compare, block)
    described, place = SideFile(side, allow_xacro), PoseArguments(pose, joints, at, near)
    return make_report(robot, place, pages, set_ or [], described, as_json=json_)


@app.command("map")
@reported
def map_(
    robot: RobotArgument,
    output: map_options.OutputOption,
    x: map_options.XOption = None,
    y: map_options.YOption = None,
    z: map_options.ZOption = None,
    rx: map_options.RxOption = None,
    ry: map_options.RyOption = None,
    rz: map_options.RzOption = None,
    joint: map_options.JointOption = None,
    poses: map_options.PosesOption = None,
    random: map_options.RandomOption = None,
    seed: map_options.SeedOption = 0,
    quantity: map_options.QuantityOption = None,
    wrench: map_options.WrenchOption = None,
    length: map_options.LengthOption = None,
    near: NearOption = None,
    resume: map_options.ResumeOption = False,
    overwrite: OverwriteOption = False,
    workers: map_options.WorkersOption = None,
    threads: map_options.ThreadsOption = None,
    scheduler: map_options.SchedulerOption = None,
    batched: map_options.BatchedOption = False,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Compute stiffness at many poses: over a grid, along a trajectory, or at random.

    Coordinates left out stay at home.

    Examples
    --------
    robostiff map hexapod --x "-100 mm 100 mm 41" --rz "0 20 deg 5" -o map.nc

    robostiff map hexapod --poses path.csv --quantity deflection --wrench "0 0 -500 N 0 0 0"
    -o path.csv

    robostiff map hexapod --random 1000000 --x "-0.1 0.1" --y "-0.1 0.1" -o map.zarr --resume

    Exit status: 0 for a map, 1 when no pose can be reached, 2 for bad input, 130 when interrupted.
    """
    from robostiff.cli.commands_map import Asked, Run, make_map
    from robostiff.cli.written_arguments import SideFile

    axes = {"x": x, "y": y, "z": z, "rx": rx, "ry": ry, "rz": rz}
    asked = Asked(
        {name: text for name, text in axes.items() if text is not None},
        joint or [],
        poses,
        random,
        seed,
        quantity or [],
        wrench,
        length,
        near,
    )
    run = Run(output, resume, workers, threads, scheduler, batched, overwrite)
    described = SideFile(side, allow_xacro)
    return make_map(robot, asked, run, set_ or [], json_, described)


@app.command()
@reported
def derive(
    robot: RobotArgument,
    pose: derive_options.PoseOption = "home",
    symbols: derive_options.SymbolsOption = "all",
    set_: SetOption = None,
    leg: derive_options.LegOption = None,
    steps: derive_options.StepsOption = False,
    closed: derive_options.ClosedOption = False,
    limit: derive_options.LimitOption = None,
    budget: derive_options.BudgetOption = 20.0,
    format_: derive_options.FormatOption = None,
    output: derive_options.OutputOption = None,
    overwrite: OverwriteOption = False,
    derivative: derive_options.DerivativeOption = None,
    rank: derive_options.RankOption = False,
    free_motions: derive_options.FreeMotionsOption = False,
    eigenvalues: derive_options.EigenvaluesOption = False,
    json_: JsonOption = False,
) -> int:
    """Write the stiffness matrix of a robot as a formula: text, LaTeX, PDF, Python, C, Julia.

    Examples
    --------
    robostiff derive gough-stewart-b

    robostiff derive gough-stewart-a --rank --free-motions --eigenvalues

    robostiff derive 3-rpr --pose symbolic --steps -o stiffness.pdf

    robostiff derive hexapod --symbols R,r --pose "z=0.85, gamma=10 deg" -o hexapod.py

    robostiff derive gough-stewart-b-beams --leg leg1

    Exit status: 0 for a formula, 2 for bad input or a formula beyond the limit, 130 when
    interrupted.
    """
    from robostiff.cli.commands_derive import FormulaRequest, Questions, Sheet, print_formula

    asked = FormulaRequest(pose, symbols, steps, closed, limit, budget, derivative, leg)
    questions = Questions(rank, free_motions, eigenvalues)
    sheet = Sheet(format_, output, overwrite, as_json=json_)
    return print_formula(robot, asked, sheet, questions, set_ or [])


@app.command()
@reported
def cables(
    robot: RobotArgument,
    pose: PoseOption = None,
    wrench: cable_options.WrenchOption = None,
    balance: cable_options.BalanceOption = None,
    rule: cable_options.RuleOption = "nearest",
    level: cable_options.LevelOption = None,
    tensions: cable_options.TensionsOption = None,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Print tensions and stiffness of a cable robot, and which cables become slack under a load.

    Example: robostiff cables cable-8 --pose "0.5 0.2 1 0 0 0" --wrench "0 0 -200 N 0 0 0"

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands_cables import print_cables
    from robostiff.cli.written_arguments import PoseArguments

    place = PoseArguments(pose, None, None)
    return print_cables(robot, place, (wrench, balance), (rule, level, tensions), set_ or [], json_)


for _command in (view, schema, new, convert):
    app.command()(_command)


def main() -> None:
    """Run the command line."""
    ready_streams()
    app()


if __name__ == "__main__":
    main()
