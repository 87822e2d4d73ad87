"""What the command ``map`` is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from robostiff.cli.options import (
    Answer,
    Model,
    Posing,
    gravity_option,
    length_option,
    option,
    output_option,
    plot_option,
    repeatable,
    wrench_option,
)


def _axis(name: str, unit: str) -> Any:
    return option(f"--{name}", metavar='"START STOP COUNT"', help=f"Values of {name} [{unit}].")


@dataclass(frozen=True, kw_only=True)
class MapOptions:
    """Options of the command ``map``, which is imported when it runs."""

    model: Model
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
    place: Posing
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
    answer: Answer

    @property
    def axes(self) -> dict[str, str]:
        """Ranges of coordinates of the platform, by their names."""
        names = ("x", "y", "z", "rx", "ry", "rz")
        return {name: text for name in names if (text := getattr(self, name)) is not None}
