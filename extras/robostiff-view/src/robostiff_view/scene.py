"""Layers of items drawn with viser; what is no longer there is removed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from robostiff.plot import (
    Arrow,
    Face,
    Item,
    LineWeight,
    Marks,
    Mesh,
    Paint,
    Path,
    Shape,
    Text,
    Theme,
    colour_of,
)

# Of the robot's size.
_WIDTHS = {LineWeight.BOLD: 0.012, LineWeight.LINE: 0.006, LineWeight.THIN: 0.0025}
_MARKS = {Shape.RING: 0.011, Shape.SQUARE: 0.010, Shape.DIAMOND: 0.012, Shape.CROSS: 0.008}
_DASH, _ARROW, _APART = 0.03, 0.006, 0.002
_MOST_DASHES = 200  # of a line
_DEEPEST = 12  # faces below the lines
_PASSIVE = (216, 216, 216)

_CUBE = (
    np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)]),
    np.array(
        [
            [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
            [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
        ]
    ),
)  # fmt: skip
_OCTAHEDRON = (
    np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]),
    np.array(
        [
            [0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4],
            [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5],
        ]
    ),
)  # fmt: skip


def _sphere(around: int = 33, along: int = 17) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a unit sphere, by longitude and latitude."""
    a, b = np.meshgrid(
        np.linspace(0, 2 * np.pi, around), np.linspace(0, np.pi, along), indexing="ij"
    )
    vertices = np.stack([np.cos(a) * np.sin(b), np.sin(a) * np.sin(b), np.cos(b)], axis=-1)
    corner = np.arange(around * along).reshape(around, along)
    first, right, up, across = corner[:-1, :-1], corner[1:, :-1], corner[:-1, 1:], corner[1:, 1:]
    lower, upper = (np.stack(own, axis=-1) for own in ((first, right, across), (first, across, up)))
    return vertices.reshape(-1, 3), np.concatenate([lower.reshape(-1, 3), upper.reshape(-1, 3)])


_SPHERE = _sphere()
_SHAPES = {Shape.SQUARE: _CUBE, Shape.DIAMOND: _OCTAHEDRON, Shape.CROSS: _OCTAHEDRON}


class LayeredScene:
    """The picture in the browser.

    Parameters
    ----------
    scene : viser.SceneApi
    size : float
        Of the robot [m]: widths of lines and marks are parts of it.
    is_flat : bool
        Whether all of it lies in the x-y plane: its faces are drawn one below the other.
    """

    def __init__(self, scene: Any, size: float, *, is_flat: bool = False) -> None:
        self._scene, self._size, self._is_flat = scene, size, is_flat
        self._nodes: dict[str, tuple[str, Any, dict[str, Any]]] = {}
        self._faces = 0

    @property
    def names(self) -> list[str]:
        """Of all that is drawn now."""
        return list(self._nodes)

    def show(self, layers: Mapping[str, Sequence[Item]]) -> None:
        """Draw layers in place of those before; call it in one atomic block."""
        drawn: set[str] = set()
        self._faces = 0
        for layer, items in layers.items():
            for name, kind, props in self._nodes_of(items):
                path = f"/{layer.replace(' ', '-')}/{name}"
                self._put(path, kind, props)
                drawn.add(path)
        for path in [path for path in self._nodes if path not in drawn]:
            self._nodes.pop(path)[1].remove()

    def _put(self, path: str, kind: str, props: dict[str, Any]) -> None:
        known = self._nodes.get(path)
        if known is not None and known[0] == kind:
            for name, value in props.items():
                if not np.array_equal(value, known[2][name]):
                    setattr(known[1], name, value)
            known[2].update(props)
            return
        if known is not None:
            known[1].remove()
        self._nodes[path] = (kind, getattr(self._scene, kind)(path, **props), props)

    def _nodes_of(self, items: Sequence[Item]) -> Iterable[tuple[str, str, dict[str, Any]]]:
        """Name, kind and properties of the nodes that draw the items of a layer."""
        paths = [item for item in items if isinstance(item, Path)]
        for weight in LineWeight:
            own = [item for item in paths if item.weight is weight]
            if own:
                yield f"lines-{weight.name}", "add_line_segments", self._lines(own, weight)
        arrows = [item for item in items if isinstance(item, Arrow)]
        if arrows:
            yield "arrows", "add_arrows", self._arrows(arrows)
        surfaces = [item for item in items if isinstance(item, Face | Mesh)]
        for i, item in enumerate(surfaces):
            yield f"surface-{i}", "add_mesh_simple", self._surface(item)
        marks = [item for item in items if isinstance(item, Marks)]
        for i, item in enumerate(marks):
            yield f"marks-{i}", "add_mesh_simple", self._marks(item)
        texts = [item for item in items if isinstance(item, Text)]
        for i, item in enumerate(texts):
            yield f"words-{i}", "add_label", {"text": item.words, "position": item.point}

    def _lines(self, paths: Sequence[Path], weight: LineWeight) -> dict[str, Any]:
        pieces = [self._pieces(item) for item in paths]
        colours = np.array([_linear(rgb(item.paint)) for item in paths], dtype=np.uint8)
        both_ends = np.repeat(colours[:, None], 2, axis=1)
        return {
            "points": np.concatenate(pieces).astype(np.float32),
            "colors": np.repeat(both_ends, [len(own) for own in pieces], axis=0),
            "thickness": _WIDTHS[weight] * self._size,
        }

    def _pieces(self, item: Path) -> np.ndarray:
        """Segments (n, 2, 3) of a line; of a dashed one every other piece."""
        segments = np.stack([item.points[:-1], item.points[1:]], axis=1)
        if not item.dashed:
            return segments
        pieces = []
        for start, end in segments:
            length = float(np.linalg.norm(end - start))
            n = max(1, round(min(length / (2 * _DASH * self._size), _MOST_DASHES)))
            at = (np.arange(n)[:, None] + np.array([0.0, 0.5])) / n
            pieces.append(start + at[..., None] * (end - start))
        return np.concatenate(pieces)

    def _arrows(self, arrows: Sequence[Arrow]) -> dict[str, Any]:
        ends, colours = [], []
        for item in arrows:
            middle = 0.5 * (item.start + item.tip)
            both = [[middle, item.tip], [middle, item.start]]
            ends += both if item.both_ways else [[item.start, item.tip]]
            colours += [rgb(item.paint)] * (2 if item.both_ways else 1)
        wide = _ARROW * self._size
        return {
            "points": np.array(ends, dtype=np.float32),
            "colors": np.array(colours, dtype=np.uint8),
            "shaft_radius": wide,
            "head_radius": 2.5 * wide,
            "head_length": 5 * wide,
        }

    def _marks(self, item: Marks) -> dict[str, Any]:
        """All marks as one mesh of spheres, cubes or octahedra."""
        vertices, triangles = _SHAPES.get(item.shape, _SPHERE)
        half = _MARKS.get(item.shape, 0.006) * self._size
        n = len(vertices)
        placed = item.points[:, None] + half * vertices
        faces = triangles + n * np.arange(len(item.points))[:, None, None]
        passive = item.shape is Shape.RING
        return {
            "vertices": placed.reshape(-1, 3).astype(np.float32),
            "faces": faces.reshape(-1, 3).astype(np.uint32),
            "color": _PASSIVE if passive else rgb(item.paint),
            "flat_shading": item.shape in _SHAPES,
            "side": "double",
        }

    def _surface(self, item: Face | Mesh) -> dict[str, Any]:
        is_face = isinstance(item, Face)
        vertices, triangles = item.fan if is_face else (item.vertices, item.triangles)
        below = 0.0
        if self._is_flat:  # faces in one plane flicker
            below = (_DEEPEST - self._faces) * _APART * self._size
            self._faces += 1
        return {
            "vertices": (vertices - np.array([0.0, 0.0, below])).astype(np.float32),
            "faces": triangles.astype(np.uint32),
            "color": rgb(item.paint),
            "opacity": item.opacity,
            "side": "double",
        }


def _linear(colour: tuple[int, int, int]) -> list[int]:
    """A colour as lines take it: their shader encodes it once more (IEC 61966-2-1)."""
    encoded = [c / 255 for c in colour]
    linear = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in encoded)
    return [round(255 * c) for c in linear]


def rgb(paint: Paint) -> tuple[int, int, int]:
    """Red, green and blue of a paint on light ground, 0 to 255."""
    colour = colour_of(paint, Theme.LIGHT.palette)
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue
