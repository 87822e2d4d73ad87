"""Measurements from CSV files, and from exports of trackers."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from robostiff.analysis.maps.pose_columns import POSE_UNITS, coordinate_units
from robostiff.errors import FileError, InputError, Location
from robostiff.identification.measurements import Measurements, Reading, coordinates_of
from robostiff.io.bounded_file import bounded_bytes
from robostiff.io.csv_table import read_table
from robostiff.io.units import Dimension, parse_quantity, to_si
from robostiff.kinematics import JointCoordinates
from robostiff.kinematics.pose import home_coordinates
from robostiff.model import Robot
from robostiff.model.mass import gravity_vector

_AXES = "xyz"
_READINGS = {
    Reading.POINT: ("x", "y", "z"),
    Reading.DISPLACEMENT: ("dx", "dy", "dz"),
    Reading.ALONG: ("along",),
    Reading.DISTANCE: ("distance",),
}
_WORDS = ("posture", "marker", "row", "reference")
_WRENCH = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
_MOST_BYTES = 200_000_000


def read_measurements(
    robot: Robot, path: str | os.PathLike[str], *, joints: str | os.PathLike[str] | None = None
) -> Measurements:
    """Readings of a CSV file, a reading a line.

    The first line has the names of the columns, with units in brackets. Postures are joints of an
    arm by name, or ``pose_x [mm]`` to ``pose_rz [deg]``; where ``posture`` repeats a word, they
    may be left out. Loads are ``Fx [N]`` to ``Mz [N m]`` about the reference point, or forces
    and ``mass [kg]`` at the hook ``at_x [mm], at_y [mm], at_z [mm]`` of the platform frame. What is
    read of a ``marker`` is ``x, y, z``; or its displacement ``dx, dy, dz``; ``along`` the
    direction ``u_x, u_y, u_z``; or its ``distance`` from the point ``from_x, from_y, from_z``.
    A displacement is from the load of the line whose ``row`` is its ``reference``, or from none.
    ``sigma``, or ``sigma_x, sigma_y, sigma_z``, are standard deviations. Empty fields are readings
    that are missing, and loads of zero.

    An export of a tracker, known by ``X``, ``Y``, ``Z`` and ``U(95)`` in its first line, has points
    alone: `joints` is a file with a line for each of its points, of the columns above.

    Parameters
    ----------
    robot : Robot
    path : path
    joints : path, optional

    Raises
    ------
    FileError
        With line and column of what cannot be read.
    """
    export = _tracker_export(path)
    if export is None:
        if joints is not None:
            expected = "a tracker export, with X [mm], Y [mm], Z [mm] and U(95) in its first line"
            raise FileError(Location(str(path), 1), "points of a tracker", expected=expected)
        table = _Table.read(robot, path, readings=True)
        return table.measurements({}, [*range(len(table.lines))], table.lines)
    if joints is None:
        raise FileError(
            Location(str(path), 1),
            "postures and loads of a tracker export",
            got="none",
            expected="a file with a line for each point",
            hint='write joints="joints.csv", or --postures joints.csv',
        )
    table = _Table.read(robot, joints, readings=False)
    if len(table.lines) != len(export.kept):
        raise FileError(
            Location(str(joints)),
            "postures",
            got=f"{len(table.lines)} lines",
            expected=f"{len(export.kept)}, one for each point of {path}",
        )
    rows = np.flatnonzero(export.kept).tolist()
    return table.measurements(export.si, rows, export.lines, str(path))


@dataclass(frozen=True)
class _Table:
    """Columns of a file."""

    robot: Robot
    path: str
    lines: tuple[int, ...]  # from 1
    si: Mapping[str, np.ndarray]
    words: Mapping[str, tuple[str, ...]]

    @classmethod
    def read(cls, robot: Robot, path: str | os.PathLike[str], *, readings: bool) -> _Table:
        joints = coordinate_units(robot)
        poses = {f"pose_{name}": unit for name, unit in POSE_UNITS.items()}
        units = {**joints, **poses}
        loads = {name: "N" if name[0] == "F" else "N m" for name in _WRENCH}
        loads |= {"mass": "kg", **{f"at_{a}": "m" for a in _AXES}}
        read = {name: "m" for names in _READINGS.values() for name in names}
        read |= {f"{what}_{a}": unit for what, unit in (("u", ""), ("from", "m")) for a in _AXES}
        read |= dict.fromkeys(("sigma", *(f"sigma_{a}" for a in _AXES)), "m")
        given = units | loads | (read if readings else {})
        table = read_table(
            path, given, "reading", passes_others=True, words=_WORDS, may_miss=given.keys()
        )
        lines = tuple(k + 1 for k in table.rows)
        found = cls(robot, str(path), lines, table.si, table.words)
        header = Location(str(path), table.header + 1, 1)
        if not units.keys() & table.si.keys():
            expected = f"some of {', '.join(units)}, with units"
            got = table.lines[table.header]
            raise FileError(header, "names of columns", got=got, expected=expected)
        if joints.keys() & table.si.keys() and poses.keys() & table.si.keys():
            raise FileError(header, "postures", got="joints and poses", expected="one kind of them")
        if readings and not any(n in table.si for names in _READINGS.values() for n in names):
            raise FileError(
                header,
                "names of columns",
                got=table.lines[table.header],
                expected="what was read: x, y, z; dx, dy, dz; along; or distance, with units",
            )
        return found

    def at(self, row: int) -> Location:
        return Location(self.path, self.lines[row])

    def postures(self) -> np.ndarray | JointCoordinates:
        """Postures of all lines, those that are left out from the line of the same name."""
        joints = coordinate_units(self.robot)
        by_joints = bool(joints.keys() & self.si.keys())
        names = [*joints] if by_joints else [f"pose_{name}" for name in POSE_UNITS]
        home = home_coordinates(self.robot.numeric)
        if by_joints:
            home = self.robot.numeric.legs[0].chain.home
        given = [name for name in names if name in self.si]
        found = np.tile(np.asarray(home, dtype=float), (len(self.lines), 1))
        first: dict[str, int] = {}
        for row in range(len(self.lines)):
            values = np.array([self.si[name][row] for name in given])
            label = self.words["posture"][row] if "posture" in self.words else ""
            missing = np.isnan(values)
            places = [names.index(name) for name in given]
            if missing.any():
                if not (missing.all() and label in first):
                    name = given[int(np.argmax(missing))]
                    hint = f"or leave out all of a posture {label!r} that is known already"
                    raise FileError(
                        self.at(row), name, got="nothing", expected="a number", hint=hint
                    )
                found[row] = found[first[label]]
                continue
            found[row, places] = values
            if label:
                before = first.setdefault(label, row)
                if not np.array_equal(found[before], found[row]):
                    raise FileError(
                        self.at(row),
                        f"posture {label!r}",
                        got="other coordinates than before",
                        expected=f"those of line {self.lines[before]}, or another name",
                    )
        if by_joints:
            return JointCoordinates(found)
        return found[:, self.robot.coordinate_places] if self.robot.coordinates else found

    def measurements(
        self,
        points: Mapping[str, np.ndarray],
        rows: list[int],
        lines: tuple[int, ...],
        source: str = "",
    ) -> Measurements:
        """Readings of some lines, with points from elsewhere where they are given."""
        count = len(self.lines)
        si = {**self.si, **points}
        none = np.full(count, np.nan)

        def columns(names: tuple[str, ...], default: float = np.nan) -> np.ndarray:
            each = np.array([si.get(name, none) for name in names]).T
            each[np.isnan(each)] = default
            return each

        load = columns(_WRENCH, 0.0)
        hooks = columns(tuple(f"at_{a}" for a in _AXES))
        at_hooks = np.isfinite(hooks).all(axis=1)
        for row in np.flatnonzero(np.isfinite(hooks).any(axis=1) & ~at_hooks).tolist():
            raise FileError(self.at(row), "hook", got="a part of it", expected="at_x, at_y, at_z")
        forces = load[:, :3] * np.reshape(at_hooks, (-1, 1))
        mass = columns(("mass",), 0.0)[:, 0]
        if mass.any():
            own = self.robot.numeric.gravity
            down = gravity_vector("gravity", "-z") if own is None or not np.any(own) else own
            forces = forces + mass[:, None] * down
        load[:, :3] *= np.reshape(~at_hooks, (-1, 1))
        sigma = columns(tuple(f"sigma_{a}" for a in _AXES))
        sigma = np.where(np.isnan(sigma), si.get("sigma", none)[:, None], sigma)
        values, kinds = np.full((count, 3), np.nan), [Reading.POINT] * count
        toward = np.full((count, 3), np.nan)
        asked = set(rows)
        for row in range(count):
            read = {k: [si[n][row] for n in names if n in si] for k, names in _READINGS.items()}
            kind = [k for k, own in read.items() if np.isfinite(own).any()]
            if len(kind) != 1 and row in asked:
                got = " and ".join(k.value for k in kind) or "nothing"
                raise FileError(self.at(row), "reading", got=got, expected="one kind of value")
            if len(kind) != 1:
                values[row], sigma[row] = 0.0, 1.0  # it is left out
                continue
            kinds[row] = kind[0]
            for place, name in enumerate(_READINGS[kind[0]]):
                values[row, place] = si[name][row] if name in si else np.nan
            if kind[0].size == 1:
                word = "u" if kind[0] is Reading.ALONG else "from"
                toward[row] = [si.get(f"{word}_{a}", none)[row] for a in _AXES]
                sigma[row] = sigma[row, 0]
        postures = self.postures()
        markers = self.words.get("marker", ("marker",) * count)
        whole = np.column_stack([coordinates_of(postures), load, forces, hooks, values])
        seen: dict[tuple[object, ...], int] = {}
        for row in rows:
            key = (markers[row], whole[row].tobytes())
            if key in seen:
                raise FileError(
                    self.at(row),
                    "reading",
                    got=f"the same as line {self.lines[seen[key]]}, to the last digit",
                    expected="another one",
                    hint="remove one of them: it would count twice",
                )
            seen[key] = row
        found = Measurements(
            postures=postures,
            values=values,
            wrenches=load,
            forces=forces,
            hooks=hooks,
            markers=markers,
            sigma=sigma if np.isfinite(sigma).any() else None,
            kinds=kinds,
            toward=toward,
            references=self._references(),
            lines=lines,
            source=source or self.path,
        )
        return found if len(rows) == count else found.chosen(rows)

    def _references(self) -> list[int]:
        """Rows of references; -1 where there is none."""
        labels = self.words.get("row", ())
        found = []
        for row, name in enumerate(self.words.get("reference", ("",) * len(self.lines))):
            if name and name not in labels:
                expected = "the name of a line in the column row"
                raise FileError(self.at(row), "reference", got=name, expected=expected)
            found.append(labels.index(name) if name else -1)
        return found


@dataclass(frozen=True)
class _TrackerExport:
    """Points of a tracker: their coordinates and standard deviations, and which are not deleted."""

    si: dict[str, np.ndarray]
    kept: np.ndarray  # (N,) of bool
    lines: tuple[int, ...]


def _tracker_export(path: str | os.PathLike[str]) -> _TrackerExport | None:
    """What a tracker has written; None of a file of another kind.

    ``U(95)`` is twice the standard deviation, of each axis where there is one; a word in ``Delete``
    marks what was taken out. Units stand behind names, the sign of micro in any encoding.
    """
    name = str(path)
    content = bounded_bytes(path, _MOST_BYTES, "a CSV file")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    text = text.replace("\u00b5", "u").replace("\u03bc", "u").replace("\u00c2", "")
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    if not lines or "U(95)" not in lines[0][1]:
        return None
    mark = next((mark for mark in "\t;," if mark in lines[0][1]), ",")
    headings = [own.strip(" \"'") for own in lines[0][1].split(mark)]
    places = _tracker_columns(headings, Location(name, lines[0][0]))
    if not {"X", "Y", "Z"} <= places.keys():
        got = ", ".join(headings[:8])
        raise FileError(Location(name, lines[0][0]), "columns", got=got, expected="X, Y and Z")
    wanted = {"x": "X", "y": "Y", "z": "Z"}
    if "U(95)" in places:
        wanted |= {f"sigma_{a}": "U(95)" for a in _AXES}
    if "U(95) X" in places:
        wanted |= {f"sigma_{a}": f"U(95) {a.upper()}" for a in _AXES}
    values = np.full((len(lines) - 1, len(wanted)), np.nan)
    for row, (k, line) in enumerate(lines[1:]):
        fields = [own.strip(" \"'") for own in line.split(mark)] + [""] * len(headings)
        if "Delete" in places and fields[places["Delete"][0]] not in ("", "0"):
            continue
        for column, (own, word) in enumerate(wanted.items()):
            place, factor = places[word]
            try:
                value = float(fields[place]) * factor * (0.5 if own.startswith("sigma") else 1.0)
            except ValueError:
                value = np.nan
            if not np.isfinite(value):
                at, got = Location(name, k, path=word), fields[place] or "nothing"
                raise FileError(at, "value", got=got, expected="a finite number")
            values[row, column] = value
    si = dict(zip(wanted, values.T, strict=True))
    return _TrackerExport(si, np.isfinite(values[:, 0]), tuple(k for k, _ in lines[1:]))


def _tracker_columns(headings: list[str], at: Location) -> dict[str, tuple[int, float]]:
    """Places and units [m] of columns by name."""
    places: dict[str, tuple[int, float]] = {}
    for k, heading in enumerate(headings):
        word, _, unit = heading.partition("[")
        word, unit = word.strip(), unit.rstrip("] ")
        if word in ("X", "Y", "Z") or word.startswith("U(95)"):
            if not unit:
                raise FileError(at, f"unit of {word}", got="none", expected=f"{word} [mm]")
            try:
                places[word] = k, to_si(parse_quantity(f"1 {unit}"), Dimension.LENGTH, got=unit)
            except InputError as error:
                raise FileError.from_input_error(at, error) from None
        elif word == "Delete":
            places[word] = k, 1.0
    return places
