"""A machine of any kind as it is drawn: at rest, or beside that with its bodies displaced."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from robostiff.errors import InputError
from robostiff.plot.geometry.ellipsoid import screw_line
from robostiff.plot.picture import (
    Arrow,
    Category,
    ColourScale,
    Item,
    LineWeight,
    Paint,
    Path,
    PlainColour,
    Scene,
)
from robostiff.plot.prefix import prefixed, short
from robostiff.spatial import Screw

_ARROW = 0.2  # of the robot
_ROUNDING = 1e-12  # of the robot
_IN_PLANE = 1e-9  # of the largest displacement, or of the unit of a wrench
_SEEN = 0.1  # of the robot: the largest displacement drawn with the default exaggeration

_Own = TypeVar("_Own", bound="Sketch")


@dataclass(frozen=True, kw_only=True)
class Sketch(ABC):
    """What is drawn of a machine; each kind says what its parts are, and how far they move."""

    factor: float = 1.0  # from metres to the unit of the axes
    scale: float = 0.0  # of the displacements; 0 at rest

    @property
    @abstractmethod
    def size(self) -> float:
        """Length of the machine [m]."""

    @property
    @abstractmethod
    def is_level(self) -> bool:
        """Whether all of it lies in one plane z = constant at rest."""

    @property
    @abstractmethod
    def shifts(self) -> np.ndarray:
        """Displacements (n, 3) of its points, before they are exaggerated [m]."""

    @property
    def values(self) -> Iterable[float]:
        """Numbers that its colours are, shares of the elastic energy [%]."""
        return ()

    @abstractmethod
    def placed(self, point: np.ndarray) -> np.ndarray:
        """Where a point (3,) of the platform [m] is drawn."""

    @abstractmethod
    def parts(self) -> list[Item]:
        """Base, platform, legs or cables, joints."""

    @abstractmethod
    def ghost(self, label: str = "without load") -> list[Item]:
        """Its lines at rest, dashed."""

    def names(self) -> list[Item]:
        """Names beside its joints."""
        return []

    def exaggerated(self: _Own, factor: float | None, *, is_finite: bool = False) -> _Own:
        """With displacements times a factor; by default a round one that makes them visible.

        Finite displacements are then drawn at least as large as they are.
        """
        if factor is None:
            factor = round_factor(self.shifts, self.size)
            factor = finite_factor(factor) if is_finite else factor
        if not np.isfinite(factor):
            raise InputError("exaggeration of a plot", got=factor, expected="a finite number")
        return replace(self, scale=float(factor))

    def in_unit(self: _Own) -> _Own:
        """In the unit of axes that suits its size."""
        return replace(self, factor=unit_of(self.size)[0])

    def is_flat(self, F: np.ndarray) -> bool:
        """Whether neither a part nor a wrench (6,) on it leaves the x-y plane."""
        if not self.is_level or np.any(np.abs(F[2:5]) > _IN_PLANE):
            return False
        moved = np.abs(self.shifts)
        return bool(moved[:, 2].max(initial=0.0) <= _IN_PLANE * moved.max(initial=0.0))

    def load(self, point: np.ndarray, F: np.ndarray, is_flat: bool = False) -> list[Item]:
        """Arrows of a wrench (6,) at a point (3,) of the platform [m].

        The force points to the point, the moment away from it; from above it turns around it.
        """
        return wrench_items(self.placed(point), self.factor * self.size, F, is_flat)

    def scene(
        self,
        title: str,
        load: tuple[np.ndarray, np.ndarray] | None = None,
        *,
        is_named: bool = False,
        notes: tuple[str, ...] = (),
        at_rest: str = "without load",
        more: Sequence[Item] = (),
    ) -> Scene:
        """The picture, in the unit that suits the size; a load is a point and a wrench (6,)."""
        drawn = self.in_unit()
        F = np.zeros(6) if load is None else load[1]
        is_flat = drawn.is_flat(F)
        items = drawn.ghost(at_rest) if drawn.scale else []
        items += drawn.parts()
        items += drawn.names() if is_named else []
        items += [] if load is None else drawn.load(*load, is_flat)
        top = max(drawn.values, default=0.0)
        scale = ColourScale("share of elastic energy [%]", 0, top) if top else None
        unit = unit_of(self.size)[1]
        return robot_scene(title, [*items, *more], unit, is_flat, scale, notes)


def unit_of(size: float) -> tuple[float, str]:
    """From metres to the unit in which a robot is drawn: m, or mm for one below one metre."""
    return (1.0, "m") if size >= 1 else (1e3, "mm")


def round_factor(displacements: np.ndarray, size: float) -> float:
    """How far displacements (n, 3) are exaggerated: 1, 2 or 5 times a power of ten; 0 for none.

    The largest is then drawn as a tenth of the robot, or less.

    Examples
    --------
    >>> round_factor(np.array([[0.0, 3e-5, 4e-5]]), 1.2)
    2000.0
    """
    largest = float(np.linalg.norm(displacements, axis=-1).max(initial=0.0))
    if largest == 0:
        return 0.0
    wanted = _SEEN * size / largest
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * power for step in (1, 2, 5) if step * power <= wanted * (1 + 1e-9)))


def finite_factor(factor: float) -> float:
    """How far displacements under finite loads are exaggerated, from what `round_factor` has.

    They are drawn at least as large as they are. Below a 1e-12 of the robot they are rounding of
    places, and not drawn.

    Examples
    --------
    >>> finite_factor(0.5), finite_factor(2000.0), finite_factor(2e15)
    (1.0, 2000.0, 0.0)
    """
    return max(factor, 1.0) if 0 < factor < _SEEN / _ROUNDING else 0.0


def exaggeration_note(scale: float) -> tuple[str, ...]:
    """A note about the factor of displacements, where they are drawn larger."""
    return (f"displacements × {short(scale, 6)}",) if scale not in {0.0, 1.0} else ()


def robot_scene(
    name: str,
    items: Sequence[Item],
    unit: str,
    is_flat: bool,
    scale: ColourScale | None = None,
    notes: tuple[str, ...] = (),
) -> Scene:
    """A scene of a robot, its axes in `unit`."""
    x, y, z = (f"{axis} [{unit}]" for axis in "xyz")
    return Scene(name, (x, y, z), tuple(items), scale, is_flat, notes=notes)


def colours_of_parts(names: Iterable[str]) -> dict[str, Paint]:
    """A colour for each name of a part, the same for parts of one name in several legs."""
    return {name: Category(i) for i, name in enumerate(dict.fromkeys(names))}


def dashed(lines: Iterable[np.ndarray], label: str) -> list[Item]:
    """Thin dashed lines, the first of which is named in the legend."""
    return [
        Path(line, PlainColour.MUTED, LineWeight.THIN, True, "" if i else label)
        for i, line in enumerate(lines)
    ]


def wrench_items(point: np.ndarray, size: float, F: np.ndarray, is_flat: bool) -> list[Item]:
    """Arrows of a wrench (6,) at a point (3,) of a robot of some size, both as drawn."""
    length = _ARROW * size
    items: list[Item] = []
    for name, unit, row, vector in (
        ("force", "N", 1, F[:3]),
        ("moment", "N m", 4, F[3:]),
    ):
        size = float(np.linalg.norm(vector))
        if size > 0:
            times, shown = prefixed(size, unit)
            label = f"{name} {short(times * size)} {shown}"
            arrow = length * vector / size
            if name == "force":
                items.append(Arrow(point - arrow, point, Category(row), label))
            elif is_flat:
                screw = Screw(vector / size, point, 0.0)
                items += turning_arrow(
                    screw_line(screw, point, 0.6 * length).way, Category(row), label
                )
            else:
                items.append(Arrow(point, point + arrow, Category(row), label))
    return items


def turning_arrow(way: np.ndarray, paint: Paint, label: str) -> list[Item]:
    """The way (n, 3) of a point around an axis, with an arrow head."""
    line = Path(way[:-4], paint, LineWeight.LINE, label=label, about=label)
    return [line, Arrow(way[-5], way[-1], paint)]
