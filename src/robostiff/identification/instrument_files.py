"""Exports of instruments and of calibration programs, as lines with our headings."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence

import numpy as np

from robostiff.analysis.maps.pose_columns import coordinate_units
from robostiff.errors import FileError, Location
from robostiff.io.bounded_file import bounded_bytes
from robostiff.io.csv_table import OtherColumns, table_of
from robostiff.model import Robot
from robostiff.spatial.rotation import vector_of_rotation

_MOST_BYTES = 200_000_000
_TAG = ("x [mm]", "y [mm]", "z [mm]", "rx [rad]", "ry [rad]", "rz [rad]")


def lines_of(path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Lines of a text file in UTF-8 or Latin-1; the sign of micro, in any encoding, is u."""
    content = bounded_bytes(path, _MOST_BYTES, "a CSV file")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    return tuple(re.sub("\u00c2?\u00b5|\u03bc", "u", text).splitlines())


def tracker_points(
    name: str, lines: Sequence[str]
) -> tuple[dict[str, np.ndarray], np.ndarray, tuple[int, ...]] | None:
    """What a tracker has written: columns, rows (N,) that are not deleted, and their lines.

    None of a file of another kind.
    ``U(95)`` is twice the standard deviation, of each axis where there is one; those that are
    rounded to zero are as large as the smallest that are not. A word in ``Delete`` marks what was
    taken out.
    """
    first = next((line for line in lines if line.strip()), "")
    if "U(95)" not in first:
        return None
    plain = tuple(line.replace("U(95)", "U95").replace('"', "") for line in lines)
    units: dict[str, str] = dict.fromkeys(("X", "Y", "Z", "U95", "U95 X", "U95 Y", "U95 Z"), "m")
    table = table_of(
        name, plain, units, "point", others=OtherColumns.PASSED, words=("Delete",), may_miss=units
    )
    if not {"X", "Y", "Z"} <= table.si.keys():
        at = Location(name, table.header + 1)
        raise FileError(at, "columns", got=first[:80], expected="X, Y and Z")
    si = {a.lower(): table.si[a] for a in "XYZ"}
    for a in "XYZ":
        spread = table.si.get(f"U95 {a}", table.si.get("U95"))
        if spread is not None:
            spread = np.where(spread == 0, np.min(spread, where=spread > 0, initial=np.inf), spread)
            si[f"sigma_{a.lower()}"] = 0.5 * spread
    words = table.words.get("Delete", ("",) * len(table.rows))
    valid = np.array([word in ("", "0") for word in words])
    for column, spread in si.items():
        for row in np.flatnonzero(valid & np.isnan(spread))[:1]:
            at = Location(name, table.rows[row] + 1, path=column)
            raise FileError(at, "value", got="nothing", expected="a finite number")
    return si, valid, tuple(k + 1 for k in table.rows)


def with_headings(name: str, lines: Sequence[str], columns: Sequence[str]) -> tuple[str, ...]:
    """Lines of numbers behind one of headings.

    Raises FileError for a line with another count of fields.
    """
    named = [place for place, heading in enumerate(columns) if heading.strip()]
    written = ["\t".join(columns[place] for place in named)]
    for k, line in enumerate(lines, 1):
        fields = re.split(r"[\t;,]|\s+", line.strip()) if line.strip() else []
        is_row = bool(fields) and not line.lstrip().startswith("#")
        if is_row and len(fields) != len(columns):
            raise FileError(
                Location(name, k, 1),
                "reading",
                got=f"{len(fields)} fields",
                expected=f"{len(columns)}, one for each of columns=",
            )
        written.append("\t".join(fields[place] for place in named) if is_row else line)
    return tuple(written)


def auto_id_lines(robot: Robot, name: str, lines: Sequence[str]) -> tuple[str, ...] | None:
    """Lines of an Auto ID file behind one of our headings; None of a file of another kind.

    Rotations are yaw about z, then pitch about the new y, then roll about the newest x.
    """
    from scipy.spatial.transform import Rotation

    joints = coordinate_units(robot)
    rows = [line.split("\t") for line in lines]
    numbers: list[list[float] | None] = []
    for row in rows:
        try:
            numbers.append([float(word) for word in row[1:]])
        except ValueError:
            numbers.append(None)
    full = [k for k, row in enumerate(rows) if "".join(row).strip()]
    begins = 1 if full and numbers[full[0]] is None else 0
    ours = begins and any(heading.partition("[")[0].strip() in joints for heading in rows[full[0]])
    if not joints or ours or not full[begins:] or len(rows[full[0]]) != 7 + len(joints):
        return None
    turned = any(any((numbers[k] or [])[3:6]) for k in full[begins:])
    headings = ["marker", *_TAG[: 6 if turned else 3]]
    headings += [f"{joint} [{'deg' if unit == 'rad' else 'mm'}]" for joint, unit in joints.items()]
    written = ["\t".join(headings)]
    for k, row in enumerate(numbers):
        if k not in full[begins:]:
            written.append("")
            continue
        if row is None or len(row) != 6 + len(joints):
            expected = "numbers behind the tag: X, Y, Z, roll, pitch, yaw, joints"
            raise FileError(Location(name, k + 1, 1), "point", got=lines[k][:60], expected=expected)
        turn = vector_of_rotation(Rotation.from_euler("ZYX", row[5:2:-1], degrees=True).as_matrix())
        values = [*row[:3], *(turn if turned else ()), *row[6:]]
        written.append("\t".join(["tool", *map(repr, map(float, values))]))
    return tuple(written)
