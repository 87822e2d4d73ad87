"""Measurements of a loaded robot: postures, loads, and what an instrument reads."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.identification.measurement_kinds import (
    LoadAxes,
    Reading,
    act_at_hooks,
    coordinates_of,
)
from robostiff.kinematics import JointCoordinates
from robostiff.model import Robot
from robostiff.spatial import as_floats, in_si
from robostiff.spatial.quantities import Units

# What each reading has, by its kind; and in arrays, by numbers a reading, what stands for none, and
# the units of quantities: readings of several kinds have several, and are plain numbers.
_EACH: dict[str, type] = {
    **{"kinds": Reading, "markers": str, "drives": str, "axes": LoadAxes},
    **{"directions": int, "bodies": str},
}
_ARRAYS = {
    **dict.fromkeys(("values", "sigma"), (6, np.nan, None)),
    **{"hooks": (3, np.nan, "m"), "toward": (3, np.nan, None), "forces": (3, 0.0, "N")},
    **dict.fromkeys(("wrenches", "sigma_wrench"), (6, 0.0, ("N",) * 3 + ("N m",) * 3)),
}


@frozen(eq=False, repr=False)
class Measurements:
    """N readings of markers on the platform of a robot that is loaded.

    Parameters
    ----------
    postures : JointCoordinates or (N, n) array
        Unloaded posture of each reading, in joints or as a pose [m, rad].
    values : (N, 3) array, or (N, 6) with a `Reading.POSE`
        What is read [m, rad, N, N m], not a number where nothing is; one number in the first
        column.
    wrenches : (6,) or (N, 6) array, optional
        On the platform about its reference point [N, N m]; none when left out.
    forces : (3,) or (N, 3) array, optional
        Beside it, at hooks of the platform or of other bodies [N].
    hooks : (3,) or (N, 3) array, optional
        Where these forces act, in the frame of their bodies [m]; the reference point of the
        platform, or the origin of that frame, when left out.
    markers : str or sequence of str
        Name of the marker of each reading.
    sigma : float, or array as the values, optional
        Standard deviations of the values; estimated when left out.
    kinds : Reading or sequence of Reading
    toward : (3,) or (N, 3) array, optional
        Direction of a reading along it, or fixed point of a distance [m], instrument axes.
    references : sequence of int, optional
        Reading whose load is that of the start of a displacement; -1 for no load but weights.
    drives : str or sequence of str
        Name of the drive of each reading of one.
    axes : LoadAxes or sequence of LoadAxes
        In which wrenches and forces are given.
    sigma_wrench : (6,) or (N, 6) array, optional
        Standard deviations of a load [N, N m], axes of the load; of its force at the hook where
        there is one. Readings have ``|dy/dF| sigma_F`` beside their own.
    directions : int or sequence of int
        1 of readings while the load grows, -1 while it shrinks, 0 where it is not known.
    bodies : str or sequence of str
        What each hook is on, by name, such as ``arm/joint3``; the platform when left out.
    lines : sequence of int, optional
        Where readings stand in their file.
    source : str
        Where they are from.

    Raises
    ------
    InputError
        When shapes do not fit, or a number is missing that is needed.

    Examples
    --------
    >>> import robostiff as rs
    >>> read = rs.Measurements(
    ...     [[0, 0, 0.9, 0, 0, 0]] * 2, [[0, 0, 0], [0, 0, -1e-4]], sigma=1e-6,
    ...     wrenches=[[0] * 6, [0, 0, -500, 0, 0, 0]], kinds=rs.Reading.DISPLACEMENT,
    ... )  # fmt: skip
    >>> read
    <Measurements: 2 readings of 1 marker at 1 posture>
    """

    postures: Any
    values: Any
    wrenches: Any = None
    forces: Any = None
    hooks: Any = None
    markers: Any = "marker"
    sigma: Any = None
    kinds: Any = Reading.POINT
    toward: Any = None
    references: Any = None
    drives: Any = ""
    axes: Any = LoadAxes.WORLD
    sigma_wrench: Any = None
    directions: Any = 0
    bodies: Any = ""
    lines: tuple[int, ...] = ()
    source: str = "reading"

    def __post_init__(self) -> None:
        by_joints, rowwise = isinstance(self.postures, JointCoordinates), np.ndim(self.sigma) == 2
        postures = self.postures.values if by_joints else self.postures
        q = np.atleast_2d(as_floats("postures", postures, "coordinates (N, n), a reading a row"))
        count = len(q)
        changed: dict[str, Any] = {
            "postures": JointCoordinates(q) if by_joints else q,
            **{name: _column(name, getattr(self, name), count, t) for name, t in _EACH.items()},
        }
        has_poses = Reading.POSE in changed["kinds"]
        for name, (most, none, units) in _ARRAYS.items():
            numbers = none if getattr(self, name) is None else getattr(self, name)
            size = 3 if name in ("values", "sigma") and not has_poses else most
            changed[name] = _rows(name, numbers, (count, size), units, may_miss=none != 0)
        references = (-1,) * count if self.references is None else tuple(self.references)
        if len(references) != count or not all(-1 <= k < count for k in references):
            expected = f"{count} numbers from -1 to {count - 1}"
            raise InputError("references", got=self.references, expected=expected)
        for name, numbers in (changed | {"references": references}).items():
            object.__setattr__(self, name, numbers)
        sigma = self.sigma
        read = self.is_read
        if not read.any(axis=1).all():
            k = int(np.argmin(read.any(axis=1)))
            raise InputError(self.place(k), got=Words("no value"), expected="at least one number")
        known = np.isfinite(sigma[read])
        if known.any() and not known.all():
            k = int(np.argmax((read & ~np.isfinite(sigma)).any(axis=1)))
            expected = "standard deviations of all readings, or of none"
            raise InputError(f"sigma of {self.place(k)}", got=Words("none"), expected=expected)
        if not np.all(sigma[read & np.isfinite(sigma)] > 0) or np.any(self.sigma_wrench < 0):
            raise InputError("sigma", got=Words("zero or less"), expected="more than zero")
        units = {kind if kind.of_drive else Reading.POINT for kind in self.kinds}
        several = len(units) > 1 or Reading.POSE in self.kinds
        if (several and not rowwise) or (self.sigma_wrench.any() and not known.any()):
            expected = "one for each number of readings of several units, or under uncertain loads"
            raise InputError("sigma", got=Words("none, or one for all"), expected=expected)
        for k, kind in enumerate(self.kinds):
            numbers = self.toward[k]
            if kind.of_drive and not self.drives[k]:
                raise InputError(
                    f"drive of {self.place(k)}", got=Words("none"), expected="its name"
                )
            lost = not np.isfinite(numbers).all() or (kind is Reading.ALONG and not numbers.any())
            if kind in (Reading.ALONG, Reading.DISTANCE) and lost:
                what = "a direction" if kind is Reading.ALONG else "a fixed point"
                raise InputError(f"toward of {self.place(k)}", got=Words("none"), expected=what)

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        robot: Robot,
        *,
        joints: str | os.PathLike[str] | None = None,
        columns: Sequence[str] | None = None,
        hooks: Mapping[str, Any] | None = None,
        sigma: Sequence[float] = (),
    ) -> Measurements:
        """Readings of a CSV file, a reading a line; see `read_measurements`."""
        from robostiff.identification.measurement_file import read_measurements

        fields, rows = read_measurements(robot, path, joints, columns, hooks, sigma)
        result = cls(**fields)
        return result if len(rows) == len(result) else result.chosen(rows)

    @property
    def is_read(self) -> np.ndarray:
        """Which numbers are there (N, 3)."""
        sizes = np.array([kind.size for kind in self.kinds])
        return np.isfinite(self.values) & (np.arange(self.values.shape[1]) < sizes[:, None])

    def are(self, *kinds: Reading) -> np.ndarray:
        """Which readings (N,) are of one of these kinds."""
        return np.array([kind in kinds for kind in self.kinds])

    @property
    def of_drives(self) -> np.ndarray:
        """Which readings (N,) are those of drives."""
        return np.array([kind.of_drive for kind in self.kinds])

    @property
    def coordinates(self) -> np.ndarray:
        """Postures (N, n) in joints, or as poses."""
        return coordinates_of(self.postures)

    @property
    def marker_names(self) -> tuple[str, ...]:
        """Names of the markers, in the order in which they are read first."""
        return tuple(dict.fromkeys(compress(self.markers, ~self.of_drives)))

    @property
    def branches(self) -> np.ndarray:
        """Loading less unloading (G, size) where readings repeat: the floor of any model."""
        return self.branches_among(np.ones(len(self), dtype=bool))

    def branches_among(self, rows: np.ndarray) -> np.ndarray:
        """The same of those readings alone that a mask (N,) has."""
        groups: dict[Any, dict[int, list[int]]] = {}
        loads = (self.coordinates, self.wrenches, self.forces, np.nan_to_num(self.hooks))
        for k in np.flatnonzero(rows).tolist():
            direction = self.directions[k]
            reading = self.markers[k], self.drives[k], self.kinds[k], self.axes[k], self.bodies[k]
            key = (*reading, self.references[k], *(array[k].tobytes() for array in loads))
            groups.setdefault(key, {}).setdefault(direction, []).append(k)
        gaps = [
            self.values[rows[1]].mean(axis=0) - self.values[rows[-1]].mean(axis=0)
            for rows in groups.values()
            if 1 in rows and -1 in rows
        ]
        return np.array(gaps).reshape(-1, self.values.shape[1])

    @property
    def has_sigma(self) -> bool:
        """Whether standard deviations are known."""
        return bool(np.isfinite(self.sigma).any())

    def place(self, k: int) -> str:
        """Where a reading is from, for messages."""
        if self.lines:
            return f"{self.source}:{self.lines[k]}"
        return f"reading {k + 1}"

    def chosen(self, rows: Sequence[int] | np.ndarray) -> Measurements:
        """Some of the readings; loads of references come along."""
        rows, count = np.asarray(rows), len(self)
        if rows.dtype == bool and rows.shape == (count,):
            rows = np.flatnonzero(rows)
        if rows.dtype.kind not in "iu" or not rows.size or rows.min() < 0 or rows.max() >= count:
            raise InputError("readings", got=rows, expected=f"some of the numbers 0 to {count - 1}")
        place = {int(k): i for i, k in enumerate(rows)}
        for k in rows:
            if self.references[k] >= 0 and self.references[k] not in place:
                got = Words("left out")
                expected = "kept with it"
                raise InputError(f"reference of {self.place(int(k))}", got=got, expected=expected)
        q, kinds = self.coordinates[rows], [self.kinds[k] for k in rows]
        width = 6 if Reading.POSE in kinds else 3
        arrays = {name: getattr(self, name)[rows] for name in _ARRAYS}
        return replace(
            self,
            postures=JointCoordinates(q) if isinstance(self.postures, JointCoordinates) else q,
            references=[place.get(self.references[k], -1) for k in rows],
            lines=tuple(self.lines[k] for k in rows) if self.lines else (),
            **{name: [getattr(self, name)[k] for k in rows] for name in _EACH},
            **arrays | {name: arrays[name][:, :width] for name in ("values", "sigma")},
        )

    def with_loads_moved(self, k: int, sign: float) -> Measurements:
        """The same with component k of each load moved by its standard deviation, at its hook.

        Behind them stand the readings as they are, which displacements refer to.
        """
        count = len(self)
        moved = self.chosen(np.tile(np.arange(count), 2))
        wrenches, forces, shift = moved.wrenches, moved.forces, sign * self.sigma_wrench[:, k]
        at_hook = act_at_hooks(self.hooks, self.bodies) & (k < 3)
        wrenches[:count, k] += np.where(at_hook, 0.0, shift)
        forces[:count, k % 3] += np.where(at_hook, shift, 0.0)
        return replace(moved, wrenches=wrenches, forces=forces)

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        def several(count: int, word: str) -> str:
            return f"{count} {word}" + "s" * (count != 1)

        postures = len(np.unique(self.coordinates, axis=0))
        drives = len(set(filter(None, self.drives)))
        of = [several(len(self.marker_names), "marker")] * bool(self.marker_names)
        of += [several(drives, "drive")] * bool(drives)
        return (
            f"<Measurements: {several(len(self), 'reading')} of {' and '.join(of)} at "
            f"{several(postures, 'posture')}>"
        )


def _rows(
    name: str, values: ArrayLike, shape: tuple[int, int], units: Units | None, *, may_miss: bool
) -> np.ndarray:
    """One row a reading (N, size); not a number where it may be missing."""
    expected, missing = f"({shape[1]},) or {shape}", np.array(False)
    values = in_si(name, values, expected, units)
    with suppress(TypeError, ValueError):  # of what are no numbers, which are refused below
        if may_miss:
            missing = np.isnan(np.asarray(values, dtype=float))
            values = np.where(missing, 0.0, np.asarray(values, dtype=float))
    numbers = np.where(missing, np.nan, as_floats(name, values, expected))
    if numbers.shape not in {(), shape[1:], shape}:
        raise InputError(name, got=Words(f"shape {numbers.shape}"), expected=expected)
    return np.broadcast_to(numbers, shape).copy()


def _column(name: str, values: Any, count: int, kind: type) -> tuple[Any, ...]:
    """One of a kind for each reading."""
    if isinstance(values, kind):
        return (values,) * count
    several = tuple(values) if isinstance(values, Sequence) else ()
    if len(several) != count or not all(isinstance(item, kind) for item in several):
        raise InputError(name, got=values, expected=f"a {kind.__name__}, or {count} of them")
    return several
