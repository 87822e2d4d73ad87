"""Reports into files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from robostiff.errors import InputError
from robostiff.kinematics import Pose
from robostiff.model import Robot, Snapshot
from robostiff.report.contents import ReportContents, report_contents
from robostiff.report.page import report_html

if TYPE_CHECKING:
    import xarray


def write_report(
    robot: Robot | Snapshot,
    path: str | Path,
    pose: Pose = None,
    *,
    wrench: ArrayLike | None = None,
    at: ArrayLike | None = None,
    found: xarray.Dataset | None = None,
) -> None:
    """Write what there is to say about a robot at a pose as one page of HTML.

    Parameters
    ----------
    robot : Robot or Snapshot
    path : str or Path
        The file to write, ``.html``. It opens without a network, in any browser.
    pose : RigidTransform, array, JointCoordinates or None
        One pose, as for `robostiff.stiffness`.
    wrench : (6,) array, or (3,) for a planar robot, optional
        A load [N, N m] about `at`: adds the deflection and who bends.
    at : (3,) array, optional
        Point about which stiffness and load are told, in the world [m].
    found : xarray.Dataset, optional
        A map of this robot over a grid: adds slices of the workspace.

    Raises
    ------
    InputError
        When an argument does not fit, or the file is no page of HTML.

    Examples
    --------
    ::

        rs.write_report(rs.load("hexapod"), "hexapod.html", wrench=[500, 0, 0, 0, 0, 0])
    """
    save_report(report_contents(robot, pose, wrench=wrench, at=at, found=found), path)


def save_report(contents: ReportContents, path: str | Path) -> None:
    """Write a report whose contents are known.

    Raises
    ------
    InputError
        When the file is no page of HTML.
    """
    path = Path(path)
    if path.suffix.lower() not in {".html", ".htm"}:
        raise InputError("file of a report", got=str(path), expected="a name that ends in .html")
    path.write_text(report_html(contents), encoding="utf-8")
