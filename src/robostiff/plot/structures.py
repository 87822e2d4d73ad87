"""Networks and cable robots as lines, faces and marks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robostiff.analysis import CableStiffness
from robostiff.model import Actuated
from robostiff.network import Network
from robostiff.plot.geometry.surfaces import plate
from robostiff.plot.picture import (
    Face,
    Item,
    LineWeight,
    Marks,
    Paint,
    Path,
    PlainColour,
    Scene,
    Shape,
)
from robostiff.plot.robot_parts import colours_of_parts
from robostiff.spatial import Space

_IN_PLANE = 1e-3  # of the structure
_SAME = 1e-9  # of the structure: closer points are one


def network_scene(network: Network) -> Scene:
    """A network: its beams and springs part by part, its joints, and what ties them together."""
    points = network_points(network)
    factor, unit = _unit(points)
    items = network_items(network, factor, colours_of_parts(beam.name for beam in network.beams))
    is_flat = network.space is Space.PLANAR or _is_level(points)
    return _scene(network.name, items, unit, is_flat)


def network_items(network: Network, factor: float, colours: dict[str, Paint]) -> list[Item]:
    """The items of a network, in metres times `factor`."""
    items: list[Item] = []
    fixed = set(network.fixed)
    for name, body in zip(_names(network), _bodies(network), strict=True):
        outline = _outline(body)
        paint = PlainColour.FAINT if name in fixed else PlainColour.PLATE
        if outline is not None:
            label = "platform" if name == network.platform else ""
            items.append(Face(factor * outline, paint, 0.35, label))
        ink = PlainColour.MUTED if name in fixed else PlainColour.INK
        middle = body.mean(axis=0)
        ends = body if len(body) > 2 else body[:1]
        ties = [np.array([middle if len(body) > 2 else body[-1], end]) for end in ends]
        items += [Path(factor * tie, ink, LineWeight.THIN, about=name) for tie in ties]
    for beam in network.beams:
        line = factor * np.array([beam.start, beam.end])
        paint = colours.get(beam.name, PlainColour.INK)
        items.append(Path(line, paint, LineWeight.BOLD, about=beam.name))
    items += _springs(network, factor) + _joints(network, factor)
    point = factor * network.reference_point[None]
    items.append(Marks(point, PlainColour.INK, Shape.CROSS, "reference point"))
    return items


def _springs(network: Network, factor: float) -> list[Item]:
    own = [spring for spring in network.springs if np.any(spring.elasticity.compliance)]
    if not own:
        return []
    points = factor * np.array([spring.point for spring in own])
    names = tuple(spring.name for spring in own)
    return [Marks(points, PlainColour.INK, Shape.DIAMOND, "elastic part", names)]


def _joints(network: Network, factor: float) -> list[Item]:
    kinds: dict[tuple[str, Shape], list[tuple[np.ndarray, str]]] = {}
    for joint in network.joints:
        for freedom in joint.freedoms:
            driven = isinstance(freedom.role, Actuated)
            kind = ("actuator", Shape.SQUARE) if driven else ("passive joint", Shape.RING)
            if not driven and not freedom.is_passive:
                kind = ("locked joint", Shape.DIAMOND)
            kinds.setdefault(kind, []).append((freedom.point, f"{joint.name}/{freedom.name}"))
    return [
        Marks(
            factor * np.array([point for point, _ in own]),
            PlainColour.INK,
            shape,
            label,
            tuple(name for _, name in own),
        )
        for (label, shape), own in kinds.items()
    ]


def _outline(points: np.ndarray) -> np.ndarray | None:
    """Corners of the face through points in one plane (n, 3); None where they are not."""
    if len(points) < 3:
        return None
    away = points - points.mean(axis=0)
    *_, out = np.linalg.svd(away, compute_uv=False)
    return plate(points) if out <= _IN_PLANE * size_of(points) else None


def _names(network: Network) -> list[str]:
    return [name for name, points in network.connection_points.items() if points]


def _bodies(network: Network) -> list[np.ndarray]:
    """Points of attachment (n, 3) of each body that has some, each point once."""
    bodies = []
    for name, points in network.connection_points.items():
        if not points:
            continue
        own = [*points, *([network.reference_point] if name == network.platform else [])]
        size = float(np.max(np.ptp(np.array(own), axis=0)))
        kept: list[np.ndarray] = []
        for point in own:
            if all(np.linalg.norm(point - other) > _SAME * size for other in kept):
                kept.append(point)
        bodies.append(np.array(kept))
    return bodies


def cable_scene(result: CableStiffness) -> Scene:
    """A cable robot at a pose: its cables, slack ones dashed, and its platform."""
    placed = result.placed
    points = np.concatenate([placed.exit_points, placed.attachments])
    factor, unit = _unit(points)
    return _scene(
        result.name,
        cable_items(result, factor),
        unit,
        result.space is Space.PLANAR or _is_level(points),
    )


def cable_items(
    result: CableStiffness,
    factor: float,
    paint_of: Callable[[int], Paint] = lambda _: PlainColour.INK,
) -> list[Item]:
    """The items of a cable robot, in metres times `factor`; each cable in a paint of its own."""
    placed = result.placed
    items: list[Item] = []
    for points, paint, label in (
        (placed.exit_points, PlainColour.FAINT, ""),
        (placed.attachments, PlainColour.PLATE, "platform"),
    ):
        outline = _outline(points)
        if outline is not None:
            items.append(Face(factor * outline, paint, 0.35, label))
    names = zip(result.cable_names, result.tensions, strict=True)
    for i, (name, tension) in enumerate(names):
        line = factor * np.array([placed.exit_points[i], placed.attachments[i]])
        is_slack = bool(np.all(result.answered)) and result.axial[i] == 0
        about = f"{name}: {tension:.4g} N" if np.all(result.answered) else name
        weight = LineWeight.THIN if is_slack else LineWeight.LINE
        items.append(Path(line, paint_of(i), weight, dashed=is_slack, about=about))
    exits = factor * placed.exit_points
    names_of = tuple(result.cable_names)
    items.append(Marks(exits, PlainColour.INK, Shape.SQUARE, "winch", names_of))
    items.append(Marks(factor * placed.attachments, PlainColour.INK, Shape.RING, "attachment"))
    point = factor * placed.reference_point[None]
    items.append(Marks(point, PlainColour.INK, Shape.CROSS, "reference point"))
    return items


def size_of(points: np.ndarray) -> float:
    """Length of the diagonal of the box around points (n, 3) [m]."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def network_points(network: Network) -> np.ndarray:
    """All points of attachment of a network, and its reference point (n, 3) [m]."""
    return np.concatenate([network.reference_point[None], *_bodies(network)])


def _unit(points: np.ndarray) -> tuple[float, str]:
    return (1.0, "m") if size_of(points) >= 1 else (1e3, "mm")


def _is_level(points: np.ndarray) -> bool:
    return bool(np.ptp(points[:, 2]) <= _SAME * size_of(points))


def _scene(name: str, items: list[Item], unit: str, is_flat: bool) -> Scene:
    x, y, z = (f"{axis} [{unit}]" for axis in "xyz")
    return Scene(name, (x, y, z), tuple(items), is_flat=is_flat)
