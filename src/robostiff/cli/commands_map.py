"""The command ``map``, after parsing."""

from __future__ import annotations

import math
import shlex
import sys
import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)

from robostiff.analysis.maps import (
    Axis,
    Batched,
    Extremes,
    Grid,
    Histogram,
    Quantiles,
    Quantity,
    RandomPoses,
    Reduction,
    ShareAbove,
    Threads,
    stiffness_map,
)
from robostiff.analysis.maps import Progress as Done
from robostiff.analysis.maps.pose_columns import FACTOR, POSE_UNITS, Mapped, coordinate_units
from robostiff.analysis.maps.pose_source import PoseSource
from robostiff.cli import arguments as written
from robostiff.cli.command import BAD_STATUS, INTERRUPTED, answered
from robostiff.cli.output import draw, new_file, picture_beside
from robostiff.errors import InputError, NoAnswerError, needs_extra
from robostiff.io.map_files import check_netcdf, read_poses, write_map_netcdf
from robostiff.io.units import Dimension, parse_quantities
from robostiff.model import Robot
from robostiff.page.of_result import page_of


def read_asked_poses(robot: Mapped, asked: Any) -> PoseSource:
    """Grid, list or random poses, as given on the command line."""
    if asked.poses is not None:
        if asked.axes or asked.joints or asked.random is not None or asked.factors:
            expected = "no --x, --joint, --factor or --random beside it"
            raise InputError("--poses", got=asked.poses, expected=expected)
        return read_poses(robot, asked.poses)
    words = ["start", "stop", "count"][: 3 if asked.random is None else 2]
    joints = coordinate_units(robot)
    found: dict[str, list[float]] = {}

    def add(name: str, dimension: Dimension, text: str, option: str) -> None:
        if name in found:
            raise InputError(option, got=text, expected=f"one range for {name}")
        dimensions = [dimension, dimension, Dimension.NUMBER][: len(words)]
        found[name] = parse_quantities(text, dimensions, words, option)

    for text in asked.joints:
        if not joints:
            expected = "--x and the like: joints pose serial arms"
            raise InputError("--joint", got=text, expected=expected)
        longest_first = sorted(joints, key=len, reverse=True)  # 'joint 1' before 'joint'
        name = next((own for own in longest_first if text.strip().startswith(f"{own} ")), None)
        if name is None:
            raise InputError(
                "--joint",
                got=text,
                expected=f"a joint ({', '.join(joints)}) and its range",
                hint=f'write --joint "{next(iter(joints))} -1 1 21"',
            )
        add(name, Dimension.of(joints[name]), text.strip().removeprefix(name), f"--joint {name}")
    for name, text in asked.axes.items():
        if isinstance(robot, Robot) and (asked.joints or name in joints):
            expected = "--joint alone" if asked.joints else f"--joint, as a joint is called {name}"
            raise InputError(f"--{name}", got=text, expected=expected)
        add(name, Dimension.of(POSE_UNITS[name]), text, f"--{name}")
    if asked.factors is not None:
        add(FACTOR, Dimension.NUMBER, asked.factors, "--factor")
    if not found:
        raise InputError(
            "poses of a map",
            got="none",
            expected="at least one coordinate, or --poses FILE.csv",
            hint='write --x "-100 mm 100 mm 21"',
        )
    if asked.random is not None:
        ranges = {name: (low, high) for name, (low, high) in found.items()}
        return RandomPoses(asked.random, ranges, asked.seed)
    axes = {}
    for name, (start, stop, count) in found.items():
        if count != int(count):
            raise InputError(f"count of {name}", got=count, expected="a whole number")
        axes[name] = Axis(start, stop, int(count))
    return Grid(axes)


class MapBar(Progress):
    """A progress bar with rate and remaining time on standard error, if that is a terminal."""

    rate: float = 0.0

    def __init__(self) -> None:
        super().__init__(
            *(BarColumn(), TaskProgressColumn(), MofNCompleteColumn()),
            *(TextColumn("poses, {task.fields[rate]}"), TimeRemainingColumn(compact=True)),
            console=Console(file=sys.stderr),
            disable=not sys.stderr.isatty(),
            transient=True,
        )
        self._map = self.add_task("map", total=None, rate="")

    def show(self, done: Done) -> None:
        """Show the progress."""
        self.rate, rate = done.rate, f"{done.rate:.3g} a second"
        self.update(self._map, total=done.total, completed=done.done, rate=rate)


def _reduction(text: str) -> Reduction:
    """Such as ``above translational_stiffness 1e6``: a name, perhaps a variable, then numbers."""
    kind, *words = text.split() or [""]
    variable = words[:1] if words and not _is_number(words[0]) else []
    numbers = words[len(variable) :]
    if all(map(_is_number, numbers)):
        values = [float(word) for word in numbers]
        if kind == "extremes" and not values:
            return Extremes(*variable)
        if kind == "quantiles":
            return Quantiles(*variable, **({"shares": values} if values else {}))
        if kind in _OF_ONE and variable and values:
            return _OF_ONE[kind](variable[0], values)
    raise InputError(
        "--reduce",
        got=text,
        expected="extremes, quantiles 0.05 0.5, histogram VARIABLE EDGES or above VARIABLE "
        "LIMITS, in SI units",
        hint='write --reduce "above translational_stiffness 1e6"',
    )


_OF_ONE = {"histogram": Histogram, "above": ShareAbove}


def _is_number(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False


_STORES = (".zarr", ".npz")  # what can be resumed
_QUANTITIES = {quantity.value: quantity for quantity in Quantity}
_IN_MEMORY = 100_000  # poses of a NetCDF file; more are computed into a store beside it


def make_map(asked: Any) -> int:
    """Compute a map, write it, and print a summary."""
    output = _checked_output(asked)
    picture = picture_beside(asked.plot, asked.answer, is_scene=False)
    if picture is not None and asked.reductions:
        raise InputError(
            "--plot", got=asked.plot, expected="none beside --reduce, which keeps no map"
        )
    robot = written.loaded(asked.model, by_joints=bool(asked.joints))
    if not isinstance(robot, Mapped):
        hint = "a snapshot is frozen at its own pose"
        expected = "a model or a linkage, which has a pose for every point of a map"
        raise InputError("robot of a map", got=asked.model.source, expected=expected, hint=hint)
    poses = read_asked_poses(robot, asked)
    method: Any = None
    if asked.under_load:
        from robostiff.statics.loaded_map import UnderLoad

        method = UnderLoad(gravity=written.gravity(asked.gravity))
    if asked.batched:
        method = Batched() if method is None else replace(method, by=Batched())
    started, bar = time.monotonic(), MapBar()
    try:
        with bar, ExitStack() as during:
            store = output if output is not None and output.suffix in _STORES else None
            if store is None and output is not None and math.prod(poses.shape) > _IN_MEMORY:
                beside = TemporaryDirectory(prefix=".robostiff-map-", dir=output.absolute().parent)
                store = Path(during.enter_context(beside)) / "map.zarr"
            found = stiffness_map(
                robot,
                poses,
                [written.chosen("--quantity", name, _QUANTITIES) for name in asked.quantities]
                or [Quantity.PRINCIPAL_STIFFNESS],
                wrench=written.wrench(asked.wrench, robot.space),
                length=written.length(asked.length),
                near=written.near(robot, asked.place),
                method=method,
                store=store,
                resume=asked.resume,
                workers=asked.workers,
                scheduler=asked.scheduler if asked.threads is None else Threads(asked.threads),
                progress=bar.show,
                reduce=[_reduction(text) for text in asked.reductions],
                dtype=asked.dtype,
            )
            if output is not None and output.suffix == ".nc":
                write_map_netcdf(found, output)
            if picture is not None:
                from robostiff import plot

                draw(plot.map_overview(found, backend=plot.PictureData()), picture)
            page = page_of(found)
    except KeyboardInterrupt:
        words = f"nothing was written; with -o FILE{_endings(asked)[0]} a map can be resumed"
        if output is not None and output.suffix in _STORES and output.exists():
            arguments = [word for word in sys.argv[1:] if word != "--resume"]
            command = shlex.join(["robostiff", *arguments, "--resume"])
            words = f"the finished blocks are stored in {output}; continue with\n  {command}"
        click.echo(f"robostiff: interrupted; {words}", err=True)
        return INTERRUPTED
    except NoAnswerError as error:
        click.echo(f"robostiff: error: {error}", err=True)
        return BAD_STATUS
    seconds = time.monotonic() - started
    facts = {"seconds": seconds, "poses_a_second": bar.rate}
    place = page.place if output is None else f"{page.place} in {output}"
    data = {"output": asked.output, **page.data, **facts}
    answered(replace(page, place=place, data=data), asked.answer)
    if bar.rate and output is not None and not asked.answer.as_json:
        # Not on standard output, which is the same every time.
        click.echo(f"{seconds:.3g} s, {bar.rate:.3g} poses/s", err=True)
    return 0 if found.attrs["poses_reachable"] else BAD_STATUS


def _checked_output(run: Any) -> Path | None:
    """Where to write; None where only the summary is printed."""
    with needs_extra("maps", "maps"):
        import xarray  # noqa: F401
    for option, text in (("--factor", run.factors), ("--gravity", run.gravity)):
        if text is not None and not run.under_load:
            raise InputError(option, got=text, expected="--under-load beside it")
    output, endings = Path(run.output), _endings(run)
    if run.threads is not None and (run.scheduler is not None or run.workers is not None):
        raise InputError("--threads, --workers and --scheduler", expected="one of them")
    if run.output == "-" and not run.resume:
        return None
    if output.suffix not in endings:
        raise InputError(
            "--output",
            got=run.output,
            expected=f"a name that ends in {' or '.join(endings)}, or - for the summary alone",
            hint=f"write -o map{endings[0]}",
        )
    if output.suffix == ".nc":
        check_netcdf()
        if run.resume:
            expected = "an output that ends in .zarr: no other can be resumed"
            raise InputError("--resume", got=run.output, expected=expected)
        return new_file("--output", output, run.answer.overwrite)
    if run.answer.overwrite:
        raise InputError(
            "--overwrite",
            got=run.output,
            expected=f"{'a new name' if run.reductions else 'FILE.nc'}: a store is never replaced",
            hint="remove it, or continue it with --resume",
        )
    return output


def _endings(run: Any) -> tuple[str, ...]:
    """Of outputs, first that of one that can be resumed."""
    return (".npz",) if run.reductions else (".zarr", ".nc")
