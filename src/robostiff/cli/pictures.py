"""Commands that write maps, pictures and pages."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robostiff.cli.command import BAD_STATUS
from robostiff.cli.options import (
    Answer,
    Command,
    Model,
    Posing,
    gravity_option,
    group,
    length_option,
    named_once,
    option,
    output_option,
    plot_option,
    repeatable,
    robot_argument,
    wrench_option,
)
from robostiff.cli.output import draw, new_file, picture_beside, show, show_files
from robostiff.errors import InputError
from robostiff.frozen import frozen

if TYPE_CHECKING:
    from robostiff.plot.picture import Picture

_WHAT = ("robot", "deflection", "energy", "ellipsoids", "free-motions", "matrix", "modes", "map")
_MAPS = (".zarr", ".nc")
_OF_LOADS = ("deflection", "energy")


@frozen
class ViewedModel(Model):
    """What is drawn: a robot, or a map."""

    source: str = robot_argument("ROBOT|MAP", ", a map (FILE.zarr or FILE.nc)")


class Plot(Command, name="plot"):
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
        metavar="|".join(_WHAT),
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

    def run(self) -> int:
        """Draw into a file and print its path; 0."""
        what = self._what()
        is_scene = what not in {"energy", "matrix", "map"}
        path: Any = picture_beside(self.output, self.answer, is_scene=is_scene, option="--output")
        if what == "map":
            from robostiff import plot
            from robostiff.io.map_files import read_map

            at: dict[str, Any] = {}
            for name, value in named_once("--cut", self.cuts, "NAME=VALUE, such as z=0.3").items():
                at[name] = value
                with suppress(ValueError):
                    at[name] = float(value)
            quantity = None if self.quantity is None else self.quantity.replace("-", "_")
            dataset, data = read_map(self.model.source), plot.PictureData()
            draw(plot.map_overview(dataset, quantity, at=at, backend=data), path)
        else:
            first, *other = self._of_robot(what)
            draw(first, path, *other)
        show({"file": str(path), "what": what} if self.answer.as_json else str(path))
        return 0

    def _what(self) -> str:
        """What is drawn: as written, or what the subject and the load suggest."""
        from robostiff.cli.arguments import choice

        source, what = self.model.source, self.what
        is_map = Path(source).suffix in _MAPS
        if what is None:
            what = "map" if is_map else "robot" if self.wrench is None else "deflection"
        choice("--what", what, dict.fromkeys(_WHAT))
        if is_map != (what == "map"):
            expected = "a map, FILE.zarr or FILE.nc, with --what map; a robot with all else"
            hint = None if is_map else f"robostiff map {source} ... --plot FILE draws a new one"
            raise InputError(f"--what {what} of {source!r}", expected=expected, hint=hint)
        for name, value, of in (
            ("--wrench", self.wrench, _OF_LOADS),
            ("--quantity", self.quantity, ("map",)),
            ("--cut", self.cuts or None, ("map",)),
        ):
            if value is not None and what not in of:
                raise InputError(name, got=value, expected=f"--what {' or '.join(of)} beside it")
        if self.wrench is None and what in _OF_LOADS:
            expected = '--wrench beside it, such as "500 N 0 0 0 0 0"'
            raise InputError(f"--what {what}", expected=expected)
        return what

    def _of_robot(self, what: str) -> tuple[Picture, ...]:  # noqa: PLR0911
        """The picture, and of a mode the other end of the vibration."""
        from robostiff import plot
        from robostiff.analysis import stiffness
        from robostiff.cli import arguments as written
        from robostiff.statics import cable_response, deflection, modes

        data, robot = plot.PictureData(), written.load_machine(self.model, self.place)
        place = written.where(robot, self.place)
        shown = {"pose": place["pose"], "near": place["near"], "backend": data}
        if what == "robot":
            return (plot.robot(robot, colouring=plot.Colouring.NAMES, **shown),)
        if what in _OF_LOADS:
            F = written.wrench(self.wrench, robot.space)
            if what == "energy":
                kinds, expected = {"robot", "snapshot", "network", "linkage"}, "a robot with legs"
                written.check_kind(robot, kinds, "--what energy", expected=expected)
            if getattr(robot, "cables", ()):
                bent: Any = cable_response(robot, place["pose"], F)
            else:
                bent = deflection(robot, wrench=F, **place)
            if what == "energy":
                return (plot.energy_shares(bent, backend=data),)
            return (plot.robot(robot, deflection=bent, colouring=plot.Colouring.PARTS, **shown),)
        if what == "modes":
            shapes = modes(robot, **place)
            return tuple(plot.mode(shapes, self.mode, side, backend=data) for side in (1.0, -1.0))
        result, drawn = stiffness(robot, **place), {"within": robot, "backend": data}
        if what == "ellipsoids":
            qualities = {q.name.lower().replace("_", "-"): q for q in plot.Quality}
            quality = written.choice("--quality", self.quality, qualities)
            return (plot.ellipsoid(result, quality, **drawn),)
        if what == "matrix":
            return (plot.matrix(result, backend=data),)
        return (plot.free_motions(result, **drawn),)


def _line(name: str, more: str = "") -> Any:
    words = f"Line of the title block{more}."
    return option(name, metavar="TEXT", default="", show_default=False, help=words)


class Report(Command, name="report"):
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

    def run(self) -> int:
        """Write a report and print its path; 1 when the pose has a bad status."""
        from datetime import date

        from robostiff.cli import arguments as written
        from robostiff.io.map_files import read_map
        from robostiff.io.model_file import ALL_PARAMETERS
        from robostiff.report import (
            TitleBlock,
            described_by,
            report_contents,
            report_path,
            save_report,
        )
        from robostiff.robots import load

        model, source = self.model, self.model.source
        paths = [report_path(self.output)]
        if self.pdf and paths[0].suffix.lower() != ".pdf":
            paths.append(report_path(paths[0].with_suffix(".pdf")))
        for path in paths:
            new_file("--output", path, self.answer.overwrite)
        robot = written.load_machine(model)
        day = date.today().isoformat() if self.date == "today" else self.date
        symbolic, description = None, None
        if source != "-":  # standard input has been read
            description = described_by(source, model.parameters, **model.files)
            with suppress(InputError):  # of parameters that cannot be kept as symbols
                symbolic = model.load(symbols=ALL_PARAMETERS)
        contents = report_contents(
            robot,
            **written.where(robot, self.place),
            wrench=written.wrench(self.wrench, robot.space),
            found=None if self.map_file is None else read_map(self.map_file),
            symbolic=None if symbolic is None or symbolic.is_frozen else symbolic,
            finite=self.finite,
            title_block=TitleBlock(self.project, self.author, day, self.revision),
            described_by=description,
            other=None if self.compare is None else load(self.compare),
        )
        save_report(contents, *paths)
        show_files(paths, self.answer, status=str(contents.status))
        return BAD_STATUS if contents.status.is_bad else 0


def _axis(name: str, unit: str) -> Any:
    return option(f"--{name}", metavar='"START STOP COUNT"', help=f"Values of {name} [{unit}].")


class MakeMap(Command, name="map"):
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

    def run(self) -> int:
        """Compute a map, write it, and print a summary."""
        from robostiff.cli.commands_map import make_map

        return make_map(self)
