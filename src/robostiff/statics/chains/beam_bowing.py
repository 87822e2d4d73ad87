"""Beams under axial load: their bending shortens them, so that load and bending meet."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.elasticity.cantilever import cantilever_compliance
from robostiff.errors import InputError
from robostiff.model import PlacedFreedom, PlacedSpring
from robostiff.model.snapshot import PlacedElement

_ALIKE = 1e-9  # of an entry: what a beam's compliance may miss of the formula
_ACROSS = 1e-6  # sine of the angle below which a joint turns a beam about its own axis alone


@dataclass(frozen=True)
class Linear:
    """Elastic parts as linear springs: axial load does not change how a beam bends.

    At 0.3 of the Euler load, 30 % of the bending compliance of a cantilever are missed; the
    change of geometry between the ends of the part is met all the same.
    """


@dataclass(frozen=True)
class Bowing:
    """Beams with the energy of their shortening by bending, as clamped cubics.

    ``(EA/L) ((u + th^T G th / 2)^2 - u^2) / 2`` is added to the energy of each element, with u the
    stretch of its ends and ``th = (d, r)``: ``G_dd = 6/(5L)``, ``G_rr = 2L/15``,
    ``G_dr = -1/10`` in x-y, ``+1/10`` in x-z.

    Attributes
    ----------
    elements : int or None
        Into how many each beam is cut; None for two where one beam alone spans two hinges, and
        one elsewhere. Errors fall with its fourth power.

    Raises
    ------
    InputError
        When `elements` is no positive number of elements.
    """

    elements: int | None = None

    def __post_init__(self) -> None:
        n = self.elements
        if n is not None and (isinstance(n, bool) or not isinstance(n, int) or not 1 <= n <= 64):
            raise InputError("elements of a beam", got=n, expected="1 to 64, or None to choose")


Beams = Bowing | Linear


@dataclass(frozen=True)
class UniformBeam:
    """A uniform beam, known by its compliance: x along it, clamped at its start.

    Attributes
    ----------
    length : float
        [m]
    EA, EIy, EIz, GJ : float
        Rigidities [N], [N m^2].
    shear_y, shear_z : float
        Shear compliance of a length [1/N]; 0 without shear.
    """

    length: float
    EA: float
    EIy: float
    EIz: float
    GJ: float
    shear_y: float
    shear_z: float

    def compliance(self, parts: int) -> np.ndarray:
        """Of one of so many equal parts (6, 6), about its far end."""
        L = self.length / parts
        C = cantilever_compliance(L, 1.0, 1.0, self.EA, self.EIy, self.EIz, self.GJ)
        C[1, 1] += self.shear_y * L
        C[2, 2] += self.shear_z * L
        return C

    def shortening(self, parts: int) -> np.ndarray:
        """G (6, 6) of one of so many equal parts; ``th^T G th / 2`` is its shortening."""
        return shortening(self.length / parts).astype(float)


def shortening(L: Any) -> np.ndarray:
    """G (6, 6) of a beam of a length, an entry or a number [m]."""
    G = np.zeros((6, 6), dtype=object)
    for d, r, sign in ((1, 5, -1), (2, 4, 1)):
        G[d, d], G[r, r] = 1.2 * (1 / L), L * (2 / 15)
        G[d, r] = G[r, d] = 0.1 * sign
    return G


def uniform_beam(C: np.ndarray) -> UniformBeam | None:
    """The uniform beam that has a compliance (6, 6) about its far end; None where none has.

    Examples
    --------
    >>> beam = uniform_beam(cantilever_compliance(0.5, 2e11, 8e10, 1e-3, 1e-8, 2e-8, 2e-8))
    >>> beam.length, uniform_beam(np.eye(6)) is None
    (0.5, True)
    """
    diagonal = np.diagonal(C)
    if not np.all(diagonal > 0) or not C[1, 5] > 0:
        return None
    L = 2.0 * C[1, 5] / C[5, 5]
    stretch, dy, dz, twist, ry, rz = (float(entry) for entry in diagonal)
    shear_y, shear_z = dy / L - rz * L / 3.0, dz / L - ry * L / 3.0
    size_y, size_z = dy / L, dz / L
    if shear_y < -_ALIKE * size_y or shear_z < -_ALIKE * size_z:
        return None
    shear_y = shear_y if shear_y > _ALIKE * size_y else 0.0
    shear_z = shear_z if shear_z > _ALIKE * size_z else 0.0
    beam = UniformBeam(float(L), L / stretch, L / ry, L / rz, L / twist, shear_y, shear_z)
    scale = np.sqrt(np.outer(diagonal, diagonal))
    return beam if np.all(np.abs(C - beam.compliance(1)) <= _ALIKE * scale) else None


def elements_of(beams: Beams, beam: PlacedSpring, sides: Iterable[Sequence[PlacedElement]]) -> int:
    """Into how many elements a beam is cut; 0 for a linear spring.

    `sides` have the parts in series, outwards from both ends up to bodies that others hold, too.
    """
    if not isinstance(beams, Bowing):
        return 0
    if beams.elements is not None:
        return beams.elements
    along = beam.rotation[:, 0].tolist()
    return 2 if all(_is_hinged(side, along) for side in sides) else 1


def _is_hinged(side: Sequence[PlacedElement], along: Sequence[float]) -> bool:
    """Whether a beam that is alone bends freely at an end, by what follows outwards from there."""
    elastic = (isinstance(e, PlacedSpring) for e in side if moves(e) and not is_rigid(e))
    return not next(elastic, False) and any(_bends_freely(e, along) for e in side)


def _bends_freely(element: PlacedElement, along: Sequence[float]) -> bool:
    """Whether it is a passive joint that turns about an axis across a direction."""
    if not (isinstance(element, PlacedFreedom) and element.is_passive and element.turns):
        return False
    (a, b, c), (x, y, z) = element.axis.tolist(), along
    return math.hypot(b * z - c * y, c * x - a * z, a * y - b * x) > _ACROSS


def moves(element: PlacedElement) -> bool:
    """Whether it is no joint that is held rigidly."""
    if isinstance(element, PlacedFreedom):
        return element.is_passive or element.stiffness is not None
    return True


def is_rigid(element: PlacedElement) -> bool:
    """Whether it is an elastic part without compliance."""
    return isinstance(element, PlacedSpring) and element.elasticity.is_rigid
