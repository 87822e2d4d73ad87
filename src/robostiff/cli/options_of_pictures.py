"""Commands that write maps, pictures and pages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from robostiff.cli.options import (
    Answer,
    Command,
    Model,
    Posing,
    gravity_option,
    group,
    length_option,
    option,
    output_option,
    plot_option,
    repeatable,
    robot_argument,
    wrench_option,
)

WHAT = ("robot", "deflection", "energy", "ellipsoids", "free-motions", "matrix", "modes", "map")
"""What can be drawn."""


@dataclass(frozen=True)
class ViewedModel(Model):
    """What is drawn: a robot, or a map."""

    source: str = robot_argument("ROBOT|MAP", ", a map (FILE.zarr or FILE.nc)")


class Plot(Command, name="plot", run="commands_pictures:make_plot"):
    """Draw a robot, a snapshot, a network, a linkage, a cable robot, or a map.

    $ plot hexapod --wrench "500 N 0 0 0 0 0" -o hexapod.png
    $ plot cable-8 --what ellipsoids -o cables.html
    $ plot map.nc --quantity status --cut z=0.3 -o map.pdf

    Exit status: 0 for a picture, 1 where there is nothing to draw, 2 for bad input.
    """

    model: ViewedModel = group(ViewedModel)
    output: str = output_option("FILE.png, .svg or .pdf, or of a robot .html to be turned.")
    what: str | None = option(
        "--what",
        metavar="|".join(WHAT),
        help="What is drawn: the robot with its parts and joints named, when left out; under "
        "--wrench its deflection.",
    )
    wrench: str | None = wrench_option("A load on the platform, for deflection and energy")
    quality: str = option(
        "--quality",
        metavar="NAME",
        default="compliance",
        help="Of ellipsoids: compliance, stiffness, rotational-compliance or rotational-stiffness.",
    )
    mode: int = option(
        "--mode", metavar="NUMBER", type=int, default=1, help="Of modes: which, 1 for the slowest."
    )
    quantity: str | None = option(
        "--quantity",
        metavar="NAME",
        help="Of a map: worst_deflection, rank, status or any other variable of it.",
    )
    cuts: tuple[str, ...] = repeatable(
        "--cut",
        "NAME=VALUE",
        "Of a map: where a coordinate is cut, or which component is shown, such as z=0.3 or "
        "displacement_axis=dz",
    )
    place: Posing = group(Posing)
    answer: Answer = group(Answer)


def _line(name: str, more: str = "") -> Any:
    words = f"Line of the title block{more}."
    return option(name, metavar="TEXT", default="", show_default=False, help=words)


class Report(Command, name="report", run="commands_pictures:make_report"):
    """Write all results about a robot as one self-contained HTML page, or as a PDF.

    $ report hexapod --wrench "500 N 0 0 0 0 0" -o hexapod.html
    """

    model: Model = group(Model)
    output: str = output_option("What to write: FILE.html, or FILE.pdf.")
    wrench: str | None = wrench_option(
        "A load on the platform: adds the deflection and the elastic energy of parts"
    )
    map_file: str | None = option(
        "--map",
        metavar="FILE",
        help="A map of the robot, .zarr or .nc: adds slices of the workspace.",
    )
    finite: bool = option(
        "--finite-load",
        help="With --wrench: where the robot comes to rest under it, its stiffness there, the "
        "critical load, and the force-deflection curve.",
    )
    pdf: bool = option("--pdf", help="Write FILE.pdf besides FILE.html.")
    compare: str | None = option(
        "--compare",
        metavar="ROBOT",
        help="Another design beside it, at the same pose and under the same load.",
    )
    project: str = _line("--project")
    author: str = _line("--author")
    date: str = _line("--date", ", such as 2026-11-22, or 'today'")
    revision: str = _line("--revision")
    place: Posing = group(Posing)
    answer: Answer = group(Answer)


def _axis(name: str, unit: str) -> Any:
    return option(f"--{name}", metavar='"START STOP COUNT"', help=f"Values of {name} [{unit}].")


class MakeMap(Command, name="map", run="commands_map:make_map"):
    """Compute stiffness at many poses: over a grid, along a trajectory, or at random.

    Coordinates left out stay at home.

    $ map hexapod --x "-100 mm 100 mm 41" --rz "0 20 deg 5" -o map.nc
    $ map hexapod --poses path.csv --quantity deflection --wrench "0 0 -500 N 0 0 0"
      -o deflections.nc
    $ map hexapod --x "-0.1 0.1 5" --wrench "0 0 -1 MN 0 0 0" --under-load --factor "0 5 6"
      -o loaded.nc
    $ map hexapod --random 1000000 --x "-0.1 0.1" --y "-0.1 0.1" -o map.zarr --resume
    $ map hexapod --random 100000000 --x "-0.1 0.1" --y "-0.1 0.1" --reduce extremes
      --reduce "quantiles 0.01 0.5" -o map.npz

    Exit status: 0 for a map, 1 when no pose can be reached, 2 for bad input, 130 when interrupted.
    """

    model: Model = group(Model)
    x: str | None = _axis("x", "m")
    y: str | None = _axis("y", "m")
    z: str | None = _axis("z", "m")
    rx: str | None = _axis("rx", "rad")
    ry: str | None = _axis("ry", "rad")
    rz: str | None = _axis("rz", "rad")
    joints: tuple[str, ...] = repeatable(
        "--joint",
        '"NAME START STOP COUNT"',
        "Values of a joint of a serial arm or a linkage [m or rad]",
    )
    poses: str | None = option(
        "--poses",
        metavar="FILE.csv",
        help="Poses from a file in place of a grid: a line of names, such as 'time, x [mm], rz "
        "[deg]', then a line a pose.",
    )
    random: int | None = option(
        "--random",
        metavar="COUNT",
        type=int,
        help="Random poses in place of a grid; --x and the like then hold START and STOP.",
    )
    seed: int = option(
        "--seed", metavar="NUMBER", type=int, default=0, help="Seed of random poses."
    )
    quantities: tuple[str, ...] = repeatable(
        "--quantity",
        "NAME",
        "stiffness, principal-stiffness (when left out), worst-deflection, indices, deflection, "
        "actuator-forces, or tensions of cables; always with rank and status",
    )
    reductions: tuple[str, ...] = repeatable(
        "--reduce",
        '"NAME ..."',
        "Keep no map, but extremes, quantiles 0.05 0.5, histogram VARIABLE EDGES or above VARIABLE "
        "LIMITS (SI units), in little memory",
    )
    dtype: str = option(
        "--dtype", metavar="float64|float32", default="float64", help="Of the stiffness matrix."
    )
    wrench: str | None = wrench_option(
        "Load about the reference point, for deflection and actuator-forces, and for --under-load"
    )
    under_load: bool = option(
        "--under-load",
        help="Find the equilibrium under the wrench at every pose, and all quantities there: "
        "statuses say where the robot is unstable or beyond its critical load.",
    )
    factors: str | None = option(
        "--factor",
        metavar='"START STOP COUNT"',
        help="Multiples of the wrench, as one more axis of a map --under-load.",
    )
    gravity: str | None = gravity_option()
    length: str | None = length_option()
    place: Posing = group(Posing, "near")
    output: str = output_option(
        "FILE.zarr (of any size, can be resumed), FILE.nc (NetCDF), or - for the summary alone; "
        "with --reduce FILE.npz (can be resumed), or -."
    )
    resume: bool = option("--resume", help="Continue an interrupted map in FILE.zarr or FILE.npz.")
    plot: str | None = plot_option(
        "Draw the first quantity over the first two coordinates ('robostiff plot FILE.nc' draws "
        "others)",
        ".png, .svg or .pdf",
    )
    workers: int | None = option(
        "--workers", metavar="COUNT", type=int, help="Processes of this machine to start."
    )
    threads: int | None = option(
        "--threads", metavar="COUNT", type=int, help="Threads; as many as processors when left out."
    )
    scheduler: str | None = option(
        "--scheduler",
        metavar="ADDRESS",
        help="A Dask scheduler, such as tcp://host:8786; its workers must see FILE.zarr.",
    )
    batched: bool = option(
        "--batched",
        help="Compute every pose as 'stiffness' does, without a kernel; large maps have one "
        "otherwise.",
    )
    answer: Answer = group(Answer)

    @property
    def axes(self) -> dict[str, str]:
        """Ranges of coordinates of the platform, by their names."""
        names = ("x", "y", "z", "rx", "ry", "rz")
        return {name: text for name in names if (text := getattr(self, name)) is not None}
