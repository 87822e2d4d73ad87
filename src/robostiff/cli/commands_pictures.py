"""The commands ``plot`` and ``report``."""

from __future__ import annotations

from contextlib import suppress
from datetime import date as day
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robostiff.analysis import cable_stiffness, stiffness
from robostiff.cli.command import BAD_STATUS
from robostiff.cli.options import Model, named_once
from robostiff.cli.options_of_pictures import WHAT, Plot, Report
from robostiff.cli.output import draw, new_file, picture_file, show
from robostiff.cli.written_arguments import (
    chosen,
    loaded,
    near_from,
    point_from,
    pose_from,
    wrench_from,
)
from robostiff.errors import InputError
from robostiff.model import Robot
from robostiff.model.cable import CableRobot
from robostiff.plot.backend import DATA
from robostiff.plot.energy_bars import energy_shares
from robostiff.plot.geometry.ellipsoid import Quality
from robostiff.plot.loaded_robot import mode
from robostiff.plot.maps.pictures import map_overview
from robostiff.plot.posed_robot import Colouring
from robostiff.plot.posed_robot import robot as robot_picture
from robostiff.plot.stiffness_pictures import ellipsoid, free_motions, matrix
from robostiff.statics import cable_response, deflection, modes

if TYPE_CHECKING:
    from robostiff.plot.picture import Picture

_MAPS = (".zarr", ".nc")
_OF_LOADS = ("deflection", "energy")
_CHARTS = ("energy", "matrix", "map")
_QUALITIES = {quality.name.lower().replace("_", "-"): quality for quality in Quality}


def make_plot(asked: Plot) -> int:
    """Draw into a file and print its path; 0."""
    source, answer = asked.model.source, asked.answer
    what = _what(source, asked)
    is_scene = what not in _CHARTS
    path = picture_file("--output", asked.output, answer.overwrite, is_scene=is_scene)
    if what == "map":
        pictures = (_of_map(source, asked),)
    else:
        pictures = _of_robot(what, loaded(asked.model, asked.place), asked)
    draw(pictures[0], path, *pictures[1:])
    show({"file": str(path), "what": what} if answer.as_json else str(path))
    return 0


def _what(subject: str, asked: Plot) -> str:
    """What is drawn: as written, or what the subject and the load suggest."""
    is_map = Path(subject).suffix in _MAPS
    what = asked.what
    if what is None:
        what = "map" if is_map else "robot" if asked.wrench is None else "deflection"
    chosen("--what", what, dict.fromkeys(WHAT))
    if is_map != (what == "map"):
        raise InputError(
            f"--what {what} of {subject!r}",
            expected="a map, FILE.zarr or FILE.nc, with --what map; a robot with all else",
            hint=None if is_map else f"robostiff map {subject} ... --plot FILE draws a new one",
        )
    for option, given, of in (
        ("--wrench", asked.wrench, _OF_LOADS),
        ("--quantity", asked.quantity, ("map",)),
        ("--cut", asked.cuts or None, ("map",)),
    ):
        if given is not None and what not in of:
            raise InputError(option, got=given, expected=f"--what {' or '.join(of)} beside it")
    if asked.wrench is None and what in _OF_LOADS:
        raise InputError(f"--what {what}", expected='--wrench beside it, such as "500 N 0 0 0 0 0"')
    return what


def _of_robot(what: str, robot: Any, asked: Plot) -> tuple[Picture, ...]:
    """The picture, and of a mode the other end of the vibration."""
    pose, near = pose_from(robot, asked.place), near_from(robot, asked.place)
    if what == "robot":
        named = Colouring.NAMES
        return (robot_picture(robot, pose, near=near, colouring=named, backend=DATA),)
    if isinstance(robot, CableRobot):
        return (_of_cables(what, robot, pose, asked),)
    options: dict[str, Any] = {"at": point_from(asked.place), "near": near}
    if what in _OF_LOADS:
        bent = deflection(robot, pose, wrench_from(asked.wrench or "", robot.space), **options)
        if what == "energy":
            return (energy_shares(bent, backend=DATA),)
        shown: dict[str, Any] = {"deflection": bent, "colouring": Colouring.PARTS}
        return (robot_picture(robot, pose, near=near, **shown, backend=DATA),)
    if what == "modes":
        found = modes(robot, pose, **options)
        return tuple(mode(found, asked.mode, side, backend=DATA) for side in (1.0, -1.0))
    return (_of_stiffness(what, robot, stiffness(robot, pose, **options), asked),)


def _of_cables(what: str, robot: CableRobot, pose: Any, asked: Plot) -> Picture:
    if what in {"energy", "modes"}:
        raise InputError(f"--what {what}", got=robot, expected="a robot with legs")
    if what == "deflection":
        bent = cable_response(robot, pose, wrench_from(asked.wrench or "", robot.space))
        return robot_picture(robot, pose, deflection=bent, backend=DATA)
    result, at = cable_stiffness(robot, pose), point_from(asked.place)
    return _of_stiffness(what, robot, result.about(at), asked)


def _of_stiffness(what: str, robot: Any, result: Any, asked: Plot) -> Picture:
    if what == "matrix":
        return matrix(result, backend=DATA)
    if what == "free-motions":
        return free_motions(result, within=robot, backend=DATA)
    quality = chosen("--quality", asked.quality, _QUALITIES)
    return ellipsoid(result, quality, within=robot, backend=DATA)


def _of_map(path: str, asked: Plot) -> Picture:
    from robostiff.io.map_files import read_map

    at: dict[str, Any] = {}
    for name, value in named_once("--cut", asked.cuts, "NAME=VALUE, such as z=0.3").items():
        at[name] = value
        with suppress(ValueError):
            at[name] = float(value)
    quantity = None if asked.quantity is None else asked.quantity.replace("-", "_")
    return map_overview(read_map(path), quantity, at=at, backend=DATA)


def make_report(asked: Report) -> int:
    """Write a report and print its path; 1 when the pose has a bad status."""
    from robostiff.io.map_files import read_map
    from robostiff.report import TitleBlock, described_by, report_contents, report_path, save_report
    from robostiff.robots import load

    model, place = asked.model, asked.place
    paths = [report_path(asked.output)]
    if asked.pdf and paths[0].suffix.lower() != ".pdf":
        paths.append(report_path(paths[0].with_suffix(".pdf")))
    for path in paths:
        new_file("--output", path, asked.answer.overwrite)
    robot, source = loaded(model), model.source
    date = day.today().isoformat() if asked.date == "today" else asked.date
    contents = report_contents(
        robot,
        pose_from(robot, place),
        wrench=None if asked.wrench is None else wrench_from(asked.wrench, robot.space),
        at=point_from(place),
        near=near_from(robot, place),
        found=None if asked.map_file is None else read_map(asked.map_file),
        symbolic=_with_symbols(model),
        finite=asked.finite,
        title_block=TitleBlock(asked.project, asked.author, date, asked.revision),
        described_by=None
        if source == "-"
        else described_by(source, model.parameters, side=model.side, allow_xacro=model.allow_xacro),
        other=None if asked.compare is None else load(asked.compare),
    )
    save_report(contents, *paths)
    show(
        {"files": [str(path) for path in paths], "status": str(contents.status)}
        if asked.answer.as_json
        else "\n".join(map(str, paths))
    )
    return BAD_STATUS if contents.status.is_bad else 0


def _with_symbols(model: Model) -> Robot | None:
    """The robot with its parameters as symbols; None where they cannot be kept."""
    if model.source == "-":
        return None  # standard input has been read
    from robostiff.io.model_file import ALL_PARAMETERS

    with suppress(InputError):
        robot = model.load(symbols=ALL_PARAMETERS)
        return robot if isinstance(robot, Robot) else None
    return None
