"""Springs: elastic elements at one place of a chain, with free and rigid directions."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robostiff.elasticity.beam import SlenderBeam, UniformBeam, uniform_beam
from robostiff.elasticity.checks import Bounds, as_array, left_open, positive_number
from robostiff.errors import InputError
from robostiff.frozen import field, frozen
from robostiff.spatial import as_floats
from robostiff.spatial.compliance_modes import compliance_modes
from robostiff.spatial.formula import (
    Entries,
    exact_array,
    exact_number,
    formula_array,
    is_formula,
    length_of,
    vanishes,
)

_TOGETHER = 256  # elasticities of which all are computed where one is


@frozen
class Elasticity:
    """Compliance and freedoms of an element, about its own point and in its own axes.

    Parameters
    ----------
    compliance : (..., 6, 6) array
        Symmetric positive semidefinite compliance [m/N, rad/N, rad/(N m)]; zero where rigid.
    freedoms : (6, k) array, optional
        Twists (dx, dy, dz, rx, ry, rz) in columns [m, rad] that meet no stiffness at all; none
        normally.
    bounds : tuple of Bounds, optional
        Inequalities that formulas leave open and without which the element does not exist.
    beam : SlenderBeam or None
        The beam that it is of, where it is made as one; its formulas have names for its products.
    segments : tuple of (6, 6) arrays, or None
        Compliances of the uniform segments of a tapered beam from its start on, each about its own
        far end; empty of a uniform beam. None of a matrix, of which no more is known.
    shear_left_out : (2,) array or None
        What shear would add to the compliances along y and z [m/N], of a beam of no chosen theory.

    Raises
    ------
    InputError
        Shapes that do not fit, or entries that are not finite.

    Notes
    -----
    Only shapes are checked here, for matrices that were computed. `elasticity_from_stiffness` and
    `elasticity_from_compliance` check their input. Both arrays are kept read-only.

    Examples
    --------
    >>> Elasticity(np.zeros((6, 6))).freedoms.shape
    (6, 0)
    """

    compliance: NDArray[Any]
    freedoms: NDArray[Any] = field(default_factory=lambda: np.zeros((6, 0)))
    bounds: tuple[Bounds, ...] = ()
    beam: SlenderBeam | None = None
    segments: tuple[NDArray[Any], ...] | None = None
    shear_left_out: NDArray[Any] | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        compliance = _own_compliance("compliance of the spring", self.compliance)
        freedoms = _own_array("freedoms of the spring", self.freedoms)
        if freedoms.ndim != 2 or freedoms.shape[0] != 6:
            subject = "shape of the freedoms of the spring"
            expected = "(6, k), one twist (dx, dy, dz, rx, ry, rz) in each column"
            raise InputError(subject, got=freedoms.shape, expected=expected)
        object.__setattr__(self, "compliance", compliance)
        object.__setattr__(self, "freedoms", freedoms)
        object.__setattr__(self, "bounds", left_open(self.bounds))
        if self.segments:
            segments = (_own_compliance("compliance of a segment", C) for C in self.segments)
            object.__setattr__(self, "segments", tuple(segments))

    @cached_property
    def modes(self) -> NDArray[Any]:
        """Twists (..., 6, 6) in columns: a wrench w stores the energy ``|modes^T w|^2 / 2``."""
        if self.among is not None:
            several, index = self.among
            return several.modes[index]
        return compliance_modes(self.compliance)

    @property
    def pieces(self) -> tuple[NDArray[Any], ...]:
        """Compliances of its segments; that of the whole where it has none."""
        return self.segments or (self.compliance,)

    @cached_property
    def beams(self) -> tuple[UniformBeam, ...]:
        """Uniform beams, in its own axes, that the pieces of a part in numbers are; else none."""
        if self.among is not None and self.among[0].beams:
            several, index = self.among
            return tuple(UniformBeam(*(x[index] for x in vars(b).values())) for b in several.beams)
        pieces, is_one = () if self.freedoms.size else self.pieces, self.segments is not None
        found = [uniform_beam(C, is_one=is_one) for C in pieces]
        return tuple(beam for beam in found if beam and None not in found)

    @property
    def is_rigid(self) -> bool:
        """Whether it has neither compliance nor freedoms."""
        return not (np.any(self.compliance) or self.freedoms.size)

    def one(self, index: int | slice) -> Elasticity:
        """That of one pose of a batch, or of some; itself where it is the same at all."""
        if self.compliance.ndim == 2:
            return self
        found = object.__new__(Elasticity)  # its arrays have been checked with the others
        same = {name: getattr(self, name) for name in ("freedoms", "bounds", "segments")}
        several, rows = self.among or (self, slice(None))
        if len(several.compliance) <= _TOGETHER:
            index_among = np.arange(len(several.compliance))[rows][index]
            vars(found)["_among"] = several, index_among
        vars(found).update(beam=None, **same, compliance=self.compliance[index])
        return found

    @property
    def among(self) -> tuple[Elasticity, Any] | None:
        """Those of a few legs or poses of which it is one, and which: they are computed at once."""
        return vars(self).get("_among")


def translational_spring(stiffness: Any, axis: Entries) -> Elasticity:
    """Spring that is compliant along one axis and rigid otherwise: ``C[:3, :3] = u u^T / k``.

    Parameters
    ----------
    stiffness : float or formula
        Stiffness k along the axis [N/m].
    axis : (3,) array
        Direction; u is this vector made unit.

    Raises
    ------
    InputError
        The stiffness is not positive and finite, or the axis is not a direction.

    Examples
    --------
    >>> translational_spring(1e6, axis=[0, 0, 2]).compliance[2, 2]
    np.float64(1e-06)
    """
    k = positive_number("stiffness of the translational spring", stiffness, "N/m")
    return _spring_along(k, axis, slice(0, 3))


def rotational_spring(stiffness: Any, axis: Entries) -> Elasticity:
    """Spring that is compliant about one axis through its point: ``C[3:, 3:] = u u^T / k``.

    Parameters
    ----------
    stiffness : float or formula
        Stiffness k about the axis [N m/rad].
    axis : (3,) array
        Direction; u is this vector made unit.

    Raises
    ------
    InputError
        The stiffness is not positive and finite, or the axis is not a direction.

    Examples
    --------
    >>> rotational_spring(500.0, axis=[0, 1, 0]).compliance[4, 4]
    np.float64(0.002)
    """
    k = positive_number("stiffness of the rotational spring", stiffness, "N m/rad")
    return _spring_along(k, axis, slice(3, 6))


def _spring_along(stiffness: Any, axis: Entries, rows: slice) -> Elasticity:
    subject, expected = "axis of the spring", "three numbers, not all zero"
    given = exact_array(as_array(axis)) if is_formula(stiffness) else axis
    u = formula_array(given)
    if u is None:
        u = as_floats(subject, given, expected, shape=(3,))
    if u.shape != (3,) or (vanishes(u) if u.dtype == object else not u.any()):
        raise InputError(subject, got=given, expected=expected)
    u = u / (length_of(u) if u.dtype == object else np.linalg.norm(u))
    k = exact_number(stiffness) if u.dtype == object else stiffness
    compliance = np.zeros((6, 6), dtype=u.dtype)
    compliance[rows, rows] = np.outer(u, u) / k
    return Elasticity(compliance, bounds=(Bounds("stiffness of the spring", k),))


def _own_compliance(subject: str, values: ArrayLike) -> NDArray[Any]:
    array = _own_array(subject, values)
    if array.shape[-2:] != (6, 6):
        raise InputError(f"shape of the {subject}", got=array.shape, expected="(..., 6, 6)")
    return array


def _own_array(subject: str, values: ArrayLike) -> NDArray[Any]:
    """A read-only copy: floats, or objects (exact and symbolic entries) as they are."""
    array = np.array(as_array(values))
    if array.dtype != object:
        if array.dtype.kind not in "iuf" or not np.isfinite(array).all():
            raise InputError(subject, got=array.tolist(), expected="finite numbers")
        array = array.astype(np.float64)
    array.setflags(write=False)
    return array
