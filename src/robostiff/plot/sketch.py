"""A machine of any kind as it is drawn: placed at a pose, at rest or with its bodies displaced."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, cast

import numpy as np

from robostiff.analysis import CableStiffness, stiffness
from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import field, frozen, replace
from robostiff.kinematics import Near
from robostiff.linkage import Linkage
from robostiff.markup import percent, quantity, short
from robostiff.model import Actuated, Locked, Passive, Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.plot.displacement import STILL, BodyMotion, Motions
from robostiff.plot.outline import JointPoint, Line, Outline, PointOfBody, outline_of
from robostiff.plot.picture import (
    Arrow,
    Category,
    ColourScale,
    Face,
    Item,
    LineWeight,
    Marks,
    Paint,
    Path,
    PlainColour,
    Scene,
    Shape,
    Text,
)
from robostiff.plot.surfaces import AnyStiffness, screw_line
from robostiff.spatial import Screw

_ARROW = 0.2  # of the robot
_ROUNDING = 1e-12  # of the robot
_IN_PLANE = 1e-9  # of the largest displacement, or of the unit of a wrench
_SEEN = 0.1  # of the robot: the largest displacement drawn with the default exaggeration
_APART = 1e-9  # of the robot: closer points are one
_BENDS = 17  # points along a bent part
_ONE_PLACE = 0.08  # of the robot: names nearer than that would overlap
_NUMBER = re.compile(r"\[\d+\]$")


@frozen(kw_only=True)
class Sketch:
    """A machine of any kind as it is drawn: at rest, or beside that with its bodies displaced."""

    outline: Outline
    motions: Motions = field(default_factory=dict)  # those of bodies that are not there are none
    # parts of the elastic energy [%], by leg and part, or by leg and an empty name
    shares: Mapping[tuple[str, str], float] = field(default_factory=dict)
    colours: Mapping[str, Paint] = field(default_factory=dict)  # of parts without a share
    of_joints: Mapping[str, Paint] = field(default_factory=dict)
    plain: PlainColour = PlainColour.INK  # of parts without a colour
    scale: float = 0.0  # of the displacements; 0 at rest

    @property
    def size(self) -> float:
        """Length of the machine [m]."""
        return self.outline.size

    @property
    def shifts(self) -> np.ndarray:
        """Displacements (n, 3) of its points, before they are exaggerated [m]."""
        return np.array([self._body(at).displacement(at.point) for at in self.outline.anchors])

    def _body(self, at: PointOfBody) -> BodyMotion:
        return self.motions.get(at.body, STILL)

    def moved(self, at: PointOfBody) -> np.ndarray:
        """Where a point is drawn (3,) [m]."""
        shift = self.scale * self._body(at).displacement(at.point) if self.scale else 0.0
        return at.point + shift

    def _lines(self) -> Iterator[tuple[Line, np.ndarray]]:
        """Lines that can be seen, and their points (n, 3) [m]."""
        for line in self.outline.lines:
            a, b = line.start, line.end
            points = np.array([self.moved(a), self.moved(b)])
            if line.bends and self.scale and np.linalg.norm(b.point - a.point) > _APART * self.size:
                ends = (a.point, b.point, self._body(a), self._body(b))
                points = bent_line(*ends, self.scale)
            if np.linalg.norm(points[-1] - points[0]) > _APART * self.size:
                yield line, points

    def parts(self) -> list[Item]:
        """Base, platform, legs or cables, and joints."""
        items: list[Item] = []
        for face in self.outline.plates:
            corners = np.array([self.moved(PointOfBody(p, face.body)) for p in face.corners])
            items.append(Face(corners, face.paint, 0.35, face.label))
        unlisted = dict(self.colours) if self.outline.has_legend else {}
        for line, points in self._lines():
            paint, about = self.paint(line.leg, line.part)
            label = line.part if unlisted.pop(line.part, None) is not None else line.label
            about, paint = line.about or about, line.paint or paint
            items.append(Path(points, paint, line.weight, line.is_dashed, label, about))
        for spots in self.outline.spots:
            points = np.array([self.moved(at) for at in spots.at])
            paint, about = self.paint("", spots.part)
            names = (about,) if spots.part else spots.names
            items.append(Marks(points, paint, spots.shape, spots.label, names))
        for kind, (label, shape) in _KINDS.items():
            alike = [joint for joint in self.outline.joints if isinstance(joint.role, kind)]
            by_paint: dict[Paint, list[JointPoint]] = {}
            for joint in alike:
                paint = self.of_joints.get(joint.name, PlainColour.INK)
                by_paint.setdefault(paint, []).append(joint)
            for paint, group in by_paint.items():
                points = np.array([self.moved(joint.at) for joint in group])
                names = tuple(f"{joint.owner}/{joint.name}" for joint in group)
                items.append(Marks(points, paint, shape, label, names))
            for joint in alike:
                share = self.shares.get((joint.owner, joint.name))
                if share is not None:
                    about = f"{joint.owner}/{joint.name}: {percent(share / 100, 1)}"
                    point = self.moved(joint.at)[None]
                    items.append(Marks(point, share, shape, about=(about,)))
        at = self.moved(self.outline.point)[None]
        return [*items, Marks(at, PlainColour.INK, Shape.CROSS, "reference point")]

    def paint(self, leg: str, part: str) -> tuple[Paint, str]:
        """The colour of a part, and its description."""
        share = self.shares.get((leg, part), self.shares.get((leg, "")))
        about = "/".join(filter(None, (leg, part)))
        if share is None:
            return self.colours.get(part, self.plain), about
        return share, f"{about}: {percent(share / 100, 1)}"

    def ghost(self, label: str = "without load") -> list[Item]:
        """Its lines at rest, dashed."""
        at_rest = replace(self, scale=0.0)._lines()
        lines = [points for line, points in at_rest if line.has_ghost]
        return [
            Path(line, PlainColour.MUTED, LineWeight.THIN, True, "" if i else label)
            for i, line in enumerate(lines)
        ]

    def backdrop(self) -> list[Item]:
        """Faces and lines in one colour, behind something else."""
        muted = PlainColour.MUTED
        items: list[Item] = []
        for face in self.outline.plates:
            paint = face.paint if face.paint is PlainColour.FAINT else muted
            items.append(Face(face.corners, paint, 0.35))
        for line, points in self._lines():
            weight = min(line.weight, LineWeight.LINE, key=lambda w: w.value)
            items.append(Path(points, muted, weight, line.is_dashed))
        return items

    def names(self) -> list[Item]:
        """Names beside its joints, those of one point in one line.

        A joint of several freedoms is named once, and joints of the branches of a block by the
        first.
        """
        words: list[tuple[np.ndarray, list[str]]] = []
        named: set[str] = set()
        for at, name in self.outline.words:
            place, label = self.moved(at), _NUMBER.sub("", name.rpartition("/")[2])
            if label in named:
                continue
            named.add(label)
            for point, names in words:
                if np.linalg.norm(point - place) <= _ONE_PLACE * self.size:
                    names.append(label)
                    break
            else:
                words.append((place, [label]))
        return [Text(point, ", ".join(names), PlainColour.INK) for point, names in words]

    def exaggerated(self, factor: float | None, *, is_finite: bool = False) -> Sketch:
        """With displacements times a factor; by default a round one that makes them visible.

        Finite displacements are then drawn at least as large as they are.
        """
        if factor is None:
            factor = round_factor(self.shifts, self.size)
            if is_finite:  # below a part of the robot they are rounding, and not drawn
                factor = max(factor, 1.0) if 0 < factor < _SEEN / _ROUNDING else 0.0
        if not np.isfinite(factor):
            raise InputError("exaggeration of a plot", got=factor, expected="a finite number")
        return replace(self, scale=float(factor))

    def is_flat(self, F: np.ndarray) -> bool:
        """Whether neither a part nor a wrench (6,) on it leaves the x-y plane."""
        if not self.outline.is_level or np.any(np.abs(F[2:5]) > _IN_PLANE):
            return False
        moved = np.abs(self.shifts)
        return bool(moved[:, 2].max(initial=0.0) <= _IN_PLANE * moved.max(initial=0.0))

    def load(self, point: np.ndarray, F: np.ndarray, is_flat: bool = False) -> list[Item]:
        """Arrows of a wrench (6,) at a point (3,) of the platform [m].

        The force points to the point, the moment away from it; from above it turns around it.
        """
        at, length = self.moved(PointOfBody(point, self.outline.point.body)), _ARROW * self.size
        items: list[Item] = []
        for name, unit, paint, vector in (
            ("force", "N", Category(1), F[:3]),
            ("moment", "N m", Category(4), F[3:]),
        ):
            size = float(np.linalg.norm(vector))
            label, arrow = f"{name} {quantity(size, unit)}", length * vector / (size or 1.0)
            if size > 0 and name == "force":
                items.append(Arrow(at - arrow, at, paint, label))
            elif size > 0 and is_flat:
                _, way = screw_line(Screw(vector / size, at, 0.0), at, 0.6 * length)
                items += turning_arrow(way, paint, label)
            elif size > 0:
                items.append(Arrow(at, at + arrow, paint, label))
        return items

    def scene(
        self,
        title: str,
        load: tuple[np.ndarray, np.ndarray] | None = None,
        *,
        is_named: bool | None = None,
        notes: tuple[str, ...] = (),
        at_rest: str = "without load",
        more: Sequence[Item] = (),
    ) -> Scene:
        """The picture, in the unit that suits the size; a load is a point and a wrench (6,).

        Joints are named where the outline says so, or as given.
        """
        is_flat = self.is_flat(np.zeros(6) if load is None else load[1])
        items = self.ghost(at_rest) if self.scale else []
        items += self.parts()
        named = self.outline.is_named if is_named is None else is_named
        items += self.names() if named else []
        items += [] if load is None else self.load(*load, is_flat)
        top = max(self.shares.values(), default=0.0)
        scale = ColourScale("share of elastic energy [%]", 0, top) if top else None
        return robot_scene(title, [*items, *more], unit_of(self.size), is_flat, scale, notes)


_KINDS = {
    Passive: ("passive joint", Shape.RING),
    Actuated: ("actuator", Shape.SQUARE),
    Locked: ("locked joint", Shape.DIAMOND),
}
"""Names in the legend, and marks, of joints."""


def bent_line(
    start: np.ndarray, end: np.ndarray, first: BodyMotion, last: BodyMotion, scale: float
) -> np.ndarray:
    """Line of a beam (n, 3) from start to end (3,) [m], which move with two bodies, exaggerated.

    Across the beam the cubic with the displacements and slopes of its ends, along it a straight
    line: exact for a uniform Euler-Bernoulli beam that is loaded at its ends.
    """
    along = end - start
    s = np.linspace(0.0, 1.0, _BENDS)[:, None]
    u_0, u_1 = first.displacement(start), last.displacement(end)
    slope_0, slope_1 = first.D @ along, last.D @ along
    cubic = (1 - 3 * s**2 + 2 * s**3) * u_0 + (3 * s**2 - 2 * s**3) * u_1
    cubic = cubic + (s - 2 * s**2 + s**3) * slope_0 + (s**3 - s**2) * slope_1
    e = along / np.linalg.norm(along)
    straight = (1 - s) * (u_0 @ e) + s * (u_1 @ e)
    u = cubic - (cubic @ e)[:, None] * e + straight * e
    return start + s * along + scale * u


def unit_of(size: float) -> tuple[float, str]:
    """From metres to the unit in which a robot is drawn: m, or mm for one below one metre."""
    return (1.0, "m") if size >= 1 else (1e3, "mm")


def round_factor(displacements: np.ndarray, size: float) -> float:
    """How far displacements (n, 3) are exaggerated: 1, 2 or 5 times a power of ten; 0 for none.

    The largest is then drawn as a tenth of the robot, or less.
    """
    largest = float(np.linalg.norm(displacements, axis=-1).max(initial=0.0))
    if largest == 0:
        return 0.0
    wanted = _SEEN * size / largest
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * power for step in (1, 2, 5) if step * power <= wanted * (1 + 1e-9)))


def exaggeration_note(scale: float) -> tuple[str, ...]:
    """A note about the factor of displacements, where they are drawn larger."""
    return (f"displacements × {short(scale, 6)}",) if scale not in {0.0, 1.0} else ()


def robot_scene(
    name: str,
    items: Sequence[Item],
    unit: tuple[float, str],
    is_flat: bool,
    scale: ColourScale | None = None,
    notes: tuple[str, ...] = (),
) -> Scene:
    """A scene of items [m], whose axes have another unit: a factor, and its name."""
    factor, called = unit
    x, y, z = (f"{axis} [{called}]" for axis in "xyz")
    shown = []
    for item in items:
        arrays = {n: array for n, array in vars(item).items() if isinstance(array, np.ndarray)}
        points = {n: factor * array for n, array in arrays.items() if n != "triangles"}
        shown.append(replace(item, **points))
    return Scene(name, (x, y, z), tuple(shown), scale, is_flat, notes=notes)


def colours_of_parts(names: Iterable[str]) -> dict[str, Paint]:
    """A colour for each name of a part, the same for parts of one name in several legs."""
    return {name: Category(i) for i, name in enumerate(dict.fromkeys(names))}


def turning_arrow(points: np.ndarray, paint: Paint, label: str) -> list[Item]:
    """The way, points (n, 3), of a point around an axis, with an arrow head."""
    line = Path(points[:-4], paint, LineWeight.LINE, label=label, about=label)
    return [line, Arrow(points[-5], points[-1], paint)]


Posed = Snapshot | Network | CableStiffness
Machine = Robot | Snapshot | Network | Linkage | CableRobot | CableStiffness


def machine_at(machine: Machine, pose: Any = None, near: Near = None) -> Posed:
    """A machine at a single pose, in the posture nearest to some joint coordinates.

    Raises InputError when it is no machine, or the pose does not fit it, NoAnswerError when the
    pose is out of reach.
    """
    if isinstance(machine, CableStiffness):
        return machine
    if not isinstance(machine, Machine):
        expected = "a Robot, Snapshot, Network, Linkage or CableRobot"
        hint = 'write rs.load("hexapod")'
        raise InputError("robot of a plot", got=machine, expected=expected, hint=hint)
    result: Any = stiffness(cast("Robot", machine), pose, near=near)
    if result.batch_shape:
        got = Words(f"poses of shape {result.batch_shape}")
        raise InputError("pose of a plot", got=got, expected="a single pose")
    if isinstance(result, CableStiffness):
        return result
    if Status.UNREACHABLE in result.status:
        raise NoAnswerError(f"no picture of {machine.name!r}: {'; '.join(result.advice)}")
    return result.placed()


def surroundings(machine: Machine | None, result: AnyStiffness) -> Sketch | None:
    """The robot around a result, at its pose; of cables always.

    Raises InputError when it is none that can be drawn at the pose of the result.
    """
    if machine is None and not isinstance(result, CableStiffness):
        return None
    if machine is None or machine.name == result.name:
        posed = result if isinstance(result, CableStiffness) else result.placed()
    else:
        posed = machine_at(machine, result.pose)
    return Sketch(outline=outline_of(posed))


def single_stiffness(result: object, what: str) -> AnyStiffness:
    """The stiffness at one pose; other values and several poses are an `InputError`."""
    if not isinstance(result, AnyStiffness):
        raise InputError(
            f"stiffness for {what}", got=result, expected="a result of rs.stiffness(robot, pose)"
        )
    if result.batch_shape:
        got = Words(f"poses of shape {result.batch_shape}")
        hint = "write result[0]"
        raise InputError(f"stiffness for {what}", got=got, expected="a single pose", hint=hint)
    return result
