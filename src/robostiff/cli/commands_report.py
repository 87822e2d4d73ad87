"""The command ``report``."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from robostiff.cli.failure import BAD_STATUS
from robostiff.cli.output import new_file, print_data, say
from robostiff.cli.written_arguments import (
    NO_SIDE_FILE,
    PoseArguments,
    SideFile,
    near_from,
    parameters_from,
    point_from,
    pose_from,
    wrench_from,
)
from robostiff.errors import InputError
from robostiff.io.map_files.read_map import read_map
from robostiff.io.model_file import ALL_PARAMETERS
from robostiff.model import Robot, Snapshot
from robostiff.report import (
    NO_TITLE_BLOCK,
    TitleBlock,
    described_by,
    report_contents,
    report_path,
    save_report,
)
from robostiff.robots import load


@dataclass(frozen=True)
class Pages:
    """Contents of a report besides the pose, and its files."""

    wrench: str | None
    map_file: str | None
    output: str
    pdf: bool
    overwrite: bool = False
    finite: bool = False
    compare: str | None = None
    title_block: TitleBlock = NO_TITLE_BLOCK


def make_report(
    source: str,
    place: PoseArguments,
    pages: Pages,
    settings: Sequence[str],
    side: SideFile = NO_SIDE_FILE,
    *,
    as_json: bool = False,
) -> int:
    """Write a report and print its path; 1 when the pose has a bad status."""
    paths = [report_path(pages.output)]
    if pages.pdf and paths[0].suffix.lower() != ".pdf":
        paths.append(report_path(paths[0].with_suffix(".pdf")))
    for path in paths:
        new_file("--output", path, pages.overwrite)
    robot = load(source, parameters_from(settings), **side.options)
    contents = report_contents(
        robot,
        pose_from(robot, place),
        wrench=None if pages.wrench is None else wrench_from(pages.wrench, robot.space),
        at=point_from(place),
        near=near_from(robot, place) if isinstance(robot, Robot | Snapshot) else None,
        found=None if pages.map_file is None else read_map(pages.map_file),
        symbolic=_with_symbols(source, settings),
        finite=pages.finite,
        title_block=pages.title_block,
        described_by=None if source == "-" else described_by(source, parameters_from(settings)),
        other=None if pages.compare is None else load(pages.compare),
    )
    save_report(contents, *paths)
    if as_json:
        print_data({"files": [str(path) for path in paths], "status": str(contents.status)})
    else:
        say("\n".join(map(str, paths)))
    return BAD_STATUS if contents.status.is_bad else 0


def _with_symbols(source: str, settings: Sequence[str]) -> Robot | None:
    """The robot with its parameters as symbols; None where they cannot be kept."""
    if source == "-":
        return None  # standard input has been read
    with suppress(InputError):
        robot = load(source, parameters_from(settings), symbols=ALL_PARAMETERS)
        return robot if isinstance(robot, Robot) else None
    return None
