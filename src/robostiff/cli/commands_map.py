"""The command ``map``, after parsing."""

from __future__ import annotations

import json
import shlex
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
from robostiff.analysis.maps.pose_columns import FACTOR, SIX, Mapped, coordinate_units
from robostiff.analysis.maps.pose_source import PoseSource
from robostiff.analysis.maps.store import already_there
from robostiff.cli import arguments as written
from robostiff.cli.command import BAD_STATUS, INTERRUPTED
from robostiff.cli.output import draw, new_file, picture_beside, show
from robostiff.cli.pictures import MakeMap
from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError, needs_extra
from robostiff.io.map_files import (
    check_netcdf,
    map_csv_lines,
    read_poses,
    write_map_csv,
    write_map_netcdf,
)
from robostiff.io.units import Dimension, parse_quantities
from robostiff.markup import number, text_of
from robostiff.model import Robot

if TYPE_CHECKING:
    import xarray

    from robostiff.statics.loaded_map import UnderLoad


def read_asked_poses(robot: Mapped, asked: MakeMap) -> PoseSource:
    """Grid, list or random poses, as given on the command line."""
    if asked.poses is not None:
        if asked.axes or asked.joints or asked.random is not None or asked.factors:
            raise InputError(
                "--poses",
                got=asked.poses,
                expected="no --x, --joint, --factor or --random beside it",
            )
        return read_poses(robot, asked.poses)
    random = asked.random is not None
    words = ["start", "stop"] if random else ["start", "stop", "count"]
    found: dict[str, list[float]] = {}
    for text in asked.joints:
        name, dimension, rest = _joint(robot, text)
        if name in found:
            raise InputError("--joint", got=text, expected=f"one range for {name}")
        found[name] = _numbers(rest, dimension, words, f"--joint {name}")
    for name, text in asked.axes.items():
        if isinstance(robot, Robot) and (asked.joints or name in coordinate_units(robot)):
            expected = "--joint alone" if asked.joints else f"--joint, as a joint is called {name}"
            raise InputError(f"--{name}", got=text, expected=expected)
        if name in found:
            raise InputError(f"--{name}", got=text, expected=f"one range for {name}")
        dimension = Dimension.LENGTH if SIX.index(name) < 3 else Dimension.ANGLE
        found[name] = _numbers(text, dimension, words, f"--{name}")
    if asked.factors is not None:
        found[FACTOR] = _numbers(asked.factors, Dimension.NUMBER, words, "--factor")
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
    return Grid(
        {name: Axis(start, stop, _count(n, name)) for name, (start, stop, n) in found.items()}
    )


def _numbers(text: str, dimension: Dimension, words: Sequence[str], subject: str) -> list[float]:
    dimensions = [dimension, dimension, Dimension.NUMBER][: len(words)]
    return parse_quantities(text, dimensions, words, subject)


def _joint(robot: Mapped, text: str) -> tuple[str, Dimension, str]:
    """Name of a joint, what it measures, and the rest of the text."""
    joints = coordinate_units(robot)
    if not joints:
        raise InputError("--joint", got=text, expected="--x and the like: joints pose serial arms")
    # The longest name first: 'joint 1' before 'joint'.
    for name in sorted(joints, key=len, reverse=True):
        if text.strip().startswith(f"{name} "):
            dimension = Dimension.LENGTH if joints[name] == "m" else Dimension.ANGLE
            return name, dimension, text.strip().removeprefix(name)
    raise InputError(
        "--joint",
        got=text,
        expected=f"a joint ({', '.join(joints)}) and its range",
        hint=f'write --joint "{next(iter(joints))} -1 1 21"' if joints else None,
    )


def _count(value: float, name: str) -> int:
    if value != int(value):
        raise InputError(f"count of {name}", got=value, expected="a whole number")
    return int(value)


class MapBar(Progress):
    """A progress bar with rate and remaining time on standard error, if that is a terminal."""

    def __init__(self) -> None:
        self.rate: float = 0.0
        super().__init__(
            BarColumn(),
            TaskProgressColumn(),
            MofNCompleteColumn(),
            TextColumn("poses, {task.fields[rate]}"),
            TimeRemainingColumn(compact=True),
            console=Console(file=sys.stderr),
            disable=not sys.stderr.isatty(),
            transient=True,
        )
        self._map = self.add_task("map", total=None, rate="")

    def show(self, done: Done) -> None:
        """Show the progress."""
        self.rate = done.rate
        self.update(
            self._map, total=done.total, completed=done.done, rate=f"{done.rate:.3g} a second"
        )


_REDUCTIONS: dict[str, Callable[[list[str], list[float]], Reduction]] = {
    "extremes": lambda names, numbers: Extremes(*names),
    "quantiles": lambda names, numbers: Quantiles(
        *names, **({"shares": numbers} if numbers else {})
    ),
    "histogram": lambda names, numbers: Histogram(names[0], numbers),
    "above": lambda names, numbers: ShareAbove(names[0], numbers),
}


def _reduction(text: str) -> Reduction:
    """Such as ``above translational_stiffness 1e6``: a name, perhaps a variable, then numbers."""
    kind, *words = text.split() or [""]
    variable = words[:1] if words and not _is_number(words[0]) else []
    numbers = words[len(variable) :]
    needs_both = kind in ("histogram", "above")
    fits = kind in _REDUCTIONS and all(map(_is_number, numbers))
    if not fits or (needs_both and not (variable and numbers)):
        raise InputError(
            "--reduce",
            got=text,
            expected="extremes, quantiles 0.05 0.5, histogram VARIABLE EDGES or above VARIABLE "
            "LIMITS, in SI units",
            hint='write --reduce "above translational_stiffness 1e6"',
        )
    return _REDUCTIONS[kind](variable, [float(word) for word in numbers])


def _is_number(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False


_WRITERS = {".zarr": None, ".nc": write_map_netcdf, ".csv": write_map_csv}
_STORES = (".zarr", ".npz")  # what can be resumed
_QUANTITIES = {quantity.value: quantity for quantity in Quantity}


def _under_load(asked: MakeMap) -> UnderLoad | None:
    if asked.under_load:
        from robostiff.statics.loaded_map import UnderLoad

        return UnderLoad(gravity=written.gravity(asked.gravity))
    for option, text in (("--factor", asked.factors), ("--gravity", asked.gravity)):
        if text is not None:
            raise InputError(option, got=text, expected="--under-load beside it")
    return None


def make_map(asked: MakeMap) -> int:
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
    reductions = [_reduction(text) for text in asked.reductions]
    in_store = output is not None and output.suffix in _STORES
    method: Any = _under_load(asked)
    if asked.batched:
        method = Batched() if method is None else replace(method, by=Batched())
    scheduler = Threads(asked.threads) if asked.threads is not None else asked.scheduler
    started = time.monotonic()
    bar = MapBar()
    try:
        with bar:
            found = stiffness_map(
                robot,
                poses,
                [written.chosen("--quantity", name, _QUANTITIES) for name in asked.quantities]
                or [Quantity.PRINCIPAL_STIFFNESS],
                wrench=written.wrench(asked.wrench, robot.space),
                length=written.length(asked.length),
                near=written.near(robot, asked.place),
                method=method,
                store=output if in_store else None,
                resume=asked.resume,
                workers=asked.workers,
                scheduler=scheduler,
                progress=bar.show,
                reduce=reductions,
            )
        if output is None and not reductions:
            for line in map_csv_lines(found):
                click.echo(line)
        elif output is not None and (writer := _WRITERS.get(output.suffix)) is not None:
            writer(found, output)
        if picture is not None:
            from robostiff import plot

            draw(plot.map_overview(found, backend=plot.PictureData()), picture)
    except KeyboardInterrupt:
        click.echo(
            f"robostiff: interrupted; {_how_to_go_on(output, _suffixes(asked)[0])}", err=True
        )
        return INTERRUPTED
    except NoAnswerError as error:
        click.echo(f"robostiff: error: {error}", err=True)
        return BAD_STATUS
    facts = _facts(found, output, bar, time.monotonic() - started)
    if output is None and not reductions:
        return 0 if facts["poses_reachable"] else BAD_STATUS
    show(facts if asked.answer.as_json else _facts_text(facts))
    if bar.rate and not asked.answer.as_json:
        # Not on standard output, which is the same every time.
        click.echo(f"{facts['seconds']:.3g} s, {bar.rate:.3g} poses/s", err=True)
    return 0 if facts["poses_reachable"] else BAD_STATUS


def _checked_output(run: MakeMap) -> Path | None:
    """Where to write; None for standard output."""
    with needs_extra("maps", "maps"):
        import xarray  # noqa: F401
    output = Path(run.output)
    if run.threads is not None and (run.scheduler is not None or run.workers is not None):
        raise InputError("--threads, --workers and --scheduler", expected="one of them")
    if run.output == "-" and not run.resume:
        if run.answer.as_json and not run.reductions:
            expected = "a file: standard output has the map as CSV, or the summary"
            raise InputError("--output beside --json", got="-", expected=expected)
        return None
    suffixes = _suffixes(run)
    if output.suffix not in suffixes:
        raise InputError(
            "--output",
            got=run.output,
            expected=f"a name that ends in {', '.join(suffixes)}, or - for "
            f"{'standard output' if run.reductions else 'CSV on standard output'}",
            hint=f"write -o map{suffixes[0]}",
        )
    if output.suffix == ".nc":
        check_netcdf()
    if run.resume and output.suffix not in _STORES:
        raise InputError(
            "--resume",
            got=run.output,
            expected="an output that ends in .zarr: no other can be resumed",
        )
    if output.suffix in _STORES:
        if run.answer.overwrite:
            raise InputError(
                "--overwrite",
                got=run.output,
                expected=("a new name" if run.reductions else "FILE.nc or FILE.csv")
                + ": a store is never replaced",
                hint="remove it, or continue it with --resume",
            )
        if not output.absolute().parent.is_dir():
            raise InputError("--output", got=run.output, expected="a store in an existing folder")
        if output.exists() and not run.resume:
            raise already_there(output)
    else:
        new_file("--output", output, run.answer.overwrite)
    return output


def _suffixes(run: MakeMap) -> list[str]:
    """Endings of outputs, first the one that can be resumed."""
    return [".npz"] if run.reductions else [*_WRITERS]


def _how_to_go_on(output: Path | None, ending: str) -> str:
    if output is not None and output.suffix in _STORES and output.exists():
        arguments = [word for word in sys.argv[1:] if word != "--resume"]
        command = shlex.join(["robostiff", *arguments, "--resume"])
        return f"the finished blocks are stored in {output}; continue with\n  {command}"
    return f"nothing was written; with -o FILE{ending} a map can be resumed"


def _facts(
    found: xarray.Dataset, output: Path | None, bar: MapBar, seconds: float
) -> dict[str, Any]:
    facts: dict[str, Any] = {"output": str(output), "robot": found.attrs["robot"]}
    if "status" in found:
        facts["dimensions"] = {str(dim): int(found.sizes[dim]) for dim in found["status"].dims}
    for name in ("poses", "poses_computed", "poses_reachable", "poses_guarded"):
        facts[name] = int(found.attrs[name])
    facts["statuses"] = json.loads(found.attrs["statuses"])
    facts["ranges"] = {
        str(name): [*map(float, array.attrs["actual_range"]), array.attrs["units"]]
        for name, array in found.data_vars.items()
        if "actual_range" in array.attrs
    }
    if "status" not in found:
        facts["reductions"] = {
            str(name): {
                "units": own.attrs.get("units", "1"),
                "dimensions": list(map(str, own.dims)),
                "labels": [
                    found[d].values.tolist() if d in found.coords else None for d in own.dims
                ],
                "values": own.values.tolist(),
            }
            for name, own in found.data_vars.items()
        }
    elif output is None or output.suffix != ".zarr":  # a store may be larger than memory
        facts["extremes"] = {str(name): _extremes(found, str(name)) for name in facts["ranges"]}
    facts["seconds"] = seconds
    facts["poses_a_second"] = bar.rate
    return facts


def _extremes(found: xarray.Dataset, name: str) -> dict[str, Any]:
    """Poses of the least and the greatest value of a variable, and their statuses."""
    array, dims = found[name], found["status"].dims
    values, own = array.to_numpy(), {}
    for end, chosen_index in (("least", np.nanargmin), ("greatest", np.nanargmax)):
        index = np.unravel_index(chosen_index(values), values.shape)
        place = dict(zip(array.dims, index, strict=True))
        here = found.isel({dim: place[dim] for dim in dims})
        units = {str(n): c.attrs.get("units") for n, c in here.coords.items()}
        pose = {n: float(here[n]) for n, unit in units.items() if unit in {"m", "rad", "1"}}
        own[end] = {"pose": pose, "status": str(Status(int(here["status"])))}
        for dim in array.dims:
            if dim in found.coords and found[dim].dtype.kind == "U":  # such as an actuator
                own[end]["of"] = str(found[dim].values[place[dim]])
    return own


def _facts_text(facts: Mapping[str, Any]) -> str:
    shape = " x ".join(f"{name} {size}" for name, size in facts.get("dimensions", {}).items())
    computed = facts["poses_computed"]
    lines = [f"{facts['robot']}: {facts['poses']} poses"]
    lines[0] += f" ({shape}) in {facts['output']}" if shape else ""
    if computed < facts["poses"]:
        lines.append(f"computed: {computed}")
    share = facts["poses_reachable"] / computed if computed else 0.0
    lines.append(f"reachable: {facts['poses_reachable']} ({100 * share:.4g} %)")
    words = ", ".join(f"{name} {count}" for name, count in facts["statuses"].items())
    lines.append(f"status: {words}")
    for name, (low, high, unit) in facts["ranges"].items():
        shown = "" if unit == "1" else f" {unit}"
        lines.append(f"{name}: {low:.5g} to {high:.5g}{shown}")
        for end, own in facts.get("extremes", {}).get(name, {}).items():
            at = ", ".join(f"{n} {number(x)}" for n, x in own["pose"].items())
            of = f" of {own['of']}" if "of" in own else ""
            lines.append(f"  {end}{of} at {at} (m, rad): {own['status']}")
    for name, own in facts.get("reductions", {}).items():
        unit = "" if own["units"] == "1" else f" [{own['units']}]"
        lines.append(f"{name}{unit}")
        values = np.array(own["values"])
        first = own["labels"][0] or range(len(values))
        for label, row in zip(first, values.reshape(len(values), -1), strict=True):
            shown = " ".join(f"{x:.5g}" for x in row.tolist())
            lines.append(f"  {label if isinstance(label, str) else f'{label:.5g}'}: {shown}")
    if facts["poses_guarded"]:
        share = facts["poses_guarded"] / computed
        lines.append(f"recomputed by the batched form: {100 * share:.3g} %")
    return text_of(lines)
