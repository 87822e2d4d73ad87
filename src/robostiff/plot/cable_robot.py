"""Cable robots as lines, faces and marks: at a pose, under a load, and in a mode."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from robostiff.analysis import CableResponse, CableStiffness
from robostiff.plot.geometry.displacement import FiniteMotion
from robostiff.plot.picture import Face, Item, LineWeight, Marks, Path, PlainColour, Shape
from robostiff.plot.sketch import Sketch, dashed
from robostiff.plot.structures import flat_face, is_level, size_of
from robostiff.spatial import Space
from robostiff.statics import BodyPlace

if TYPE_CHECKING:
    from robostiff.statics.equations.problem import EquilibriumProblem


@dataclass(frozen=True)
class CableLines:
    """Where the cables and the platform of a robot are, in the world [m]."""

    names: tuple[str, ...]
    exits: np.ndarray  # (m, 3): where the cables leave the base
    attachments: np.ndarray  # (m, 3): where they hold the platform
    point: np.ndarray  # (3,): the reference point of the platform
    tensions: np.ndarray | None = None  # (m,) [N]; None where they are not known
    slack: np.ndarray | None = None  # (m,): which cables are slack; None for none

    @staticmethod
    def of(result: CableStiffness) -> CableLines:
        """Those of a robot at its pose."""
        placed = result.placed
        known = bool(np.all(result.answered))
        return CableLines(
            tuple(result.cable_names),
            placed.exit_points,
            placed.attachments,
            placed.reference_point,
            result.tensions if known else None,
            result.axial == 0 if known else None,
        )

    @property
    def points(self) -> np.ndarray:
        """Ends of all cables (2 m, 3) [m]."""
        return np.concatenate([self.exits, self.attachments])

    def items(self, factor: float, plain: PlainColour = PlainColour.INK) -> list[Item]:
        """What is drawn of them, in metres times `factor`; slack cables are dashed."""
        items: list[Item] = []
        for points, paint, label in (
            (self.exits, PlainColour.FAINT, ""),
            (self.attachments, PlainColour.PLATE, "platform"),
        ):
            corners = flat_face(points)
            if corners is not None:
                items.append(Face(factor * corners, paint, 0.35, label))
        label = "slack cable"
        for i, name in enumerate(self.names):
            line = factor * np.array([self.exits[i], self.attachments[i]])
            is_slack = self.slack is not None and bool(self.slack[i])
            about = name if self.tensions is None else f"{name}: {self.tensions[i]:.4g} N"
            weight = LineWeight.THIN if is_slack else LineWeight.LINE
            items.append(Path(line, plain, weight, is_slack, label if is_slack else "", about))
            label = "" if is_slack else label
        exits, ends = factor * self.exits, factor * self.attachments
        items.append(Marks(exits, plain, Shape.SQUARE, "winch", self.names))
        items.append(Marks(ends, plain, Shape.RING, "attachment"))
        at = factor * self.point[None]
        items.append(Marks(at, PlainColour.INK, Shape.CROSS, "reference point"))
        return items


@dataclass(frozen=True, kw_only=True)
class CableSketch(Sketch):
    """A cable robot: its cables now, and at rest."""

    lines: CableLines
    rest: CableLines
    space: Space
    plain: PlainColour = PlainColour.INK

    @staticmethod
    def at_pose(result: CableStiffness) -> CableSketch:
        """At a pose, under no load."""
        lines = CableLines.of(result)
        return CableSketch(lines=lines, rest=lines, space=result.space)

    @staticmethod
    def under_load(found: CableResponse) -> CableSketch:
        """With locked winches under a load that its cables carry."""
        lines = CableLines.of(cast("CableStiffness", found.after))
        before = found.before
        return CableSketch(lines=lines, rest=CableLines.of(before), space=before.space)

    @staticmethod
    def moved(problem: EquilibriumProblem, platform: BodyPlace) -> CableSketch:
        """With its platform at another place than before a finite load."""
        springs = problem.groups[0].springs
        ends = np.array([[end.point for end in own.ends] for own in springs])
        names = tuple(own.name for own in springs)
        rest = CableLines(names, ends[:, 0], ends[:, 1], problem.point)
        motion = FiniteMotion.of(platform)
        ends = np.array([p + motion.displacement(p) for p in rest.attachments])
        point = rest.point + motion.displacement(rest.point)
        space = Space.of_size(len(problem.rows))
        return CableSketch(
            lines=replace(rest, attachments=ends, point=point), rest=rest, space=space
        )

    @property
    def size(self) -> float:
        """Length of the robot [m]."""
        return size_of(self.rest.points)

    @property
    def is_level(self) -> bool:
        """Whether it is planar, or all of it lies in one plane z = constant."""
        return self.space is Space.PLANAR or is_level(self.rest.points)

    @property
    def shifts(self) -> np.ndarray:
        """Displacements (m, 3) of the attachments [m]."""
        return self.lines.attachments - self.rest.attachments

    @property
    def drawn(self) -> CableLines:
        """Its cables with exaggerated displacements."""
        return replace(
            self.lines,
            attachments=self.rest.attachments + self.scale * self.shifts,
            point=self.placed(self.rest.point) / self.factor,
        )

    def placed(self, point: np.ndarray) -> np.ndarray:
        """Where its reference point is drawn, given at rest [m]."""
        return self.factor * (point + self.scale * (self.lines.point - self.rest.point))

    def parts(self) -> list[Item]:
        """Cables, winches, platform."""
        return self.drawn.items(self.factor, self.plain)

    def ghost(self, label: str = "without load") -> list[Item]:
        """The cables at rest, in dashed lines."""
        pairs = zip(self.rest.exits, self.rest.attachments, strict=True)
        return dashed((self.factor * np.array(line) for line in pairs), label)
