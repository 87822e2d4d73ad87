"""Reports into files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from robostiff.errors import InputError
from robostiff.io.whole_file import whole_file
from robostiff.kinematics import Near, Pose
from robostiff.linkage import Linkage
from robostiff.model import Robot, Snapshot
from robostiff.network import Network
from robostiff.report.contents import ReportContents, Reported, report_contents
from robostiff.report.origin import NO_TITLE_BLOCK, DescribedBy, TitleBlock
from robostiff.report.page import report_html
from robostiff.report.paper import report_pdf

if TYPE_CHECKING:
    import xarray

_PAGES, _PAPER = (".html", ".htm"), ".pdf"


def write_report(
    robot: Reported | Linkage,
    path: str | Path,
    pose: Pose | Mapping[str, Any] = None,
    *,
    wrench: ArrayLike | None = None,
    at: ArrayLike | None = None,
    near: Near = None,
    found: xarray.Dataset | None = None,
    finite: bool = False,
    title_block: TitleBlock = NO_TITLE_BLOCK,
    described_by: DescribedBy | None = None,
    other: Robot | Snapshot | Network | None = None,
) -> None:
    """Write a report about a robot at a pose: an HTML page or a PDF.

    Parameters
    ----------
    robot : Robot, Snapshot, Network, Linkage or CableRobot
    path : str or Path
        The file to write: ``.html`` opens in any browser without a network and has figures to turn
        and sliders; ``.pdf`` is for paper. A file of that name is replaced once all is written.
    pose : RigidTransform, array, JointCoordinates, mapping or None
        One pose, as for `robostiff.stiffness`; of a linkage coordinates of joints by name.
    wrench : (6,) array, or (3,) for a planar robot, optional
        A load [N, N m] about `at`: adds the deflection and the elastic energy of each part.
    at : (3,) array, optional
        Point about which stiffness and load are given, in the world [m].
    near : joint coordinates, optional
        Those that choose the posture, as for `robostiff.stiffness`.
    found : xarray.Dataset, optional
        A map of this robot over a grid: adds slices of the workspace.
    finite : bool
        Whether to answer for a finite wrench too: where the robot comes to rest, its stiffness
        there, the critical load, and the force-deflection curve.
    title_block : TitleBlock, optional
        Project, author, date and revision.
    described_by : DescribedBy, optional
        The file of the robot, as ``robostiff.report.described_by(path)`` reads it.
    other : Robot or Snapshot, optional
        A design that is compared, at the same pose and under the same load.

    Raises
    ------
    InputError
        When an argument does not fit, the file has another ending or no directory, or an optional
        package is missing.

    Examples
    --------
    ::

        rs.write_report(rs.load("hexapod"), "hexapod.html", wrench=[500, 0, 0, 0, 0, 0])
    """
    checked = report_path(path)
    contents = report_contents(
        robot,
        pose,
        wrench=wrench,
        at=at,
        near=near,
        found=found,
        finite=finite,
        title_block=title_block,
        described_by=described_by,
        other=other,
    )
    save_report(contents, checked)


def save_report(contents: ReportContents, *paths: str | Path) -> None:
    """Write a report whose contents are computed; to all files or, if one is refused, to none.

    Raises
    ------
    InputError
        As `write_report`.
    """
    checked = list(map(report_path, paths))
    written = [
        report_pdf(contents) if path.suffix.lower() == _PAPER else report_html(contents).encode()
        for path in checked
    ]
    for path, data in zip(checked, written, strict=True):
        with whole_file(path) as begun:
            begun.write_bytes(data)


def report_path(path: str | Path) -> Path:
    """The path of a report, checked before anything is computed.

    Raises
    ------
    InputError
        When it ends in neither .html nor .pdf, is a directory, or lies in none.

    Examples
    --------
    >>> report_path("hexapod.txt")
    Traceback (most recent call last):
    robostiff.errors.InputError: file of a report: got 'hexapod.txt', expected ...
    """
    path = Path(path)
    if path.suffix.lower() not in {*_PAGES, _PAPER}:
        raise InputError(
            "file of a report", got=str(path), expected="a name that ends in .html or .pdf"
        )
    if path.is_dir():
        raise InputError("file of a report", got=f"the directory {path}", expected="a file")
    if not path.parent.is_dir():
        raise InputError(
            "directory of a report",
            got=str(path.parent),
            expected="one that is there",
            hint=f"create it with mkdir -p {path.parent}",
        )
    return path
