"""Cable robots as lines, faces and marks: at a pose, under a load, and in a mode."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from robostiff.analysis import CableResponse, CableStiffness
from robostiff.plot.geometry.displacement import FiniteMotion, spatial
from robostiff.plot.picture import Face, Item, LineWeight, Marks, Path, PlainColour, Scene, Shape
from robostiff.plot.robot_parts import (
    dashed,
    exaggerated,
    finite_factor,
    robot_scene,
    round_factor,
    unit_of,
    wrench_items,
)
from robostiff.plot.structures import flat_face, is_level, size_of
from robostiff.spatial import Space
from robostiff.statics import BodyPlace, Equilibrium

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

    @staticmethod
    def unloaded(problem: EquilibriumProblem) -> CableLines:
        """Those of a robot in cables before a finite load, about the point of its wrench."""
        springs = problem.groups[0].springs
        ends = np.array([[end.point for end in own.ends] for own in springs])
        names = tuple(own.name for own in springs)
        return CableLines(names, ends[:, 0], ends[:, 1], problem.point)

    @property
    def points(self) -> np.ndarray:
        """Ends of all cables (2 m, 3) [m]."""
        return np.concatenate([self.exits, self.attachments])

    def moved(self, displacement: Callable[[np.ndarray], np.ndarray], scale: float) -> CableLines:
        """With the platform displaced, a number of times as far."""
        ends = [p + scale * displacement(p) for p in self.attachments]
        return replace(
            self,
            attachments=np.array(ends),
            point=self.point + scale * displacement(self.point),
        )

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

    def at_rest(self, factor: float, label: str = "without load") -> list[Item]:
        """The cables as dashed lines."""
        pairs = zip(self.exits, self.attachments, strict=True)
        return dashed((factor * np.array(line) for line in pairs), label)


def cable_scene(result: CableStiffness | CableResponse, exaggeration: float | None = None) -> Scene:
    """A cable robot at a pose, slack cables dashed; under a load displaced, with that load."""
    if isinstance(result, CableStiffness):
        lines = CableLines.of(result)
        factor, unit = unit_of(size_of(lines.points))
        is_flat = result.space is Space.PLANAR or is_level(lines.points)
        return robot_scene(result.name, lines.items(factor), unit, is_flat)
    _ = result.tensions  # raises with the reason where the load is not carried
    factor, unit = unit_of(size_of(CableLines.of(result.before).points))
    layers, scale = loaded_cable_layers(result, factor, exaggeration)
    items = [item for layer in layers.values() for item in layer]
    is_flat = result.before.space is Space.PLANAR
    return robot_scene(result.before.name, items, unit, is_flat, notes=exaggerated(scale))


def loaded_cable_layers(
    result: CableResponse, factor: float, exaggeration: float | None
) -> tuple[dict[str, list[Item]], float]:
    """A cable robot that carries a load: its cables before it, those under it, and the load.

    The displacements are drawn larger by the second result.
    """
    before, after = (
        CableLines.of(result.before),
        CableLines.of(cast("CableStiffness", result.after)),
    )
    space = result.before.space
    load = spatial(result.load, space.rows)
    return _layers(before, after, load, space, factor, exaggeration)


def loaded_cables_scene(
    result: Equilibrium, exaggeration: float | None, notes: tuple[str, ...]
) -> Scene:
    """A cable robot in its equilibrium under finite loads, beside the unloaded one."""
    before = CableLines.unloaded(cast("EquilibriumProblem", result.problem))
    after = before.moved(_displacement(result.places.platform), 1.0)
    tensions = np.array([own.tension for own in result.springs])
    after = replace(after, tensions=tensions, slack=tensions == 0)
    factor, unit = unit_of(size_of(before.points))
    load = spatial(result.wrench, result.space.rows)
    layers, scale = _layers(before, after, load, result.space, factor, exaggeration, finite_factor)
    items = [item for layer in layers.values() for item in layer]
    is_flat = result.space is Space.PLANAR
    notes = (*exaggerated(scale), *notes)
    return robot_scene(f"{result.name} under load", items, unit, is_flat, notes=notes)


def swinging_cables(
    title: str, problem: EquilibriumProblem, motion: BodyPlace, side: float
) -> tuple[Scene, float]:
    """A cable robot at one end of a vibration, and its size as drawn."""
    rest = CableLines.unloaded(problem)
    size = size_of(rest.points)
    factor, unit = unit_of(size)
    displacement = _displacement(motion)
    shifts = np.array([displacement(p) for p in rest.attachments])
    drawn = rest.moved(displacement, side * round_factor(shifts, size))
    items = [*rest.at_rest(factor, "at rest"), *drawn.items(factor)]
    is_flat = len(problem.rows) == Space.PLANAR.size
    return robot_scene(title, items, unit, is_flat), factor * size


def _displacement(place: BodyPlace) -> Callable[[np.ndarray], np.ndarray]:
    return FiniteMotion.of(place).displacement


def _layers(
    before: CableLines,
    after: CableLines,
    load: np.ndarray,
    space: Space,
    factor: float,
    exaggeration: float | None,
    factor_of: Callable[[float], float] = float,
) -> tuple[dict[str, list[Item]], float]:
    size, moved = size_of(before.points), after.attachments - before.attachments
    scale = factor_of(round_factor(moved, size)) if exaggeration is None else exaggeration
    drawn = replace(
        after,
        attachments=before.attachments + scale * moved,
        point=before.point + scale * (after.point - before.point),
    )
    at, is_flat = factor * drawn.point, space is Space.PLANAR
    layers = {
        "shape without load": before.at_rest(factor),
        "robot": drawn.items(factor),
        "load": wrench_items(at, factor * size, load, is_flat),
    }
    return layers, float(scale)
