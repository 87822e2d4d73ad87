"""Commands that print an answer."""

from __future__ import annotations

from dataclasses import dataclass

from robostiff.cli.options import (
    Answer,
    Command,
    Model,
    Posing,
    argument,
    gravity_option,
    group,
    length_option,
    option,
    plot_option,
    repeatable,
    wrench_option,
)


@dataclass(frozen=True)
class WrittenLoads:
    """Loads on bodies, as they are written."""

    wrench: str | None = wrench_option(
        "Force and moment on the platform about the point --at, which moves along"
    )
    weights: tuple[str, ...] = repeatable(
        "--weight", '"LEG/PART=MASS"', "A mass [kg] on the body behind a part, or on 'platform'"
    )
    forces: tuple[str, ...] = repeatable(
        "--load", '"LEG/PART=fx fy fz"', "A force [N] on the body behind a part, or on 'platform'"
    )
    gravity: str | None = gravity_option()
    preloads: tuple[str, ...] = repeatable(
        "--preload",
        '"LEG/PART=FORCE"',
        "With how much a drive pushes along its coordinate: [N] of a slide, [N m] of a turn",
    )


class ListRobots(Command, name="robots", run="commands_files:list_robots"):
    """List the shipped robots with their sources."""

    answer: Answer = group(Answer, "as_json")


class Check(Command, name="check", run="commands:check_robot"):
    """Check a model or snapshot file, and list the parts of the robot.

    $ check hexapod --parts --plot hexapod.png

    Exit status: 0 when it can be used, 2 when it cannot.
    """

    model: Model = group(Model)
    parts: bool = option(
        "--parts",
        help="List joints, elastic parts and cables at home: where they are, coordinates, "
        "lengths, stiffnesses of each direction alone in the part's own axes, limits.",
    )
    plot: str | None = plot_option("Draw the robot")
    answer: Answer = group(Answer)


class PrintStiffness(Command, name="stiffness", run="commands:print_stiffness"):
    """Print the Cartesian stiffness matrix of a robot at a pose, its rank and free motions.

    $ stiffness gough-stewart-b --pose "10 mm 0 0.8 0 0 10 deg"
    """

    model: Model = group(Model)
    place: Posing = group(Posing)
    method: str = option(
        "--method",
        metavar="NAME",
        default="wrench-basis",
        help="wrench-basis, saddle-point, block, recursive or index-rules.",
    )
    answer: Answer = group(Answer, "as_json")


class PrintDeflection(Command, name="deflection", run="commands:print_deflection"):
    """Print deflection, elastic energy of parts and actuator loads of a robot under a load.

    $ deflection gough-stewart-b-beams --wrench "200 N 0 -500 0 0 0"
    $ deflection six-joint-arm --gravity=-z --weight "platform=5 kg"
    """

    model: Model = group(Model)
    loads: WrittenLoads = group(WrittenLoads, "wrench", "weights", "forces", "gravity")
    place: Posing = group(Posing)
    answer: Answer = group(Answer, "as_json")


class PrintEquilibrium(Command, name="equilibrium", run="commands_loads:print_equilibrium"):
    """Print where a robot comes to rest under finite loads, its stiffness there, and its stability.

    $ equilibrium hexapod --wrench "0 0 -50 kN 0 0 0" --weight "leg1/strut=12 kg" --critical
    $ equilibrium six-joint-arm --gravity=-z --wrench "0 0 -150 N 0 0 0" --factors "0 4 9"
    """

    model: Model = group(Model)
    place: Posing = group(Posing)
    loads: WrittenLoads = group(WrittenLoads)
    critical: bool = option("--critical", help="Find the critical load, and how the robot leaves.")
    factors: str | None = option(
        "--factors",
        metavar='"START STOP COUNT"',
        help="Multiples of the wrench at which to give the force-deflection curve.",
    )
    plot: str | None = plot_option("Draw the loaded shape, or with --factors the curve,")
    answer: Answer = group(Answer)


class PrintModes(Command, name="modes", run="commands_loads:print_modes"):
    """Print natural frequencies and modes about the equilibrium, without load or under one.

    Masses are those of the model, and those of --mass.

    $ modes hexapod --mass "platform=150 kg"
    $ modes six-joint-arm --gravity=-z --plot first-mode.html
    """

    model: Model = group(Model)
    place: Posing = group(Posing)
    masses: tuple[str, ...] = repeatable(
        "--mass",
        '"LEG/PART=MASS"',
        "A mass [kg] that moves with the body behind a part, or with 'platform', and has no weight",
    )
    number: int = option(
        "--mode",
        metavar="NUMBER",
        type=int,
        default=1,
        help="Which mode to draw, 1 for the slowest.",
    )
    plot: str | None = plot_option("Draw a mode, which moves on a page (.html),")
    loads: WrittenLoads = group(WrittenLoads)
    answer: Answer = group(Answer)


class PrintResponse(Command, name="response", run="commands_loads:print_response"):
    """Print displacements, reactions and beam forces of a network under loads, all together.

    $ response portal.json --along "beam=0 0 -2 kN/m" --load "corner=100 N 0 0"

    Exit status: 0 for an answer, 1 for none, 2 for bad input.
    """

    source: str = argument("FILE", "A snapshot file with a graph: a network.")
    at_nodes: tuple[str, ...] = repeatable(
        "--load",
        '"NODE=fx fy fz [mx my mz]"',
        "Force [N], and moment [N m], at the point of a node",
    )
    along_beams: tuple[str, ...] = repeatable(
        "--along", '"BEAM=qx qy qz"', "Uniform force along a whole beam [N/m]"
    )
    on_beams: tuple[str, ...] = repeatable(
        "--on", '"BEAM=s fx fy fz"', "Force [N] on a beam at the distance s [m] from its start"
    )
    settlements: tuple[str, ...] = repeatable(
        "--settle", '"NODE=x y z rx ry rz"', "Displacement [m] and rotation [rad] of a fixed node"
    )
    answer: Answer = group(Answer, "as_json")


class PrintIndices(Command, name="indices", run="commands:print_indices"):
    """Print stiffness indices: principal stiffnesses, directions, centres and axes.

    $ indices hexapod --pose "60 mm 0 0.9 0 10 deg 0" --length "100 mm"
    """

    model: Model = group(Model)
    place: Posing = group(Posing)
    length: str | None = length_option()
    answer: Answer = group(Answer, "as_json")


class PrintVerification(Command, name="verify", run="commands:print_verification"):
    """Compute the stiffness matrix by all methods, and report whether they agree.

    $ verify gough-stewart-b --pose "10 mm 0 0.8 0 0 10 deg"

    Exit status: 0 when the methods agree, 1 when they do not, 2 for bad input.
    """

    model: Model = group(Model)
    place: Posing = group(Posing, "pose", "joints", "near")
    answer: Answer = group(Answer, "as_json")


class PrintCables(Command, name="cables", run="commands:print_cables"):
    """Print tensions and stiffness of a cable robot, and which cables become slack under a load.

    $ cables cable-8 --pose "0.5 0.2 1 0 0 0" --wrench "0 0 -200 N 0 0 0"
    """

    model: Model = group(Model, "source", "settings")
    place: Posing = group(Posing, "pose")
    wrench: str | None = wrench_option(
        "A load on top of the weight while the winches are locked: how the platform moves, and "
        "which cables become slack"
    )
    balance: str | None = wrench_option(
        "A wrench that the tensions balance at the pose itself", name="--balance"
    )
    rule: str = option(
        "--rule", metavar="NAME", default="nearest", help="Of the tensions: nearest or closed-form."
    )
    level: float | None = option(
        "--level",
        metavar="NUMBER",
        type=float,
        help="Where between least (0) and greatest (1) tensions they aim.",
    )
    tensions: str | None = option(
        "--tensions", metavar='"t1 t2 ..."', help="The tensions themselves [N], one a cable."
    )
    answer: Answer = group(Answer, "as_json")
