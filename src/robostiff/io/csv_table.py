"""Tables of numbers as CSV files: units in headings, postures, and the place of every fault."""

from __future__ import annotations

import codecs
import difflib
import math
import os
import re
from array import array
from collections.abc import Collection, Mapping
from enum import Enum
from typing import Any

import numpy as np

from robostiff.analysis.maps.pose_columns import POSE_UNITS, coordinate_units
from robostiff.errors import FileError, InputError, Location, Words, warn_of_slip
from robostiff.frozen import frozen, replace
from robostiff.io.bounded_file import bounded_bytes
from robostiff.io.suggest import did_you_mean
from robostiff.io.units import Dimension, to_si
from robostiff.kinematics import JointCoordinates
from robostiff.kinematics.pose import home_coordinates
from robostiff.model import Robot
from robostiff.spatial import Space

_MOST_BYTES = 2_000_000_000
_LARGEST = 1e30
_SIMILAR = 0.81  # a name is taken for a slip: joint33 of joint3; not remark of marker
_MOST_WARNINGS = 12
_HEADING = re.compile(r"\s*(?P<name>[^\[\(]+?)\s*(?:[\[\(](?P<unit>[^\]\)]*)[\]\)])?\s*\Z")
EMPTY_LINE = re.compile(r"\s*(#|sep=|[\s;,]*\Z)", re.IGNORECASE)
_TIMES = {"": 1.0, "s": 1.0, "ms": 1e-3, "min": 60.0}


class OtherColumns(Enum):
    """What columns of names that are not known are.

    ``REFUSED``: a fault. ``PASSED``: not read, with a warning. ``KEPT``, in a file that is written
    again with them: not read, with a warning of those with a unit. A name that is like one that no
    column has is a fault in any case.
    """

    REFUSED = "refused"
    PASSED = "passed"
    KEPT = "kept"


@frozen
class Column:
    """A column that is read."""

    name: str
    place: int  # among the columns of the file
    unit: str
    factor: float  # SI units in its unit
    at: Location  # of its heading


@frozen
class CsvTable:
    """A table as its file has it."""

    lines: tuple[str, ...]  # all of the file
    header: int  # number of the line of headings, from 0
    rows: tuple[int, ...]  # numbers of the lines of numbers
    separator: str
    columns: tuple[Column, ...]  # those that are read
    si: dict[str, np.ndarray]  # their values (N,) in SI units
    words: dict[str, tuple[str, ...]]  # what stands in columns of words


def read_table(
    path: str | os.PathLike[str],
    units: Mapping[str, str],
    what: str,
    others: OtherColumns = OtherColumns.REFUSED,
) -> CsvTable:
    """`table_of` a file."""
    return table_of(str(path), lines_of(path), units, what, others=others)


def lines_of(path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Lines of a text file in UTF-8, in Latin-1, or in UTF-16 as Excel writes it."""
    content = bounded_bytes(path, _MOST_BYTES, "a CSV file")
    marked = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        return tuple(content.decode("utf-16" if marked else "utf-8-sig").splitlines())
    except UnicodeDecodeError:
        return tuple(content.decode("latin-1").splitlines())


def table_of(
    name: str,
    lines: tuple[str, ...],
    units: Mapping[str, str],
    what: str,
    *,
    others: OtherColumns = OtherColumns.REFUSED,
    words: Collection[str] = (),
    may_miss: Collection[str] = (),
    not_here: Collection[str] = (),
    first: int = 1,
) -> CsvTable:
    """Columns with these names and SI units, of the lines of a file with a name; one is a `what`.

    Tabs, semicolons or commas separate. Lines without a field, comments behind ``#`` and ``sep=``
    of Excel are passed over; `others` says what columns of other names are. Unless these are
    refused, units must be given, and decimals behind semicolons may have commas. Columns of
    `words` have no numbers; fields of columns that `may_miss` them are not a number where empty.
    Names that are `not_here` are no slips: another file has them. `first` is the number of the
    first line.

    Raises FileError with line and column of what cannot be read.
    """
    numbered = [k for k, line in enumerate(lines) if not EMPTY_LINE.match(line)]
    if len(numbered) < 2:
        expected = f"a line of names, then a line a {what}"
        raise FileError(Location(name), f"{what}s", got=Words(f"no {what}"), expected=expected)
    header, rows = numbered[0], tuple(numbered[1:])
    unquoted = re.sub('"[^"]*"', "", lines[header])
    separator = next((mark for mark in "\t;," if mark in unquoted), ",")
    headings = _fields(lines[header], separator)
    columns, places, passed = _columns_of(
        Location(name, header + first or None), headings, units, words, not_here, others
    )
    comma = others is not OtherColumns.REFUSED and separator == ";"
    values = array("d")
    for k in rows:
        fields = _fields(lines[k], separator)
        if len(fields) != len(headings):
            about: dict[str, Any] = {"got": Words(f"{len(fields)} fields")}
            about["expected"] = f"{len(headings)}, one for each name in line {header + first}"
            if separator == "," and len(fields) > len(headings):
                about["hint"] = "numbers have points, or semicolons between them"
            raise FileError(Location(name, k + first, 1), what, **about)
        row = [_number(fields[column.place], comma) for column in columns]
        for column, value in zip(columns, row, strict=True):
            field = fields[column.place]
            if not abs(value) <= _LARGEST and (column.name not in may_miss or _plain(field)):
                before = sum(len(text) + 1 for text in fields[: column.place])
                position = before + 1 + len(field) - len(field.lstrip())
                at, got = Location(name, k + first, position, column.name), field.strip()
                expected = "a finite number up to 1e30, with a point; units belong in the heading"
                raise FileError(at, "value", got=got or "nothing", expected=expected)
        values.extend(row)
    unread = [  # but for what a separator at the end of each line makes
        (at, label)
        for at, label, place in passed
        if others is OtherColumns.PASSED or re.search(r"[\[(]", headings[place])
        if headings[place].strip() or any(_fields(lines[k], separator)[place].strip() for k in rows)
    ]
    for at, label in unread[:_MOST_WARNINGS]:
        warn_of_slip(f"{at}: column {label[:60]!r} is not read")
    if more := unread[_MOST_WARNINGS:]:
        warn_of_slip(f"{more[0][0]}: {len(more)} more column{'s' * (len(more) > 1)} not read")
    table = np.array(values).reshape(len(rows), len(columns))
    si = {column.name: column.factor * table[:, k] for k, column in enumerate(columns)}
    texts = {
        label: tuple(_plain(_fields(lines[k], separator)[place]) for k in rows)
        for label, place in places.items()
    }
    return CsvTable(lines, header, rows, separator, tuple(columns), si, texts)


def _columns_of(
    line: Location,
    headings: list[str],
    units: Mapping[str, str],
    words: Collection[str],
    not_here: Collection[str],
    others: OtherColumns,
) -> tuple[list[Column], dict[str, int], list[tuple[Location, str, int]]]:
    """Columns of numbers, places of those of words, and what is not read, with its place."""
    # "'" is written before = + - @
    matches = [_HEADING.match(_plain(heading).removeprefix("'")) for heading in headings]
    names = {match["name"] for match in matches if match}
    if len(headings) == 1 and not names & {*units, *words}:
        expected = "names between tabs, semicolons or commas"
        raise FileError(line, "names of columns", got=headings[0].strip(), expected=expected)
    absent = {known.casefold(): known for known in (*units, *words) if known not in names}
    columns: list[Column] = []
    places: dict[str, int] = {}  # of words
    passed: list[tuple[Location, str, int]] = []
    start = 0
    for place, (heading, match) in enumerate(zip(headings, matches, strict=True)):
        at = replace(line, column=start + 1 + len(heading) - len(heading.lstrip()))
        start += len(heading) + 1
        name = match["name"] if match else re.split(r"[\[\(]", _plain(heading))[0].strip()
        if not match or (name not in units and name not in words):
            if others is OtherColumns.REFUSED:
                got, expected = heading.strip(), f"one of {', '.join(units)}"
                hint = did_you_mean(name, units)
                if name in Space.SPATIAL.wrench_order:
                    hint = "a map has one wrench, --wrench or wrench=; compensate reads forces"
                raise FileError(at, "name of a column", got=got, expected=expected, hint=hint)
            like = difflib.get_close_matches(name.casefold(), absent, 1, _SIMILAR)
            if like and name not in not_here:
                got = name if match else heading.strip()
                hint = f"did you mean {absent[like[0]]}? if not, give it a name less like that"
                raise FileError(at, "column", got=got, expected="a name that is read", hint=hint)
            passed.append((at, name, place))
            continue
        if name in places or name in [column.name for column in columns]:
            raise FileError(at, "name of a column", got=name, expected="each name once")
        if name in words:
            places[name] = place
            continue
        unit = (match["unit"] or "").replace("\u00c2\u00b5", "u").strip()  # micro, decoded twice
        if others is not OtherColumns.REFUSED and not unit and units[name]:
            example = f"one in brackets, as {name} [{units[name]}]"
            raise FileError(at, f"unit of {name}", got=Words("none"), expected=example)
        columns.append(Column(name, place, unit, _factor(at, name, unit, units[name]), at))
    for own, si in ((own, units[own.name]) for own in columns if not own.unit):
        alike = (other for other in columns if units[other.name] == si and other.factor != 1)
        for other in list(alike)[:1]:
            ways = f"write {own.name} [{si}], or {own.name} [{other.unit}]"
            warn_of_slip(f"{own.at}: {own.name} without a unit beside {other.name}; {ways}")
    return columns, places, passed


def _factor(at: Location, name: str, unit: str, si_unit: str) -> float:
    """SI units in the unit of a column; without one it has SI units."""
    if not si_unit:
        if unit:
            raise FileError(at, f"unit of {name}", got=unit, expected="none, it is a pure number")
        return 1.0
    if si_unit == "s":
        if unit not in _TIMES:
            raise FileError(at, "unit of time", got=unit, expected="s, ms or min")
        return _TIMES[unit]
    dimension = Dimension.of(si_unit)
    try:
        return to_si(f"1 {unit}", dimension)
    except InputError as error:
        words = {"got": unit, "expected": str(dimension), "hint": error.hint}
        raise FileError(at, f"unit of {name}", **words) from None


def _fields(line: str, separator: str) -> list[str]:
    """Fields of a line; a separator between two quotes is a part of one."""
    if not (quotes := line.count('"')) or quotes % 2:  # as of inches
        return line.split(separator)
    return re.findall(f'(?:^|{separator})((?:[^{separator}"]|"[^"]*")*)', line)


def _plain(field: str) -> str:
    """A field without the quotes that some programs write around it."""
    return field.strip().strip('"').strip()


def _number(field: str, comma: bool) -> float:
    text = _plain(field).replace("_", "?")  # 1_0 is a number of Python alone
    try:
        return float(text.replace(",", ".") if comma else text)
    except ValueError:
        return math.nan


def posture_columns(
    robot: Robot, table: CsvTable, at: Location, prefix: str = "", angles: str | None = None
) -> list[str]:
    """Names of all coordinates of the kind that a file has, joints or, behind a prefix, a pose.

    Warns of coordinates of a pose that are not free, but of Euler angles.

    Raises FileError at a heading that has none of them, both kinds, or some joints of an arm alone.
    A structure needs none: it has one pose.
    """
    joints, names = coordinate_units(robot), table.si.keys()
    poses = [f"{prefix}{name}" for name in POSE_UNITS]
    kinds = [kind for kind in ([*joints], poses) if set(kind) & set(names)]
    if not kinds and (joints or robot.coordinates):
        expected = f"some of {', '.join([*joints, *poses])}, with units"
        heading = table.lines[table.header]
        raise FileError(at, "names of columns", got=heading, expected=expected)
    if len(kinds) > 1:
        raise FileError(at, "postures", got=Words("joints and poses"), expected="one kind of them")
    kind, absent = kinds[0] if kinds else poses, [name for name in joints if name not in names]
    if kind != poses and absent:
        got = Words(f"no column of {', '.join(absent)}")
        raise FileError(at, "joints of the arm", got=got, expected="columns of all of them")
    bound = {*poses[: None if angles is None else 3]} - {*poses[: 6 * robot.is_posed_by_joints]}
    bound -= {f"{prefix}{coordinate.value}" for coordinate in robot.coordinates}
    for column in table.columns if kind == poses else ():
        if column.name in bound:
            why = "it is no free coordinate of the robot"
            warn_of_slip(f"{column.at}: column {column.name!r} is not read: {why}")
    return kind


def postures_of(
    robot: Robot,
    names: list[str],
    si: Mapping[str, np.ndarray],
    count: int,
    angles: str | None = None,
) -> np.ndarray | JointCoordinates:
    """Joints, or free coordinates of poses, (N, n) by `posture_columns`.

    What a pose leaves out is at home; its rotation is a vector, or Euler angles in an order.
    """
    by_joints = names[0] in coordinate_units(robot)
    numeric = robot.numeric
    home = numeric.legs[0].chain.home if by_joints else home_coordinates(numeric)
    columns = [si.get(name, np.full(count, float(q))) for name, q in zip(names, home, strict=True)]
    postures = np.array(columns).T
    if by_joints:
        return JointCoordinates(postures)
    if angles is not None:
        from scipy.spatial.transform import Rotation

        turned = Rotation.from_euler(angles, postures[:, euler_places(angles)])
        postures[:, 3:] = turned.as_rotvec()
    return postures if robot.is_posed_by_joints else postures[:, robot.coordinate_places]


def euler_places(angles: str) -> list[int]:
    """Columns of a pose that have Euler angles, in their order."""
    return [3 + "xyz".index(axis) for axis in angles.lower()]
