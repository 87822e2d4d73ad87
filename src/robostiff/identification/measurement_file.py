"""Measurements from CSV files, among them exports of instruments and of calibration programs."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from robostiff.analysis.maps.pose_columns import POSE_UNITS, coordinate_units
from robostiff.errors import FileError, Location, Words, warn_of_slip
from robostiff.frozen import frozen
from robostiff.identification.measurement_kinds import (
    LoadAxes,
    Reading,
    act_at_hooks,
    coordinates_of,
)
from robostiff.io.csv_table import (
    EMPTY_LINE,
    OtherColumns,
    lines_of,
    posture_columns,
    postures_of,
    table_of,
)
from robostiff.kinematics import JointCoordinates
from robostiff.model import Robot
from robostiff.model.mass import gravity_vector
from robostiff.spatial import as_floats
from robostiff.spatial.rotation import vector_of_rotation

_AXES = "xyz"
_TURNS = ("rx", "ry", "rz")
_SIGMA = tuple(f"sigma_{a}" for a in _AXES)
# What is read: its kind, the columns of which one is filled, and those of standard deviations.
_READINGS = {
    "point": (Reading.POINT, (*_AXES, *_TURNS), (*_SIGMA, *("sigma_turn",) * 3)),
    "displacement": (Reading.DISPLACEMENT, ("dx", "dy", "dz"), _SIGMA),
    "along": (Reading.ALONG, ("along",), ("sigma",)),
    "distance": (Reading.DISTANCE, ("distance",), ("sigma",)),
    "torque": (Reading.TORQUE, ("torque",), ("sigma_torque",)),
    "push": (Reading.TORQUE, ("push",), ("sigma_push",)),
    "turn": (Reading.JOINT, ("angle",), ("sigma_turn",)),
    "travel": (Reading.JOINT, ("travel",), ("sigma",)),
}
_UNITS = {
    **dict.fromkeys(("x", "y", "z", "dx", "dy", "dz", "along", "distance", "travel"), "m"),
    **dict.fromkeys((*_TURNS, "angle", "sigma_turn"), "rad"),
    **{"torque": "N m", "push": "N", "sigma_torque": "N m", "sigma_push": "N"},
    **dict.fromkeys(("sigma", *_SIGMA), "m"),
    **{f"{what}_{a}": unit for what, unit in (("u", ""), ("from", "m")) for a in _AXES},
}
_FORCE, _MOMENT = ("Fx", "Fy", "Fz"), ("Mx", "My", "Mz")
_HOOK = ("at_x", "at_y", "at_z")
_WRENCH = (*_FORCE, *_MOMENT)
_LOADS = {
    **{name: "N" if name[0] == "F" else "N m" for name in _WRENCH},
    **{"mass": "kg", "sigma_F": "N", "sigma_M": "N m", **{f"at_{a}": "m" for a in _AXES}},
}
_WORDS = ("posture", "marker", "row", "reference", "drive", "axes", "direction", "at")
_DIRECTIONS = {"": 0, "loading": 1, "unloading": -1, "+": 1, "-": -1, "1": 1, "-1": -1}
# A marker among several in a line.
_OF_MARKER = re.compile(r"\s*'?(?P<name>[^\[\(.]+)\.(?P<axis>[xyz])\s*(?:[\[\(]|\Z)")


def read_measurements(
    robot: Robot,
    path: str | os.PathLike[str],
    joints: str | os.PathLike[str] | None,
    columns: Sequence[str] | None,
    hooks: Mapping[str, Any] | None,
    sigma: Sequence[float],
) -> tuple[dict[str, Any], list[int]]:
    """What `Measurements` are made of in a CSV file, a reading a line; and which readings count.

    The first line has the names of the columns, with units in brackets. Postures are joints of an
    arm by name, or ``pose_x [mm]`` to ``pose_rz [deg]``; where ``posture`` repeats a word, they
    may be left out. Loads are ``Fx [N]`` to ``Mz [N m]`` about the reference point, or forces
    and ``mass [kg]`` at the hook ``at_x [mm], at_y [mm], at_z [mm]`` of the platform frame, or
    of that of the body which ``at`` names, or at that of `hooks`; ``axes`` are world, platform or
    instrument, ``sigma_F [N]`` and ``sigma_M [N m]`` standard deviations of their components;
    ``direction`` is loading or unloading. What is read of a ``marker`` is ``x, y, z``, a pose with
    ``rx, ry, rz`` beside them; or its displacement ``dx, dy, dz``; ``along`` the direction ``u_x,
    u_y, u_z``; or its ``distance`` from the point ``from_x, from_y, from_z``. ``m1.x, m1.y, m1.z,
    m2.x, ...`` are points of several markers. Of a ``drive`` it is ``torque [N m]`` or ``push
    [N]``, or its joint's ``angle [deg]`` or ``travel [mm]`` behind the gear. A displacement is from
    the load of the line whose ``row`` is its ``reference``, or from none. ``sigma``, or ``sigma_x,
    sigma_y, sigma_z``, ``sigma_turn``, ``sigma_torque`` and ``sigma_push`` are standard deviations.
    Empty fields are readings that are missing, and no load. Of an arm all joints have
    columns, or none; of a pose what is left out stays at home.

    An export of a tracker, known by ``X``, ``Y``, ``Z`` and ``U(95)`` in its first line, has points
    alone: `joints` is a file with a line for each of its points, of the columns above. Lines of an
    Auto ID file, separated by tabs, are tag, X, Y, Z [mm], roll, pitch, yaw [deg], then joints
    [deg, mm]; turns that are zero in all lines are none.

    Parameters
    ----------
    robot : Robot
    path : path
    joints : path, optional
    columns : sequence of str, optional
        Headings of a file without a first line of them, whose fields are separated by blanks, tabs,
        semicolons or commas; empty ones are passed over.
    hooks : mapping of str to (3,) array, or to (str, (3,) array), optional
        In the platform frame, or that of the body that is named [m].
    sigma : sequence of one or two numbers
        Standard deviations of lengths and of turns [m, rad] that the file does not have.

    Raises
    ------
    FileError
        With line and column of what cannot be read.
    """
    names = ("sigma", "sigma_turn")[: len(sigma)]
    expected = "one or two numbers [m, rad]"
    known: dict[str, float] = dict(
        zip(names, as_floats("sigma", sigma, expected, None, (len(names),)), strict=True)
    )
    lines = lines_of(path)
    points = tracker_points(str(path), lines)
    if points is not None:
        if joints is None:
            at, what = Location(str(path), 1), "postures and loads of a tracker export"
            expected = "a file with a line for each point"
            hint = 'write joints="joints.csv", or --postures joints.csv'
            raise FileError(at, what, got=Words("none"), expected=expected, hint=hint)
        si, valid, places = points
        table = _Table.read(robot, str(joints), lines_of(joints), hooks, known, readings=si)
        if len(table.lines) != len(valid):
            got = Words(f"{len(table.lines)} lines")
            expected = f"{len(valid)}, one for each point of {path}"
            raise FileError(Location(str(joints)), "postures", got=got, expected=expected)
        return table.measurements(np.flatnonzero(valid).tolist(), places, str(path))
    if joints is not None:
        expected = "a tracker export, with X [mm], Y [mm], Z [mm] and U(95) in its first line"
        raise FileError(Location(str(path), 1), "points of a tracker", expected=expected)
    if columns is not None:
        behind = with_headings(str(path), lines, columns)
    else:
        behind = auto_id_lines(robot, str(path), lines)
    first = 1 if behind is None else 0  # number of the line of headings
    table = _Table.read(robot, str(path), behind or lines, hooks, known, first=first)
    rows = [*range(len(table.lines))]
    if table.several:
        rows = np.flatnonzero(np.isfinite(table.columns(_AXES)).any(axis=1)).tolist()
    return table.measurements(rows, table.lines)


@frozen
class _Table:
    """Columns of a file."""

    robot: Robot
    path: str
    lines: tuple[int, ...]  # from 1
    names: list[str]  # of all coordinates of a posture
    si: Mapping[str, np.ndarray]
    words: Mapping[str, tuple[str, ...]]
    hooks: Mapping[str, Any]
    several: bool  # whether a line has points of several markers

    @classmethod
    def read(
        cls,
        robot: Robot,
        path: str,
        lines: tuple[str, ...],
        hooks: Mapping[str, Any] | None,
        known: Mapping[str, float],
        readings: Mapping[str, np.ndarray] | None = None,
        first: int = 1,
    ) -> _Table:
        """Of lines from `first` on; where `readings` come, with postures and loads alone."""
        units = coordinate_units(robot) | {f"pose_{name}": u for name, u in POSE_UNITS.items()}
        units |= _LOADS | (_UNITS if readings is None else {})
        not_here = () if readings is None else _UNITS.keys()
        header = next((line for line in lines if not EMPTY_LINE.match(line)), "")
        matches = map(_OF_MARKER.match, re.split("[\t;,]", header) if readings is None else ())
        several = dict.fromkeys(match["name"].strip() for match in matches if match)  # of markers
        units |= {f"{name}.{a}": "m" for name in several for a in _AXES}
        table = table_of(
            path,
            lines,
            units,
            "reading",
            others=OtherColumns.PASSED,
            words=_WORDS,
            may_miss=units.keys(),
            not_here=not_here,
            first=first,
        )
        header = Location(path, table.header + first or None, 1)
        names = posture_columns(robot, table, header, "pose_")
        for key, begins in (("along", "u_"), ("distance", "from_")):
            for column in table.columns if key not in table.si else ():
                if column.name.startswith(begins):
                    warn_of_slip(f"{column.at}: column {column.name!r} is not read without {key!r}")
        read = {name for _, columns, _ in _READINGS.values() for name in columns}
        if readings is None and not several and not read & table.si.keys():
            raise FileError(
                header,
                "names of columns",
                got=table.lines[table.header],
                expected="what was read: x, y, z; dx, dy, dz; along; distance; torque; or angle, "
                "with units",
            )
        si, words = dict(table.si), table.words
        if several:  # a row for each marker of a line
            if mixed := {"marker", *_AXES} & (table.words.keys() | table.si.keys()):
                got, expected = f"{min(mixed)} and {min(several)}.x", "markers in one of these ways"
                raise FileError(header, "names of columns", got=Words(got), expected=expected)
            si = {name: np.repeat(numbers, len(several)) for name, numbers in si.items()}
            words = {name: tuple(x for x in word for _ in several) for name, word in words.items()}
            none = np.full(len(table.rows), np.nan)
            for a in _AXES:
                per_marker = [table.si.get(f"{name}.{a}", none) for name in several]
                si[a] = np.array(per_marker).T.ravel()
            words["marker"] = (*several,) * len(table.rows)
        rows = (np.repeat(table.rows, max(len(several), 1)) + first).tolist()
        default = {name: np.full(len(rows), number) for name, number in known.items()}
        si = {**default, **si, **(readings or {})}
        return cls(robot, path, tuple(rows), names, si, words, hooks or {}, bool(several))

    def at(self, row: int) -> Location:
        return Location(self.path, self.lines[row])

    def word(self, name: str, row: int) -> str:
        return self.words[name][row] if name in self.words else ""

    def columns(self, names: Collection[str], default: float = np.nan) -> np.ndarray:
        """Values (N, names), those that are missing by default."""
        none = np.full(len(self.lines), np.nan)
        values = np.array([self.si.get(name, none) for name in names]).T
        return np.where(np.isnan(values), default, values)

    def postures(self) -> np.ndarray | JointCoordinates:
        """Postures of all lines, those that are left out from the line of the same name."""
        si = {name: self.si[name].copy() for name in self.names if name in self.si}
        first: dict[str, int] = {}
        for row in range(len(self.lines)):
            label = self.word("posture", row)
            missing = [name for name, column in si.items() if np.isnan(column[row])]
            if missing and not (len(missing) == len(si) and label in first):
                hint = f"or leave out all of a posture {label!r} that is known already"
                raise FileError(
                    self.at(row), missing[0], got=Words("nothing"), expected="a number", hint=hint
                )
            before = first.setdefault(label, row) if label else row
            if not missing and any(column[row] != column[before] for column in si.values()):
                got = Words("other coordinates than before")
                expected = f"those of line {self.lines[before]}, or another name"
                raise FileError(self.at(row), f"posture {label!r}", got=got, expected=expected)
            for column in si.values() if missing else ():
                column[row] = column[before]
        return postures_of(self.robot, self.names, si, len(self.lines))

    def _hooks(self) -> tuple[np.ndarray, list[str]]:
        """Where loads act (N, 3), in frames of bodies, and these; not a number at the origins."""
        places, bodies = self.columns(_HOOK), [""] * len(self.lines)
        for row in range(len(self.lines)):
            name = self.word("at", row)
            if name in self.hooks:
                hook: Any = self.hooks[name]
                if len(hook) == 2:
                    bodies[row], hook = hook
                places[row] = as_floats(f"hook {name!r}", hook, "three numbers [m]", "m", (3,))
            elif "/" in name:
                bodies[row] = name
            elif name not in ("", "tip"):
                known = ", ".join(self.hooks) or "hooks="
                expected = f"tip, or one of {known}, or a body such as arm/joint3"
                raise FileError(self.at(row), "hook", got=name, expected=expected)
        return places, bodies

    def measurements(
        self, rows: list[int], lines: tuple[int, ...], source: str = ""
    ) -> tuple[dict[str, Any], list[int]]:
        """Those of all lines, and the lines that count."""
        count = len(self.lines)
        for part in (_FORCE, _MOMENT, _HOOK):
            names = [name for name in part if name in self.si or part is _HOOK]
            missing = np.isnan(self.columns(names)).reshape(count, -1)
            for row in np.flatnonzero(missing.any(axis=1) & ~missing.all(axis=1))[:1]:
                name = names[int(missing[row].argmax())]
                expected = f"a number, or nothing in all of {', '.join(names)}"
                raise FileError(self.at(row), name, got=Words("nothing"), expected=expected)
        load, (hooks, bodies) = self.columns(_WRENCH, 0.0), self._hooks()
        at_hooks = act_at_hooks(hooks, bodies)
        forces = load[:, :3] * np.reshape(at_hooks, (-1, 1))
        gravity = self.robot.numeric.gravity
        down = gravity_vector("gravity", "-z") if gravity is None or not gravity.any() else gravity
        forces = forces + self.columns(["mass"], 0.0) * down
        load[:, :3] *= np.reshape(~at_hooks, (-1, 1))
        values, sigma, kinds = self._values(set(rows))
        toward = np.full((count, 3), np.nan)
        for kind, word in ((Reading.ALONG, "u"), (Reading.DISTANCE, "from")):
            of_kind = [member is kind for member in kinds]
            toward[of_kind] = self.columns([f"{word}_{a}" for a in _AXES])[of_kind]
        postures = self.postures()
        directions = [self._one_of(_DIRECTIONS, "direction", row) for row in range(count)]
        markers = self.words.get("marker", ("marker",) * count)
        drives = self.words.get("drive", ("",) * count)
        whole = np.column_stack([coordinates_of(postures), load, forces, hooks, values])
        seen: dict[tuple[object, ...], int] = {}
        for row in rows:
            words = markers[row], drives[row], directions[row], bodies[row]
            key = (*words, whole[row].tobytes())
            before = seen.setdefault(key, row)
            if before != row:
                got = Words(f"the same as line {self.lines[before]}, to the last digit")
                hint = "remove one of them: it would count twice"
                raise FileError(self.at(row), "reading", got=got, expected="another one", hint=hint)
        labels, references = self.words.get("row", ()), []  # -1 where there is none
        for row in range(count):
            name = self.word("reference", row)
            if name and name not in labels:
                expected = "the name of a line in the column row"
                raise FileError(self.at(row), "reference", got=name, expected=expected)
            references.append(labels.index(name) if name else -1)
        by_name = {axes.value: axes for axes in LoadAxes} | {"": LoadAxes.WORLD}
        fields = {
            "postures": postures,
            "values": values,
            "wrenches": load,
            "forces": forces,
            "hooks": hooks,
            "markers": markers,
            "sigma": sigma if np.isfinite(sigma).any() else None,
            "kinds": kinds,
            "toward": toward,
            "references": references,
            "drives": drives,
            "axes": [self._one_of(by_name, "axes", row) for row in range(count)],
            "sigma_wrench": self.columns(("sigma_F",) * 3 + ("sigma_M",) * 3, 0.0),
            "directions": directions,
            "bodies": bodies,
            "lines": lines,
            "source": source or self.path,
        }
        return fields, rows

    def _values(self, lines: set[int]) -> tuple[np.ndarray, np.ndarray, list[Reading]]:
        """What was read (N, 3 or 6) in these lines, its sigma, and its kind."""
        count, kinds = len(self.lines), [Reading.POINT] * len(self.lines)
        values, sigma = np.full((count, 6), np.nan), np.full((count, 6), np.nan)
        for word, (kind, names, deviations) in _READINGS.items():
            numbers, sd = self.columns(names), self.columns(deviations)
            if "sigma_x" in deviations:
                sd[:, :3] = np.where(np.isnan(sd[:, :3]), self.columns(["sigma"]), sd[:, :3])
            read = np.isfinite(numbers)
            for row in np.flatnonzero(read.any(axis=1)).tolist():
                if np.isfinite(values[row]).any():
                    got = f"{kinds[row].value} and {word}"
                    raise FileError(self.at(row), "reading", got=got, expected="one kind of value")
                values[row, : len(names)], sigma[row, : len(names)] = numbers[row], sd[row]
                posed = word == "point" and read[row, 3:].any()
                if posed and not read[row].all():
                    raise FileError(
                        self.at(row), "pose", got=Words("a part"), expected="x, y, z, rx, ry, rz"
                    )
                kinds[row] = Reading.POSE if posed else kind
        for row in np.flatnonzero(~np.isfinite(values).any(axis=1)).tolist():
            if row in lines:
                raise FileError(
                    self.at(row), "reading", got=Words("nothing"), expected="one kind of value"
                )
            values[row, :3] = 0.0  # it is left out
            sigma[row, :3] = 1.0 if np.isfinite(sigma).any() else np.nan
        width = 6 if Reading.POSE in kinds else 3
        return values[:, :width], sigma[:, :width], kinds

    def _one_of(self, known: Mapping[str, Any], name: str, row: int) -> Any:
        """What a word of a column means."""
        word = self.word(name, row)
        if word not in known:
            expected = ", ".join(filter(None, known))
            raise FileError(self.at(row), name, got=word, expected=expected)
        return known[word]


_TAG = ("x [mm]", "y [mm]", "z [mm]", "rx [rad]", "ry [rad]", "rz [rad]")


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
            raise FileError(at, "value", got=Words("nothing"), expected="a finite number")
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
            got = Words(f"{len(fields)} fields")
            expected = f"{len(columns)}, one for each of columns="
            raise FileError(Location(name, k, 1), "reading", got=got, expected=expected)
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
