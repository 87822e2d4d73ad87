"""Commands that print an answer: their options, words and examples."""

from __future__ import annotations

from dataclasses import dataclass

from robostiff.cli.command import Command
from robostiff.cli.options import (
    PRINTED,
    Answer,
    Length,
    Model,
    Part,
    Posing,
    argument,
    gravity_option,
    option,
    plot_option,
    repeatable,
    wrench_option,
)


@dataclass(frozen=True)
class CheckDetails:
    """What ``check`` gives beside the facts: parts at home, and a picture."""

    parts: bool = option(
        "--parts",
        help="List joints, elastic parts and cables at home: where they are, coordinates, "
        "lengths, stiffnesses of each direction alone in the part's own axes, limits.",
    )
    plot: str | None = plot_option("Draw the robot")


@dataclass(frozen=True)
class Method:
    """The form of K."""

    method: str = option(
        "--method",
        metavar="NAME",
        default="wrench-basis",
        help="wrench-basis, saddle-point, block, recursive or index-rules.",
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


@dataclass(frozen=True)
class Wanted:
    """What is printed beside the equilibrium, and a picture."""

    critical: bool = option("--critical", help="Find the critical load, and how the robot leaves.")
    factors: str | None = option(
        "--factors",
        metavar='"START STOP COUNT"',
        help="Multiples of the wrench at which to give the force-deflection curve.",
    )
    plot: str | None = plot_option("Draw the loaded shape, or with --factors the curve,")


@dataclass(frozen=True)
class Vibration:
    """Masses that move, and the mode that is drawn."""

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


@dataclass(frozen=True)
class WrittenNetworkLoads:
    """A network and its loads, as they are written."""

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


@dataclass(frozen=True)
class WrittenTensions:
    """Load of a cable robot, and its tensions."""

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


_STATUS = "0 for an answer, 1 for an answer with a bad status, 2 for bad input."

COMMANDS = {
    "robots": Command(
        "commands_files:list_robots", (PRINTED,), "List the shipped robots with their sources."
    ),
    "check": Command(
        "commands:check_robot",
        (Model, CheckDetails, Answer),
        "Check a model or snapshot file, and list the parts of the robot.",
        examples=("check hexapod --parts --plot hexapod.png",),
        status="0 when it can be used, 2 when it cannot.",
    ),
    "stiffness": Command(
        "commands:print_stiffness",
        (Model, Posing, Method, PRINTED),
        "Print the Cartesian stiffness matrix of a robot at a pose, its rank and free motions.",
        examples=('stiffness gough-stewart-b --pose "10 mm 0 0.8 0 0 10 deg"',),
        status=_STATUS,
    ),
    "deflection": Command(
        "commands:print_deflection",
        (Model, Part(WrittenLoads, "wrench", "weights", "forces", "gravity"), Posing, PRINTED),
        "Print deflection, elastic energy of parts and actuator loads of a robot under a load.",
        examples=(
            'deflection gough-stewart-b-beams --wrench "200 N 0 -500 0 0 0"',
            'deflection six-joint-arm --gravity=-z --weight "platform=5 kg"',
        ),
        status=_STATUS,
    ),
    "equilibrium": Command(
        "commands_loads:print_equilibrium",
        (Model, Posing, WrittenLoads, Wanted, Answer),
        "Print where a robot comes to rest under finite loads, its stiffness there, and its "
        "stability.",
        examples=(
            'equilibrium hexapod --wrench "0 0 -50 kN 0 0 0" --weight "leg1/strut=12 kg" '
            "--critical",
            'equilibrium six-joint-arm --gravity=-z --wrench "0 0 -150 N 0 0 0" --factors "0 4 9"',
        ),
        status=_STATUS,
    ),
    "modes": Command(
        "commands_loads:print_modes",
        (Model, Posing, Vibration, WrittenLoads, Answer),
        "Print natural frequencies and modes about the equilibrium, without load or under one.",
        "Masses are those of the model, and those of --mass.",
        examples=(
            'modes hexapod --mass "platform=150 kg"',
            "modes six-joint-arm --gravity=-z --plot first-mode.html",
        ),
        status=_STATUS,
    ),
    "response": Command(
        "commands_loads:print_response",
        (WrittenNetworkLoads, PRINTED),
        "Print displacements, reactions and beam forces of a network under loads, all together.",
        examples=('response portal.json --along "beam=0 0 -2 kN/m" --load "corner=100 N 0 0"',),
        status="0 for an answer, 1 for none, 2 for bad input.",
    ),
    "indices": Command(
        "commands:print_indices",
        (Model, Posing, Length, PRINTED),
        "Print stiffness indices: principal stiffnesses, directions, centres and axes.",
        examples=('indices hexapod --pose "60 mm 0 0.9 0 10 deg 0" --length "100 mm"',),
        status=_STATUS,
    ),
    "verify": Command(
        "commands:print_verification",
        (Model, Part(Posing, "pose", "joints", "near"), PRINTED),
        "Compute the stiffness matrix by all methods, and report whether they agree.",
        examples=('verify gough-stewart-b --pose "10 mm 0 0.8 0 0 10 deg"',),
        status="0 when the methods agree, 1 when they do not, 2 for bad input.",
    ),
    "cables": Command(
        "commands:print_cables",
        (Part(Model, "source", "settings"), Part(Posing, "pose"), WrittenTensions, PRINTED),
        "Print tensions and stiffness of a cable robot, and which cables become slack under a "
        "load.",
        examples=('cables cable-8 --pose "0.5 0.2 1 0 0 0" --wrench "0 0 -200 N 0 0 0"',),
        status=_STATUS,
    ),
}
