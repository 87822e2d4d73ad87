"""Networks as lines, faces and marks, at rest and under a load."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from robostiff.analysis import Deflection, PartShare
from robostiff.kept import kept
from robostiff.network import Network
from robostiff.plot.geometry.displacement import BodyMotion, network_motion, spatial
from robostiff.plot.geometry.legs import bent_line, clamped_end
from robostiff.plot.geometry.surfaces import plate
from robostiff.plot.picture import (
    Category,
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
from robostiff.plot.robot_parts import (
    colours_of_parts,
    dashed,
    energy_scale,
    exaggerated,
    joint_kind,
    robot_scene,
    round_factor,
    unit_of,
    words_at,
    wrench_items,
)
from robostiff.spatial import Space

_IN_PLANE = 1e-3  # of the structure
_SAME = 1e-9  # of the structure: closer points are one
_SEEN = 1e-3  # of the structure: a line
_COLOURS = 8  # that differ
_NAMED = 24  # joints: more names would cover the picture


@dataclass(frozen=True)
class NetworkDrawing:
    """How a network is drawn."""

    network: Network
    factor: float  # from metres to the unit of the axes
    # of beams, by name; a number is a share of the elastic energy [%]
    colours: Mapping[str, Paint] = field(default_factory=dict)
    plain: PlainColour = PlainColour.INK  # of beams without a colour
    ink: PlainColour = PlainColour.INK  # of all else
    # of the bodies; at rest when left out
    motions: Mapping[str, BodyMotion] = field(default_factory=dict)
    scale: float = 0.0  # of the displacements

    def moved(self, body: str, points: np.ndarray) -> np.ndarray:
        """Points (n, 3) of a body where they are drawn, in the unit of the axes."""
        if not self.scale:
            return self.factor * points
        motion = self.motions[body]
        return self.factor * np.array([p + self.scale * motion.displacement(p) for p in points])

    def line(self, start: np.ndarray, end: np.ndarray, a: str, b: str) -> np.ndarray:
        """Line (n, 3) of a beam between two bodies, bent as they move."""
        if not self.scale:
            return self.factor * np.array([start, end])
        return self.factor * bent_line(start, end, self.motions[a], self.motions[b], self.scale)


def network_scene(
    network: Network,
    bent: Deflection | None = None,
    exaggeration: float | None = None,
    notes: tuple[str, ...] = (),
) -> Scene:
    """A network, coloured part by part; under a load deformed and coloured by elastic energy."""
    points = network_points(network)
    factor, unit = unit_of(size_of(points))
    is_flat = network.space is Space.PLANAR or is_level(points)
    if bent is None:
        colours = colours_of_network(network)
        drawn = NetworkDrawing(network, factor, colours)
        items = [*network_items(drawn), *network_joint_names(drawn)]
        return robot_scene(network.name, items, unit, is_flat, notes=notes)
    motions, scale = displaced_network(network, bent, exaggeration)
    moved = motions[network.platform].displacement(bent.stiffness.reference_point)
    is_flat = is_flat and abs(moved[2]) <= _SAME * float(np.linalg.norm(moved))
    is_flat = is_flat and (network.space is Space.PLANAR or not np.any(bent.wrench[[2, 3, 4]]))
    shares = energies_by_name(bent.parts)
    drawn = NetworkDrawing(network, factor, shares, PlainColour.MUTED, motions=motions, scale=scale)
    items = [*network_ghost(NetworkDrawing(network, factor)), *network_items(drawn)]
    items += network_joint_names(drawn)
    F = spatial(bent.wrench, network.space.rows)
    items += network_load(drawn, bent.stiffness.reference_point, F, is_flat)
    known = energy_scale(100 * part.share for part in bent.parts)
    return robot_scene(network.name, items, unit, is_flat, known, (*notes, *exaggerated(scale)))


def colours_of_network(network: Network) -> dict[str, Paint]:
    """A colour for each beam and elastic part."""
    elastic = [own for own in network.springs if np.any(own.elasticity.compliance)]
    return colours_of_parts(part.name for part in (*network.beams, *elastic))


def network_load(
    d: NetworkDrawing, point: np.ndarray, F: np.ndarray, is_flat: bool = False
) -> list[Item]:
    """Arrows of a wrench (6,) at a point (3,) of the displaced platform."""
    (moved,) = d.moved(d.network.platform, point[None])
    return wrench_items(moved, d.factor * size_of(network_points(d.network)), F, is_flat)


def displaced_network(
    network: Network, bent: Deflection, exaggeration: float | None
) -> tuple[dict[str, BodyMotion], float]:
    """Motions of the bodies of a network under a load, and the factor of their displacements."""
    motions = network_motion(network, bent)
    scale = network_factor(network, motions)
    return motions, scale if exaggeration is None else float(exaggeration)


def network_factor(network: Network, motions: Mapping[str, BodyMotion]) -> float:
    """How far displacements of the bodies of a network are exaggerated, by `round_factor`."""
    far = [motions[own].displacement(p) for own, at in _bodies(network).items() for p in at]
    return round_factor(np.array(far), size_of(network_points(network)))


def energies_by_name(parts: Iterable[PartShare]) -> dict[str, Paint]:
    """Shares of the elastic energy [%] by the whole names of the parts of a network."""
    shares: dict[str, Paint] = {}
    for part in parts:
        for name in (f"{part.leg}/{part.part}", part.part):
            shares.setdefault(name, 100 * part.share)
    return shares


def network_items(d: NetworkDrawing) -> list[Item]:
    """Bodies, beams, springs and joints."""
    network = d.network
    items: list[Item] = []
    fixed = set(network.fixed)
    for name, body in _bodies(network).items():
        paint = PlainColour.FAINT if name in fixed else PlainColour.PLATE
        corners = flat_face(body)
        if corners is not None:
            label = "platform" if name == network.platform else ""
            items.append(Face(d.moved(name, corners), paint, 0.35, label))
        ink = PlainColour.MUTED if name in fixed else d.ink
        items += [Path(tie, ink, LineWeight.THIN, about=name) for tie in _ties(d, name, body)]
    for beam in network.beams:
        line = d.line(beam.start, beam.end, beam.a, beam.b)
        paint = d.colours.get(beam.name, d.plain)
        items.append(_part(line, beam.name, paint, d))
    items += _springs(d) + _joints(d)
    point = d.moved(network.platform, network.reference_point[None])
    items.append(Marks(point, PlainColour.INK, Shape.CROSS, "reference point"))
    return items


def network_ghost(d: NetworkDrawing, label: str = "without load") -> list[Item]:
    """Beams and bodies without load, in dashed lines."""
    lines = [d.line(beam.start, beam.end, beam.a, beam.b) for beam in d.network.beams]
    for name, body in _bodies(d.network).items():
        if name not in d.network.fixed:
            lines += _ties(d, name, body)
    return dashed(lines, label)


def _ties(d: NetworkDrawing, name: str, body: np.ndarray) -> list[np.ndarray]:
    """Lines from the points of a body to its middle; of two points, from one to the other."""
    middle = body.mean(axis=0) if len(body) > 2 else body[-1]
    ends = body if len(body) > 2 else body[:-1]
    return [d.moved(name, np.array([middle, end])) for end in ends]


def _part(line: np.ndarray, name: str, paint: Paint, d: NetworkDrawing) -> Path:
    """A beam or an elastic part, named in the legend where its colour is its own."""
    label = name if isinstance(paint, Category) and len(d.colours) <= _COLOURS else ""
    about = name + (f": {paint:.1f} %" if isinstance(paint, float) else "")
    return Path(line, paint, LineWeight.BOLD, label=label, about=about)


def _springs(d: NetworkDrawing) -> list[Item]:
    """Elastic parts: a line along one that has a length, a mark where it has none."""
    items: list[Item] = []
    label = "elastic part"
    size = size_of(network_points(d.network))
    for spring in d.network.springs:
        if not np.any(spring.elasticity.compliance):
            continue
        paint = d.colours.get(spring.name, d.plain)
        start = clamped_end(spring)
        if np.linalg.norm(start - spring.point) > _SEEN * size:
            line = d.line(start, spring.point, spring.a, spring.b)
            items.append(_part(line, spring.name, paint, d))
            continue
        about = spring.name + (f": {paint:.1f} %" if isinstance(paint, float) else "")
        at = d.moved(spring.b, spring.point[None])
        items.append(Marks(at, paint, Shape.DIAMOND, label, (about,)))
        label = ""
    return items


def _joints(d: NetworkDrawing) -> list[Item]:
    kinds: dict[tuple[str, Shape], list[tuple[np.ndarray, str]]] = {}
    for joint in d.network.joints:
        for freedom in joint.freedoms:
            (at,) = d.moved(joint.a, freedom.point[None])
            kinds.setdefault(joint_kind(freedom.role), []).append(
                (at, f"{joint.name}/{freedom.name}")
            )
    return [
        Marks(np.array([p for p, _ in own]), d.ink, shape, label, tuple(name for _, name in own))
        for (label, shape), own in kinds.items()
    ]


def network_joint_names(d: NetworkDrawing) -> list[Item]:
    """Names beside the joints, where there are not too many."""
    placed = [(own.name, own.a, own.freedoms[0].point) for own in d.network.joints if own.freedoms]
    if len(placed) > _NAMED:
        return []
    places = [(d.moved(body, p[None])[0], name) for name, body, p in placed]
    return words_at(places, d.factor * size_of(network_points(d.network)))


def flat_face(points: np.ndarray) -> np.ndarray | None:
    """Corners of the face through points in one plane (n, 3); None where they are not."""
    if len(points) < 3:
        return None
    away = points - points.mean(axis=0)
    *_, out = np.linalg.svd(away, compute_uv=False)
    return plate(points) if out <= _IN_PLANE * size_of(points) else None


@kept
def _bodies(network: Network) -> dict[str, np.ndarray]:
    """Points of attachment (n, 3) of each body that has some, each point once."""
    bodies = {}
    for name, points in network.connection_points.items():
        if not points:
            continue
        own = [*points, *([network.reference_point] if name == network.platform else [])]
        size = float(np.max(np.ptp(np.array(own), axis=0)))
        apart: list[np.ndarray] = []
        for point in own:
            if all(np.linalg.norm(point - other) > _SAME * size for other in apart):
                apart.append(point)
        bodies[name] = np.array(apart)
    return bodies


def size_of(points: np.ndarray) -> float:
    """Length of the diagonal of the box around points (n, 3) [m]."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def network_points(network: Network) -> np.ndarray:
    """All points of attachment of a network, and its reference point (n, 3) [m]."""
    return np.concatenate([network.reference_point[None], *_bodies(network).values()])


def is_level(points: np.ndarray) -> bool:
    """Whether points (n, 3) lie in one plane z = constant."""
    return bool(np.ptp(points[:, 2]) <= _SAME * size_of(points))
