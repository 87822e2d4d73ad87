"""Elastic parts as elements; bending shortens beams, so that it meets with axial load."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.errors import InputError
from robostiff.frozen import field, frozen, replace
from robostiff.model import Passive, PlacedFreedom, PlacedSpring, StiffnessLaw
from robostiff.model.batched import one_of
from robostiff.record import is_zero, square_root, usual_size
from robostiff.spatial import Space, block_rotation, compliance_modes, cross, level_axes
from robostiff.statics.chains.elements import Bending, Element, FiniteJoint, FiniteSpring

# Of a compliance: shear that is rounding; of freedoms: one that the others have.
_NONE = 1e-9
# Integrals over s of products of the slopes of inner modes, and of those with the cubic of a turn;
# of products of their third derivatives, less the means. Of the first and the third inner mode, and
# of both before the latter.
_SLOPES, _SHEARED = (1 / 42, -(5**0.5) / 420, 1 / 154), (60.0, 36 * 5**0.5, 360.0)
_WITH_TURN, _ENDS = (-(5**0.5) / 60, 0.0), (5**0.5, 3.0)


def bending(
    V: np.ndarray,
    C: np.ndarray,
    L: Any,
    planes: Sequence[tuple[np.ndarray, np.ndarray]],
    *,
    inner: bool,
) -> Bending:
    """How bending shortens one beam, by its cubic between the ends and by inner modes.

    With three inner modes a plane, the deflection at s L is ``w = (3 s^2 - 2 s^3) d + (s^3 - s^2) L
    r + L sum(a_k w_k)``, where w_k and its slope are zero at both ends and its second derivative is
    ``sqrt(2k + 1) P_k(2s - 1)``, k = 2, 3, 4, with Legendre polynomials P_k. The line is then
    shorter by the integral of ``(dw/ds)^2 / (2L)`` over s. Inner modes have the energy ``EI
    sum(a_k^2) / (2L)``, and none with d and r; the axial force couples the second with ``d - L
    r/2``, the first and third with r. In a beam with shear the sections turn by the slopes of w_k;
    the slope of the line is less by ``e`` times the third derivative without its mean, e being ``EI
    / L^2`` times the shear compliance of a unit length.

    Parameters
    ----------
    V : (..., 6, m) array
        ``(d, r)`` of the far end by its coordinates, own axes; of numbers or of entries.
    C : (..., 6, 6) array
        Compliance about its far end, of numbers or of entries.
    L : number, entry or (...) array
        Length [m].
    planes : sequence of pairs of (..., 3) arrays
        In which it bends: unit vectors across it and along its turns, own axes. Two of a robot in
        space, the plane itself of a planar one.
    inner : bool
        Whether it has inner modes.

    Returns
    -------
    Bending
        Of one beam.
    """
    forms: list[tuple[np.ndarray, Any, Any, Any]] = []
    length = np.asarray(L)[..., None]
    for across, turn in planes:
        d = (across[..., None, :] @ V[..., :3, :])[..., 0, :]
        r = (turn[..., None, :] @ V[..., 3:, :])[..., 0, :]
        of_shift, of_turn = (d - r * (length * 0.5), 0.2 * (1 / L)), (r, L * (1 / 12))
        forms.append((d, 1 / L, 0, 0))
        if not inner:
            forms += [(*of_shift, 0, 0), (*of_turn, 0, 0)]
            continue
        soft = _along(turn, C[..., 3:, 3:])  # L/EI
        e = _along(across, C[..., :3, :3]) * (1 / (soft * L * L)) - 1 / 3
        if isinstance(e, np.ndarray):
            e = np.where(np.abs(e) <= _NONE, 0.0, e)
        elif usual_size(e) <= _NONE:
            e = 0
        # the second mode: slopes, energy, and slopes with the cubic
        stiff, with_shift = 1 + 140.0 * e, 7**-0.5 / 10 + 2 * 7**0.5 * e
        slopes = 1 / 90 + 2 * e + 140.0 * e * e
        b, l = with_shift * with_shift * (1 / stiff) * soft, slopes * (1 / stiff) * (soft * L)
        forms.append((*of_shift, b, l))
        # the first and the third: c^T (K + N S)^-1 c in partial fractions
        K = [i + x * e for i, x in zip((1, 0, 1), _SHEARED, strict=True)]
        each = zip(_SLOPES, (1, 0, 1), _SHEARED, strict=True)
        S = [slope + i * (2 * e) + x * (e * e) for slope, i, x in each]
        c = [x - y * e for x, y in zip(_WITH_TURN, _ENDS, strict=True)]
        by = 2 / _determinant(K, K)
        mean, product = _determinant(K, S) * 0.5 * by, _determinant(S, S) * 0.5 * by
        apart = square_root(mean * mean - product)
        first, last = mean + apart, mean - apart
        whole, part = (
            (c[0] * c[0] * M[2] + c[1] * c[1] * M[0] - c[0] * c[1] * M[1] * 2) * by for M in (K, S)
        )
        half = 0.5 * (1 / apart) * (soft * L * L)
        forms.append((*of_turn, (whole * first - part) * half, first * (soft * L)))
        forms.append((r, 0, (part - whole * last) * half, last * (soft * L)))
    F, *batch = len(forms), *V.shape[:-2]
    z = np.zeros((*batch, F, V.shape[-1]), dtype=int).astype(V.dtype)
    s, b, l = np.zeros((3, *batch, F), dtype=int).astype(V.dtype)
    for i, form in enumerate(forms):
        z[..., i, :], s[..., i], b[..., i], l[..., i] = form
    return Bending(z, s, b, l)


def _along(v: np.ndarray, C: np.ndarray) -> Any:
    """``v C v`` of a vector (..., 3) and a matrix (..., 3, 3)."""
    return (v[..., None, :] @ C @ v[..., None])[..., 0, 0][()]


def _determinant(A: Sequence[Any], B: Sequence[Any]) -> Any:
    """Of symmetric (2, 2) matrices: twice the determinant where they are one, bilinear."""
    return A[0] * B[2] + A[2] * B[0] - A[1] * B[1] * 2


# Under this name an elasticity keeps what has been worked out of it.
_ELEMENTS = "_as_elements"


@frozen
class Linear:
    """Elastic parts as linear springs: axial load does not change how a beam bends.

    At 0.3 of the Euler load, 30 % of the bending compliance of a cantilever are missed; the
    change of geometry between the ends of the part is taken into account.
    """


@frozen
class Bowing:
    """Beams with the energy of their shortening by bending.

    ``(EA/L) ((u + b)^2 - u^2) / 2`` is added to the energy of each element, with u the stretch of
    its ends and b the shortening of its line, see `bending`. By default, the line of a beam has six
    inner modes beside the motion of its ends, so that a compressed beam buckles between ends that
    are clamped, too: its critical loads are at most 0.1 % too high.

    Attributes
    ----------
    elements : int or None
        Into how many clamped cubics each beam is divided; errors decrease with the fourth power.
        None: one element with inner modes, and so many of beams that bend far that each element
        bends by less than 0.1 rad. One cubic alone does not buckle between clamped ends.
    inner_modes : bool or None
        Whether each element has inner modes; None: where `elements` is None.

    Raises
    ------
    InputError
        When `elements` is no positive number of elements.
    """

    elements: int | None = None
    inner_modes: bool | None = None

    @property
    def has_inner_modes(self) -> bool:
        """Whether elements have inner modes."""
        return self.elements is None if self.inner_modes is None else self.inner_modes

    def __post_init__(self) -> None:
        n = self.elements
        of_bool = isinstance(n, bool) or not isinstance(n, int)
        if n is not None and (of_bool or not 1 <= n <= 64):
            raise InputError("elements of a beam", got=n, expected="1 to 64, or None to choose")


Beams = Bowing | Linear


@frozen
class Division:
    """Into how many elements beams are divided where `Bowing` leaves that open."""

    least: int = 1  #: every beam
    #: mapping of (str, str) to int: those that bend far, by leg and part
    parts: Mapping[tuple[str, str], int] = field(default_factory=dict)

    def of(self, leg: str, part: str) -> int:
        """Elements of a beam, or of each segment of a tapered one."""
        return self.parts.get((leg, part), self.least)


def part_of_beam(C: np.ndarray, length: Any, parts: int) -> np.ndarray:
    """Compliance (..., 6, 6) of one of so many equal parts of a uniform beam, about its far end.

    From that of the whole beam, a third of whose length cubed over EI is due to bending, the rest
    to shear; of numbers or of entries, as its length [m].
    """
    if parts == 1:
        return C
    L = length * (1 / parts)
    found: np.ndarray = np.zeros(C.T.shape, dtype=int).astype(C.dtype)
    for i in (0, 3, 4, 5):
        found[i, i] = C.T[i, i] * (1 / parts)
    for d, r, sign in ((1, 5, 1), (2, 4, -1)):
        bending = found[r, r] * L
        shear = C.T[d, d] - C.T[r, r] * length * length * (1 / 3)
        found[d, d] = bending * L * (1 / 3) + shear * (1 / parts)
        found[d, r] = found[r, d] = bending * (sign * 0.5)
    return np.swapaxes(found.T, -1, -2)


@frozen
class Elements(ABC):
    """What makes elements of parts: numbers, or entries of a record in arrays of objects."""

    space: Space
    kind: ClassVar[type] = float

    def array(self, values: Any) -> np.ndarray:
        """Values as an array."""
        return np.array(values, dtype=self.kind)

    def joint(self, freedom: PlacedFreedom) -> FiniteJoint:
        """A joint in finite motion, whose drive does not push; of numbers, with law and inertia."""
        law, inertia = None, 0.0
        if self.kind is float:
            varying = None if isinstance(freedom.role, Passive) else freedom.role.stiffness
            if isinstance(varying, StiffnessLaw):
                law = varying.from_rest(freedom.coordinate)
            inertia = float(getattr(freedom.role, "inertia", None) or 0.0)
        slide, k, none = freedom.advance(1), freedom.stiffness, 0
        k = none if k is None else k
        if self.kind is float:
            slide, k, none = float(slide), float(k), 0.0
        point, axis = self.array(freedom.point), self.array(freedom.axis)
        of_joint = freedom.name, point, axis, freedom.turns, slide, k, none
        return FiniteJoint(*of_joint, law=law, inertia=inertia)

    @abstractmethod
    def spring(self, spring: PlacedSpring, leg: str) -> list[Element]:
        """An elastic part of a leg as one spring, or a beam as elements with their bowing."""


@frozen
class ElementsOfParts(Elements):
    """Of numbers."""

    treated: Beams
    division: Division = field(default_factory=Division)

    def spring(self, spring: PlacedSpring, leg: str) -> list[Element]:
        """An elastic part as one spring, or a beam as one or more elements."""
        treated, n = self.treated, 1
        if isinstance(treated, Bowing) and treated.elements is None and spring.elasticity.beams:
            n = self.division.of(leg, spring.name)
            inner = treated.has_inner_modes
            treated = Bowing(n, inner_modes=inner) if n > 1 else treated
        elasticity, index = spring.elasticity.among or (spring.elasticity, None)
        # with a part that is alike at all poses they stay known, if they are so whichever way up
        in_space = self.space is Space.SPATIAL
        kept = vars(elasticity).setdefault(_ELEMENTS, {}) if in_space else {}
        if treated not in kept:
            beams = elasticity.beams
            bowing = treated if beams and isinstance(treated, Bowing) else None
            pieces: list[tuple[np.ndarray, Any]] = [(elasticity.compliance, None)]
            if bowing or len(beams) > 1:
                lengths = (beam.length for beam in beams)
                pieces = [*zip(elasticity.pieces, lengths, strict=True)]
            kept[treated] = elastic_elements(
                self.space,
                np.array(spring.rotation, dtype=float),
                pieces,
                np.array(elasticity.freedoms, dtype=float),
                (bowing and bowing.elements) or 1,
                partial(_modes, elasticity),
                bows=bowing is not None,
                inner=bowing is not None and bowing.has_inner_modes,
            )
        return in_series(kept[treated], spring, index, n)


def _modes(
    elasticity: Elasticity, C: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    # those of a part that is alike at all poses are kept with it
    modes = elasticity.modes if C is elasticity.compliance else compliance_modes(C)
    if free.size and np.linalg.matrix_rank(free) + modes.any(axis=-2).sum(axis=-1).max() > len(
        free
    ):
        # its compliance along its freedoms is of no account
        size = np.sqrt(np.diagonal(C, axis1=-2, axis2=-1).reshape(-1, len(free)).max(axis=0))
        size = np.where(size > 0, size, 1.0)[:, None]
        U, values, _ = np.linalg.svd(free / size)
        W = U[:, np.sum(values > _NONE * values[0]) :]
        modes = size * W @ compliance_modes(W.T @ (C / size / size.T) @ W)
    free = np.broadcast_to(free, (*modes.shape[:-1], free.shape[-1]))
    V, k = np.concatenate([modes, free], axis=-1), np.ones(modes.shape[-1] + free.shape[-1])
    k[modes.shape[-1] :], is_one = 0.0, V.any(axis=tuple(range(V.ndim - 1)))
    return V[..., is_one], k[is_one]


#: Motions (..., r, m) of an elastic part by its coordinates, and the stiffness of these (m,),
#: from its compliance (..., r, r) and its freedoms (r, f).
Modes = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


#: Elements in no place, in series; with each how far before the end of their part it ends [m].
InNoPlace = list[tuple[FiniteSpring, Any]]


def elastic_elements(
    space: Space,
    rotation: np.ndarray,
    pieces: Sequence[tuple[np.ndarray, Any]],
    free: np.ndarray,
    parts: int,
    modes_of: Modes,
    *,
    bows: bool,
    inner: bool,
) -> InNoPlace:
    """An elastic part as elements: each piece of a beam as so many equal ones.

    Pieces are compliances (..., 6, 6) and lengths (...) [m] from the start on, or one compliance
    and None; `bows`: whether bending shortens them. The rest is as for `elastic_element`.
    """
    found: InNoPlace = []
    rest: Any = 0
    for C, length in reversed(pieces):
        bent = length if bows else None
        element = elastic_element(space, rotation, (C, free), bent, parts, modes_of, inner=inner)
        for i in range(parts):
            found.append((element, rest if i == 0 else rest + length * (i / parts)))
        rest = rest if length is None else rest + length
    *backs, whole = (usual_size(np.ravel(x)[0]) for x in (*(back for _, back in found), rest))
    ends = (1.0 - back / (whole or 1.0) for back in reversed(backs))
    return [(replace(e, ends=end), back) for (e, back), end in zip(found[::-1], ends, strict=True)]


def elastic_element(
    space: Space,
    rotation: np.ndarray,
    softness: tuple[np.ndarray, np.ndarray],
    length: Any,
    parts: int,
    modes_of: Modes,
    *,
    inner: bool,
) -> FiniteSpring:
    """An elastic part, or one of so many equal parts of a beam, as an element in no place.

    `softness` is its compliance (..., 6, 6) and its freedoms (6, f); `length` (...) [m] that of a
    beam which bending shortens, None for a linear spring; `inner`: whether it has inner modes. Of
    numbers or of entries.
    """
    C, free = softness
    axial, part, planes = 0, 0, []
    x, y, z = np.eye(3, dtype=int)
    if length is not None:
        axial, part, planes = parts / C.T[0, 0], length / parts, [(y, z), (z, -y)]
        C = part_of_beam(C, length, parts)
    motions, C_in = np.eye(6, dtype=int).astype(C.dtype), C
    if space is Space.PLANAR:  # motions of the plane, of entries in world axes
        up, rows = rotation[..., 2, :], np.array(space.rows)
        planes = [(cross(up, x), up)] if planes else []
        is_number = rotation.dtype != object
        to_plane = np.swapaxes(level_axes(rotation), -1, -2) if is_number else np.eye(3, dtype=int)
        there = block_rotation(to_plane @ rotation)
        free, motions = (there @ free)[..., rows, :], np.swapaxes(there, -1, -2)
        C_in, motions = (there @ C @ motions)[..., rows[:, None], rows], motions[..., rows]
    modes, k = modes_of(C_in, free)
    V, nowhere = motions @ modes, np.zeros(3, dtype=int).astype(C.dtype)
    bent = bending(V, C, part, planes, inner=inner)
    return FiniteSpring("", nowhere, rotation, V, k, axial, bent)


def in_series(
    found: InNoPlace, spring: PlacedSpring, index: Any = None, together: int = 1
) -> list[Element]:
    """The elements of an elastic part where it is, of numbers or of entries.

    Of elements of many parts those of one of them, or of some, by its number there. So many are
    one part of results `together`.
    """
    (first, _), *_ = found
    point, rotation = (
        np.asarray(each, dtype=first.point.dtype) for each in (spring.point, spring.rotation)
    )
    placed: list[Element] = []
    for i, (e, back) in enumerate(found, 1):
        V, k, axial, before, bent = e.modes, e.stiffness, e.axial, back, vars(e.bending).values()
        if index is not None:
            V, k, axial, before = map(partial(_one, index), (V, k, axial, back), (2, 1, 0, 0))
            bent = map(partial(_one, index), bent, (2, 1, 1, 1))
        at = point
        if isinstance(before, np.ndarray) or not is_zero(before):
            at = point - rotation[..., 0] * np.asarray(before)[..., None]
        more = i % together > 0
        own = FiniteSpring(spring.name, at, rotation, V, k, axial, Bending(*bent), e.ends, more)
        vars(own)["kind"] = e.kind
        placed.append(own)
    return placed


def _one(index: Any, values: Any, own_axes: int) -> Any:
    return one_of(values, own_axes, index) if isinstance(values, np.ndarray) else values
