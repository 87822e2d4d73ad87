"""Elastic parts of a robot as elements: linear springs, and beams cut into some."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from robostiff.model import PlacedSpring
from robostiff.model.snapshot import PlacedElement
from robostiff.spatial import Space, compliance_modes
from robostiff.statics.chains.beam_bowing import (
    Beams,
    Bowing,
    UniformBeam,
    bending_planes,
    bowing,
    elements_of,
    part_of_beam,
    uniform_beam,
)
from robostiff.statics.chains.element import Element, FiniteSpring

# Under these names an elasticity keeps the beam that it is, and what has been worked out of it.
_BEAM, _OWN = "_beam", "_as_elements"


@dataclass(frozen=True)
class SpringElements:
    """Elastic parts as elements; what has been worked out for one is used for all alike."""

    space: Space
    treated: Beams
    # by compliance, and in the plane by axes; the uniform beam of each, None where it is none
    known: dict[tuple[object, ...], FiniteSpring] = field(default_factory=dict)
    beams: dict[tuple[bytes, bytes], UniformBeam | None] = field(default_factory=dict)

    def of(self, spring: PlacedSpring, sides: Iterable[Sequence[PlacedElement]]) -> list[Element]:
        """An elastic part as one spring, or a beam as one or more elements with their bowing.

        `sides` as for `elements_of`.
        """
        C = spring.elasticity.compliance
        free = np.array(spring.elasticity.freedoms, dtype=float)
        turned = None if self.space is Space.SPATIAL else spring.rotation.tobytes()
        entries, kept = (C.tobytes(), free.tobytes()), vars(spring.elasticity)
        if _BEAM not in kept:  # with a part that is alike at all poses it stays known
            if entries not in self.beams:
                self.beams[entries] = None if free.size else uniform_beam(C)
            kept[_BEAM], kept[_OWN] = self.beams[entries], {}
        beam: UniformBeam | None = kept[_BEAM]
        parts = 0 if beam is None else elements_of(self.treated, spring, sides)
        inner = parts == 1 and self.treated == Bowing()
        key = (*entries, turned, parts, inner)
        own = self.known.get(key) or kept[_OWN].get(key[2:])
        if own is None:
            own = self._own(spring, C, free, beam if parts else None, parts, inner)
        self.known[key] = kept[_OWN][key[2:]] = own
        point, rotation = (
            np.array([spring.point], dtype=float),
            np.array([spring.rotation], dtype=float),
        )
        own = replace(own, names=(spring.name,), point=point, rotation=rotation)
        if beam is None or parts < 2:
            return [own]
        x = rotation[0, :, 0] * beam.length
        shifts = [x * (1 - (i + 1) / parts) for i in range(parts)]
        return [replace(own, point=point - shift) for shift in shifts]

    def _own(
        self,
        spring: PlacedSpring,
        C: np.ndarray,
        free: np.ndarray,
        beam: UniformBeam | None,
        parts: int,
        inner: bool,
    ) -> FiniteSpring:
        """The element of a part, or of one of so many parts of a beam, in no place."""
        nowhere = np.zeros((1, 3)), np.zeros((1, 3, 3))
        C = C if beam is None else part_of_beam(C, beam.length, parts)
        V, k = self._modes(spring, C, free)
        if beam is None:
            none = np.zeros((1, V.shape[1], V.shape[1]))
            return FiniteSpring((), *nowhere, V[None], k[None], np.zeros(1), none)
        planes = bending_planes(self.space, spring.rotation)
        S, more = bowing(V, C, beam.length / parts, planes, inner=inner)
        V = np.pad(V, ((0, 0), (0, len(more))))
        k, axial = np.append(k, more), np.array([beam.EA / beam.length * parts])
        return FiniteSpring((), *nowhere, V[None], k[None], axial, S[None])

    def _modes(
        self, spring: PlacedSpring, C: np.ndarray, free: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        own, C, free = among_motions(self.space, spring.rotation, C, free)
        # those of a part that is alike at all poses are kept with it
        modes = (
            spring.elasticity.modes if C is spring.elasticity.compliance else compliance_modes(C)
        )
        modes = modes[:, np.any(modes != 0, axis=0)]
        free = free[:, np.any(free != 0, axis=0)]
        stiffness = np.concatenate([np.ones(modes.shape[1]), np.zeros(free.shape[1])])
        return own @ np.concatenate([modes, free], axis=1), stiffness


def among_motions(
    space: Space, rotation: np.ndarray, C: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Motions of a space in the axes of an elastic part (6, r); compliance and freedoms in them.

    Of a planar robot in world axes; of numbers or of entries.
    """
    if space is Space.SPATIAL:
        return np.eye(6, dtype=int).astype(C.dtype), C, free
    rows = list(space.rows)
    world = np.zeros((6, 6), dtype=int).astype(C.dtype)
    world[:3, :3] = world[3:, 3:] = rotation
    inside = (world @ free)[rows] if free.size else np.zeros((len(rows), 0), dtype=C.dtype)
    return world.T[:, rows], (world @ C @ world.T)[np.ix_(rows, rows)], inside
