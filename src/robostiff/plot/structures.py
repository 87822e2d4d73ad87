"""Networks as lines, faces and marks, at rest and under a load."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from robostiff.analysis import PartShare
from robostiff.kept import kept
from robostiff.network import Network
from robostiff.plot.geometry.displacement import BodyMotion, FiniteMotion
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
    Shape,
)
from robostiff.plot.robot_parts import joint_kind, words_at
from robostiff.plot.sketch import Sketch, colours_of_parts, dashed
from robostiff.spatial import Space
from robostiff.statics import BodyPlace, BodyPlaces

_IN_PLANE = 1e-3  # of the structure
_SAME = 1e-9  # of the structure: closer points are one
_SEEN = 1e-3  # of the structure: a line
_COLOURS = 8  # that differ
_NAMED = 24  # joints: more names would cover the picture


@dataclass(frozen=True, kw_only=True)
class NetworkSketch(Sketch):
    """Bodies, beams, springs and joints in any arrangement."""

    network: Network
    # of beams and elastic parts by name; a number is a share of the elastic energy [%]
    colours: Mapping[str, Paint] = field(default_factory=dict)
    plain: PlainColour = PlainColour.INK  # of beams without a colour
    ink: PlainColour = PlainColour.INK  # of all else
    motions: Mapping[str, BodyMotion] = field(default_factory=dict)  # of bodies; empty at rest

    @property
    def size(self) -> float:
        """Length of the network [m]."""
        return size_of(network_points(self.network))

    @property
    def is_level(self) -> bool:
        """Whether it is planar, or all of it lies in one plane z = constant."""
        return self.network.space is Space.PLANAR or is_level(network_points(self.network))

    @property
    def shifts(self) -> np.ndarray:
        """Displacements (n, 3) of the points of attachment of its bodies [m]."""
        if not self.motions:
            return np.zeros((1, 3))
        bodies = _bodies(self.network).items()
        return np.array([self.motions[own].displacement(p) for own, at in bodies for p in at])

    @property
    def values(self) -> Iterable[float]:
        """Shares of the elastic energy [%]."""
        return (value for value in self.colours.values() if isinstance(value, float))

    def placed(self, point: np.ndarray) -> np.ndarray:
        """Where a point (3,) of the platform [m] is drawn."""
        return self.moved(self.network.platform, point[None])[0]

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

    def parts(self) -> list[Item]:
        """Bodies, beams, springs and joints."""
        network = self.network
        items: list[Item] = []
        fixed = set(network.fixed)
        for name, body in _bodies(network).items():
            paint = PlainColour.FAINT if name in fixed else PlainColour.PLATE
            corners = flat_face(body)
            if corners is not None:
                label = "platform" if name == network.platform else ""
                items.append(Face(self.moved(name, corners), paint, 0.35, label))
            ink = PlainColour.MUTED if name in fixed else self.ink
            ties = _ties(self, name, body)
            items += [Path(tie, ink, LineWeight.THIN, about=name) for tie in ties]
        for beam in network.beams:
            line = self.line(beam.start, beam.end, beam.a, beam.b)
            paint = self.colours.get(beam.name, self.plain)
            items.append(_part(line, beam.name, paint, self))
        items += _springs(self) + _joints(self)
        point = self.placed(network.reference_point)[None]
        items.append(Marks(point, PlainColour.INK, Shape.CROSS, "reference point"))
        return items

    def ghost(self, label: str = "without load") -> list[Item]:
        """Beams and bodies at rest, in dashed lines."""
        d = replace(self, scale=0.0)
        lines = [d.line(beam.start, beam.end, beam.a, beam.b) for beam in d.network.beams]
        for name, body in _bodies(d.network).items():
            if name not in d.network.fixed:
                lines += _ties(d, name, body)
        return dashed(lines, label)

    def names(self) -> list[Item]:
        """Names beside the joints, where there are not too many."""
        joints = self.network.joints
        placed = [(own.name, own.a, own.freedoms[0].point) for own in joints if own.freedoms]
        if len(placed) > _NAMED:
            return []
        places = [(self.moved(body, p[None])[0], name) for name, body, p in placed]
        return words_at(places, self.factor * self.size)


def colours_of_network(network: Network) -> dict[str, Paint]:
    """A colour for each beam and elastic part."""
    elastic = [own for own in network.springs if np.any(own.elasticity.compliance)]
    return colours_of_parts(part.name for part in (*network.beams, *elastic))


def motions_of(network: Network, places: BodyPlaces) -> dict[str, BodyMotion]:
    """Finite motions of the bodies of a network, of which the fixed ones rest."""
    still = BodyPlace(np.eye(3), np.zeros(3))
    nodes: Mapping[str, BodyPlace] = {network.platform: places.platform, **places.nodes}
    return {one.name: FiniteMotion.of(nodes.get(one.name, still)) for one in network.nodes}


def energies_by_name(parts: Iterable[PartShare]) -> dict[str, Paint]:
    """Shares of the elastic energy [%] by the whole names of the parts of a network."""
    shares: dict[str, Paint] = {}
    for part in parts:
        for name in (f"{part.leg}/{part.part}", part.part):
            shares.setdefault(name, 100 * part.share)
    return shares


def _ties(d: NetworkSketch, name: str, body: np.ndarray) -> list[np.ndarray]:
    """Lines from the points of a body to its middle; of two points, from one to the other."""
    middle = body.mean(axis=0) if len(body) > 2 else body[-1]
    ends = body if len(body) > 2 else body[:-1]
    return [d.moved(name, np.array([middle, end])) for end in ends]


def _part(line: np.ndarray, name: str, paint: Paint, d: NetworkSketch) -> Path:
    """A beam or an elastic part, named in the legend where its colour is its own."""
    label = name if isinstance(paint, Category) and len(d.colours) <= _COLOURS else ""
    about = name + (f": {paint:.1f} %" if isinstance(paint, float) else "")
    return Path(line, paint, LineWeight.BOLD, label=label, about=about)


def _springs(d: NetworkSketch) -> list[Item]:
    """Elastic parts: a line along one that has a length, a mark where it has none."""
    items: list[Item] = []
    label = "elastic part"
    for spring in d.network.springs:
        if not np.any(spring.elasticity.compliance):
            continue
        paint = d.colours.get(spring.name, d.plain)
        start = clamped_end(spring)
        if np.linalg.norm(start - spring.point) > _SEEN * d.size:
            line = d.line(start, spring.point, spring.a, spring.b)
            items.append(_part(line, spring.name, paint, d))
            continue
        about = spring.name + (f": {paint:.1f} %" if isinstance(paint, float) else "")
        at = d.moved(spring.b, spring.point[None])
        items.append(Marks(at, paint, Shape.DIAMOND, label, (about,)))
        label = ""
    return items


def _joints(d: NetworkSketch) -> list[Item]:
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
