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
from robostiff.cli.command import BAD_STATUS, INTERRUPTED, print_answer
from robostiff.cli.output import draw, new_file, picture_beside
from robostiff.errors import InputError, NoAnswerError, Words, needs_extra
from robostiff.io.map_files import check_netcdf, read_poses, write_map_netcdf
from robostiff.io.units import Dimension, parse_quantities
from robostiff.model import Robot
from robostiff.page.of_result import page_of


def poses_of(robot: Mapped, command: Any) -> PoseSource:
    """Grid, list or random poses, as given on the command line."""
    if command.poses is not None:
        if command.axes or command.joints or command.random is not None or command.factors:
            expected = "no --x, --joint, --factor or --random beside it"
            raise InputError("--poses", got=command.poses, expected=expected)
        return read_poses(robot, command.poses)
    words = ["start", "stop", "count"][: 3 if command.random is None else 2]
    joints = coordinate_units(robot)
    rows: dict[str, list[float]] = {}

    def add(name: str, dimension: Dimension, text: str, option: str) -> None:
        if name in rows:
            raise InputError(option, got=text, expected=f"one range for {name}")
        dimensions = [dimension, dimension, Dimension.NUMBER][: len(words)]
        rows[name] = parse_quantities(text, dimensions, words, option, are_ends=True)

    for text in command.joints:
        if not joints:
            expected = "--x and the like: joints pose serial arms"
            raise InputError("--joint", got=text, expected=expected)
        longest_first = sorted(joints, key=len, reverse=True)  # 'joint 1' before 'joint'
        name = next((word for word in longest_first if text.strip().startswith(f"{word} ")), None)
        if name is None:
            expected = f"a joint ({', '.join(joints)}) and its range"
            hint = f'write --joint "{next(iter(joints))} -1 1 21"'
            raise InputError("--joint", got=text, expected=expected, hint=hint)
        add(name, Dimension.of(joints[name]), text.strip().removeprefix(name), f"--joint {name}")
    for name, text in command.axes.items():
        if isinstance(robot, Robot) and (command.joints or name in joints):
            clash = f"--joint, as a joint is called {name}"
            expected = "--joint alone" if command.joints else clash
            raise InputError(f"--{name}", got=text, expected=expected)
        add(name, Dimension.of(POSE_UNITS[name]), text, f"--{name}")
    if command.factors is not None:
        add(FACTOR, Dimension.NUMBER, command.factors, "--factor")
    if not rows:
        expected = "at least one coordinate, or --poses FILE.csv"
        hint = 'write --x "-100 mm 100 mm 21"'
        raise InputError("poses of a map", got=Words("none"), expected=expected, hint=hint)
    if command.random is not None:
        ranges = {name: (low, high) for name, (low, high) in rows.items()}
        return RandomPoses(command.random, ranges, command.seed)
    axes = {}
    for name, (start, stop, count) in rows.items():
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


def make_map(command: Any) -> int:
    """Compute a map, write it, and print a summary."""
    output = _checked_output(command)
    picture = picture_beside(command.plot, command.answer, is_scene=False)
    if picture is not None and command.reductions:
        raise InputError(
            "--plot", got=command.plot, expected="none beside --reduce, which keeps no map"
        )
    robot = written.load_machine(command.model, by_joints=bool(command.joints))
    if not isinstance(robot, Mapped):
        hint = "a snapshot is frozen at its own pose"
        expected = "a model or a linkage, which has a pose for every point of a map"
        raise InputError("robot of a map", got=command.model.source, expected=expected, hint=hint)
    poses = poses_of(robot, command)
    method: Any = None
    if command.under_load:
        from robostiff.statics.loaded_map import UnderLoad

        method = UnderLoad(gravity=written.gravity(command.gravity))
    if command.batched:
        method = Batched() if method is None else replace(method, by=Batched())
    started, bar, threads = time.monotonic(), MapBar(), command.threads
    try:
        with bar, ExitStack() as during:
            store = output if output is not None and output.suffix in _STORES else None
            if store is None and output is not None and math.prod(poses.shape) > _IN_MEMORY:
                beside = TemporaryDirectory(prefix=".robostiff-map-", dir=output.absolute().parent)
                store = Path(during.enter_context(beside)) / "map.zarr"
            result = stiffness_map(
                robot,
                poses,
                [written.choice("--quantity", name, _QUANTITIES) for name in command.quantities]
                or [Quantity.PRINCIPAL_STIFFNESS],
                wrench=written.wrench(command.wrench, robot.space),
                length=written.length(command.length),
                near=written.near(robot, command.place),
                method=method,
                store=store,
                resume=command.resume,
                workers=command.workers,
                scheduler=command.scheduler if threads is None else Threads(threads),
                progress=bar.show,
                reduce=[_reduction(text) for text in command.reductions],
                dtype=command.dtype,
            )
            if output is not None and output.suffix == ".nc":
                write_map_netcdf(result, output)
            if picture is not None:
                from robostiff import plot

                draw(plot.map_overview(result, backend=plot.PictureData()), picture)
            page = page_of(result)
    except KeyboardInterrupt:
        words = f"nothing was written; with -o FILE{_endings(command)[0]} a map can be resumed"
        if output is not None and output.suffix in _STORES and output.exists():
            arguments = [word for word in sys.argv[1:] if word != "--resume"]
            resumed = shlex.join(["robostiff", *arguments, "--resume"])
            words = f"the finished blocks are stored in {output}; continue with\n  {resumed}"
        click.echo(f"robostiff: interrupted; {words}", err=True)
        return INTERRUPTED
    except NoAnswerError as error:
        click.echo(f"robostiff: error: {error}", err=True)
        return BAD_STATUS
    seconds = time.monotonic() - started
    facts = {"seconds": seconds, "poses_a_second": bar.rate}
    place = page.place if output is None else f"{page.place} in {output}"
    data = {"output": command.output, **page.data, **facts}
    print_answer(replace(page, place=place, data=data), command.answer)
    if bar.rate and output is not None and not command.answer.as_json:
        # Not on standard output, which is the same every time.
        click.echo(f"{seconds:.3g} s in all; {bar.rate:.3g} poses/s once prepared", err=True)
    return 0 if result.attrs["poses_reachable"] else BAD_STATUS


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
        expected = f"a name that ends in {' or '.join(endings)}, or - for the summary alone"
        hint = f"write -o map{endings[0]}"
        raise InputError("--output", got=run.output, expected=expected, hint=hint)
    if output.suffix == ".nc":
        check_netcdf()
        if run.resume:
            expected = "an output that ends in .zarr: no other can be resumed"
            raise InputError("--resume", got=run.output, expected=expected)
        return new_file("--output", output, run.answer.overwrite)
    if run.answer.overwrite:
        expected = f"{'a new name' if run.reductions else 'FILE.nc'}: a store is never replaced"
        hint = "remove it, or continue it with --resume"
        raise InputError("--overwrite", got=run.output, expected=expected, hint=hint)
    return output


def _endings(run: Any) -> tuple[str, ...]:
    """Of outputs, first that of one that can be resumed."""
    return (".npz",) if run.reductions else (".zarr", ".nc")
