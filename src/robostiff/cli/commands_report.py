"""The commands ``report`` and ``view``."""

from __future__ import annotations

import webbrowser
from collections.abc import Mapping
from contextlib import closing, suppress
from datetime import date as day
from typing import Any

from robostiff.cli.command import BAD_STATUS
from robostiff.cli.options import Answer, Model, Place, Replacing
from robostiff.cli.output import new_file, show
from robostiff.cli.picture_commands import Page, Pages
from robostiff.cli.written_arguments import loaded, near_from, point_from, pose_from, wrench_from
from robostiff.errors import InputError
from robostiff.io.map_files.netcdf import read_map
from robostiff.io.model_file import ALL_PARAMETERS
from robostiff.model import Robot
from robostiff.report import (
    TitleBlock,
    described_by,
    report_contents,
    report_path,
    save_report,
)
from robostiff.robots import load
from robostiff.view import LivePage, machine_of, parameter_sliders, parameters_written


def make_report(
    model: Model, pages: Pages, place: Place, replacing: Replacing, answer: Answer
) -> int:
    """Write a report and print its path; 1 when the pose has a bad status."""
    paths = [report_path(pages.output)]
    if pages.pdf and paths[0].suffix.lower() != ".pdf":
        paths.append(report_path(paths[0].with_suffix(".pdf")))
    for path in paths:
        new_file("--output", path, replacing.overwrite)
    robot, source = loaded(model, place), model.source
    contents = report_contents(
        robot,
        pose_from(robot, place),
        wrench=None if pages.wrench is None else wrench_from(pages.wrench, robot.space),
        at=point_from(place),
        near=near_from(robot, place),
        found=None if pages.map_file is None else read_map(pages.map_file),
        symbolic=_with_symbols(model),
        finite=pages.finite,
        title_block=_title_block(pages),
        described_by=None if source == "-" else described_by(source, model.parameters),
        other=None if pages.compare is None else load(pages.compare),
    )
    save_report(contents, *paths)
    show(
        {"files": [str(path) for path in paths], "status": str(contents.status)}
        if answer.as_json
        else "\n".join(map(str, paths))
    )
    return BAD_STATUS if contents.status.is_bad else 0


def _title_block(pages: Pages) -> TitleBlock:
    given = day.today().isoformat() if pages.date == "today" else pages.date
    return TitleBlock(pages.project, pages.author, given, pages.revision)


def _with_symbols(model: Model) -> Robot | None:
    """The robot with its parameters as symbols; None where they cannot be kept."""
    if model.source == "-":
        return None  # standard input has been read
    with suppress(InputError):
        robot = model.load(symbols=ALL_PARAMETERS)
        return robot if isinstance(robot, Robot) else None
    return None


def show_view(model: Model, place: Place, page: Page, answer: Answer) -> int:
    """Serve a view until it is interrupted; 0 then."""
    source, given = model.source, model.parameters

    def built(moved: Mapping[str, str]) -> Any:
        return loaded(model, moved=moved)

    robot = built({})
    machine = machine_of(robot, pose_from(robot, place))
    wrench = None if page.wrench is None else wrench_from(page.wrench, machine.space)
    written = {**parameters_written(source, model.side), **given} if source != "-" else {}
    live = LivePage(machine, parameter_sliders(written), built, wrench, page.port)
    with closing(live), suppress(KeyboardInterrupt):
        show({"url": live.url} if answer.as_json else f"{live.url}\nCtrl-C ends the view.")
        if not page.no_browser:
            webbrowser.open(live.url)
        live.wait()
    return 0
