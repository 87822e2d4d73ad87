"""Compliance and stiffness of beams, uniform and tapered, and the beam theories.

`cantilever_compliance` and `cantilever_stiffness` are formulas for entries of any kind, of
``+ - * /`` alone: numbers give float arrays, anything else (SymPy, fractions.Fraction, a recorder)
object arrays with exact zeros. They validate nothing; `beam_compliance` and `beam_stiffness` do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from numbers import Integral
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robostiff.elasticity.checks import positive_numbers
from robostiff.elasticity.material import Material
from robostiff.elasticity.shapes import CrossSection
from robostiff.errors import InputError
from robostiff.frozen import frozen
from robostiff.spatial import exact_number, move_compliance
from robostiff.spatial.formula import exact_arrays, exact_together, is_formula

_ALIKE = 1e-9  # of an entry: what a beam's compliance may miss of the formula
# EA over k G A of a beam is 2 to 9, and some 30 of one of fibres along it; more is a taper
_SHEARED = 50.0


def cantilever_compliance(
    L: Any,
    E: Any,
    G: Any,
    A: Any,
    Iy: Any,
    Iz: Any,
    J: Any,
    shear_y: Any = None,
    shear_z: Any = None,
) -> np.ndarray:
    """Tip compliance of a uniform beam clamped at its base, x along the beam.

    ``diag(L/EA, L^3/3EIz + L/(ky G A), L^3/3EIy + L/(kz G A), L/GJ, L/EIy, L/EIz)`` with
    ``C[y, rz] = +L^2/2EIz`` and ``C[z, ry] = -L^2/2EIy``.

    Parameters
    ----------
    L, E, G, A, Iy, Iz, J : number, array (...) or symbol
        Length [m], moduli [Pa], area [m^2], second moments and torsion constant [m^4].
    shear_y, shear_z : number, array (...), symbol or None
        Shear correction factors ky, kz []; None leaves the shear term out (Euler-Bernoulli).

    Returns
    -------
    (..., 6, 6) array
        Compliance [m/N, rad/N, rad/(N m)]: twist (dx, dy, dz, rx, ry, rz) of the tip for a wrench
        (Fx, Fy, Fz, Mx, My, Mz) at the tip.

    Notes
    -----
    J. S. Przemieniecki, Theory of Matrix Structural Analysis, McGraw-Hill 1968, section 5.6, whose
    parameter of shear is ``phi = 12 E I / (k G A L^2)``.

    Examples
    --------
    >>> from fractions import Fraction
    >>> cantilever_compliance(Fraction(2), 3, 1, 1, 1, 1, 1)[1, [1, 5]].tolist()
    [Fraction(8, 9), Fraction(2, 3)]
    """
    L, E, G, A, Iy, Iz, J = map(_plain, (L, E, G, A, Iy, Iz, J))
    y = L * L * L / (3 * E * Iz)
    z = L * L * L / (3 * E * Iy)
    if shear_y is not None:
        y = y + L / (_plain(shear_y) * G * A)
    if shear_z is not None:
        z = z + L / (_plain(shear_z) * G * A)
    # Before the others: printed formulas have their steps in this order.
    y_rz, z_ry = L * L / (2 * E * Iz), -(L * L) / (2 * E * Iy)
    return _symmetric(
        {
            (0, 0): L / (E * A),
            (1, 1): y,
            (2, 2): z,
            (3, 3): L / (G * J),
            (4, 4): L / (E * Iy),
            (5, 5): L / (E * Iz),
            (1, 5): y_rz,
            (2, 4): z_ry,
        }
    )


def cantilever_stiffness(
    L: Any,
    E: Any,
    G: Any,
    A: Any,
    Iy: Any,
    Iz: Any,
    J: Any,
    shear_y: Any = None,
    shear_z: Any = None,
) -> np.ndarray:
    """Inverse of `cantilever_compliance` in closed form.

    ``diag(EA/L, 12EIz/(L^3 (1+p)), 12EIy/(L^3 (1+q)), GJ/L, (4+q)EIy/(L (1+q)),
    (4+p)EIz/(L (1+p)))`` with ``K[y, rz] = -6EIz/(L^2 (1+p))``, ``K[z, ry] = +6EIy/(L^2 (1+q))``,
    and the parameters of shear ``p = 12EIz/(ky G A L^2)``, ``q = 12EIy/(kz G A L^2)``, zero
    without shear.

    Parameters
    ----------
    L, E, G, A, Iy, Iz, J, shear_y, shear_z
        As for `cantilever_compliance`.

    Returns
    -------
    (..., 6, 6) array
        Stiffness [N/m, N/rad, N m/rad] of the tip, base clamped.

    Examples
    --------
    >>> from fractions import Fraction
    >>> cantilever_stiffness(Fraction(2), 3, 1, 1, 1, 1, 1)[1, [1, 5]].tolist()
    [Fraction(9, 2), Fraction(-9, 2)]
    """
    L, E, G, A, Iy, Iz, J = map(_plain, (L, E, G, A, Iy, Iz, J))
    p = 0 if shear_y is None else 12 * E * Iz / (_plain(shear_y) * G * A * L * L)
    q = 0 if shear_z is None else 12 * E * Iy / (_plain(shear_z) * G * A * L * L)
    return _symmetric(
        {
            (0, 0): E * A / L,
            (1, 1): 12 * E * Iz / (L * L * L * (1 + p)),
            (2, 2): 12 * E * Iy / (L * L * L * (1 + q)),
            (3, 3): G * J / L,
            (4, 4): (4 + q) * E * Iy / (L * (1 + q)),
            (5, 5): (4 + p) * E * Iz / (L * (1 + p)),
            (1, 5): -6 * E * Iz / (L * L * (1 + p)),
            (2, 4): 6 * E * Iy / (L * L * (1 + q)),
        }
    )


def _plain(value: Any) -> Any:
    """NumPy numbers as floats, since its integers overflow; other values unchanged."""
    if isinstance(value, np.ndarray):
        return value if value.dtype == object else value.astype(np.float64)
    # A Python integer is kept: it is exact with fractions and symbols, and cannot overflow.
    return float(value) if isinstance(value, (np.floating, np.integer)) else value


def _symmetric(entries: dict[tuple[int, int], Any]) -> np.ndarray:
    """The symmetric array (..., 6, 6) with these entries on and above its diagonal."""
    for place, entry in entries.items():
        if not isinstance(entry, np.ndarray):
            is_number = isinstance(entry, (float, np.number, Integral))
            # Filled, not converted: some symbolic types look like sequences to NumPy.
            entries[place] = np.empty((), dtype=np.float64 if is_number else object)
            entries[place][()] = entry
    shape = np.broadcast_shapes(*(cell.shape for cell in entries.values()))
    numeric = all(cell.dtype == np.float64 for cell in entries.values())
    matrix = np.zeros((*shape, 6, 6), dtype=np.float64 if numeric else object)
    for (i, j), entry in entries.items():
        matrix[..., i, j] = matrix[..., j, i] = entry
    return matrix


@frozen
class UniformBeam:
    """A uniform beam, known by its compliance (..., 6, 6): x along it, clamped at its start."""

    length: Any  #: [m]
    EA: Any  #: [N]
    EIy: Any  #: [N m^2]
    EIz: Any  #: [N m^2]
    GJ: Any  #: [N m^2]
    shear_y: Any  #: shear compliance of a length [1/N]; 0 without shear
    shear_z: Any  #: likewise


def uniform_beam(C: np.ndarray, *, is_one: bool = False) -> UniformBeam | None:
    """The uniform beam that has a compliance (..., 6, 6) about its far end; None where none has.

    Unless it is known that C `is_one` of a beam, shear must not deform it more than that of any
    material and shape: the compliance of a beam that is thinner at its end is that of a shorter
    beam, soft in shear.

    Examples
    --------
    >>> beam = uniform_beam(cantilever_compliance(0.5, 2e11, 8e10, 1e-3, 1e-8, 2e-8, 2e-8))
    >>> beam.length, uniform_beam(np.eye(6)) is None
    (0.5, True)
    """
    diagonal = np.moveaxis(np.diagonal(C, axis1=-2, axis2=-1), -1, 0)
    stretch, dy, dz, twist, ry, rz = diagonal
    if not (np.all(diagonal > 0) and np.all(C[..., 1, 5] > 0)):
        return None
    L = 2.0 * C[..., 1, 5] / rz
    size_y, size_z = dy / L, dz / L
    shear_y, shear_z = size_y - rz * L / 3.0, size_z - ry * L / 3.0
    if np.any(shear_y < -_ALIKE * size_y) or np.any(shear_z < -_ALIKE * size_z):
        return None
    if not is_one and np.any(np.maximum(shear_y, shear_z) * L > _SHEARED * stretch):
        return None
    shear_y = np.where(shear_y > _ALIKE * size_y, shear_y, 0.0)
    shear_z = np.where(shear_z > _ALIKE * size_z, shear_z, 0.0)
    apart, size = np.array(C), np.sqrt(diagonal)
    for i, j, across in ((1, 5, 0.5 * L * rz), (2, 4, -0.5 * L * ry)):
        apart[..., i, j] -= across
        apart[..., j, i] -= across
    apart[..., range(6), range(6)] = 0.0
    if np.any(_ALIKE * size[:, None] * size < np.abs(apart).T):
        return None
    found = L, L / stretch, L / ry, L / rz, L / twist, shear_y, shear_z
    return UniformBeam(*(found if C.ndim > 2 else map(float, found)))


@runtime_checkable
class BeamTheory(Protocol):
    """A beam theory: which shear correction factors of a cross-section it uses."""

    def shear_factors(self, section: CrossSection) -> tuple[float | None, float | None]:
        """Shear correction factors along y and z []; None where shear does not deform the beam."""
        ...


@frozen
class EulerBernoulli:
    """Slender beams: cross-sections stay normal to the axis, shear does not deform the beam.

    Examples
    --------
    >>> EulerBernoulli().shear_factors(CrossSection(1.0, 1.0, 1.0, 1.0, 0.85, 0.85))
    (None, None)
    """

    def shear_factors(self, section: CrossSection) -> tuple[None, None]:
        """None and None for every section."""
        return None, None


@frozen
class Timoshenko:
    """Stubby beams: shear adds ``L / (ky G A)`` to C[y, y] and ``L / (kz G A)`` to C[z, z].

    Of the tip deflection of a steel bar of length L and diameter d, shear is 0.5 % at L = 10 d and
    2 % at L = 5 d.

    Examples
    --------
    >>> Timoshenko().shear_factors(CrossSection(1.0, 1.0, 1.0, 1.0, 0.85, 0.44))
    (0.85, 0.44)
    """

    def shear_factors(self, section: CrossSection) -> tuple[float, float]:
        """The factors of the section.

        Raises
        ------
        InputError
            The section has none.
        """
        ky, kz = section.shear_factor_y, section.shear_factor_z
        if ky is None or kz is None:
            raise InputError(
                "shear correction factors of the cross-section",
                got=(ky, kz),
                expected="two numbers, as the Timoshenko theory needs them",
                hint="write CrossSection(..., shear_factor_y=0.85, shear_factor_z=0.85), take a "
                "shape such as tube(...), or leave shear out with EulerBernoulli()",
            )
        return ky, kz


#: The default theory.
DEFAULT_THEORY = EulerBernoulli()


def beam_compliance(
    length: ArrayLike, material: Material, section: CrossSection, theory: BeamTheory | None = None
) -> NDArray[np.float64]:
    """Tip compliance of a beam clamped at its base, in its own axes.

    ``diag(L/EA, L^3/3EIz, L^3/3EIy, L/GJ, L/EIy, L/EIz)`` with ``C[y, rz] = +L^2/2EIz`` and
    ``C[z, ry] = -L^2/2EIy``, x along the beam, y and z principal; `Timoshenko` adds
    ``L/(ky G A)`` to C[y, y] and ``L/(kz G A)`` to C[z, z].

    Parameters
    ----------
    length : float, formula or (...) array
        Length L [m]; an array gives one matrix for each length (telescopic legs).
    material : Material
        Moduli E and G.
    section : CrossSection
        A, Iy, Iz, J and shear factors.
    theory : BeamTheory, optional
        `EulerBernoulli()`, the default, or `Timoshenko()`.

    Returns
    -------
    (..., 6, 6) array
        Compliance [m/N, rad/N, rad/(N m)] of the tip, symmetric positive definite; objects when
        any of the numbers is a formula.

    Raises
    ------
    InputError
        A length is not positive and finite; `Timoshenko` without shear factors.

    Notes
    -----
    J. S. Przemieniecki, Theory of Matrix Structural Analysis, McGraw-Hill 1968, section 5.6.

    Examples
    --------
    One metre of steel bar, 20 mm thick, under 100 N across its tip [mm]:

    >>> from robostiff.elasticity import beam_compliance, circle, material
    >>> C = beam_compliance(1.0, material("steel"), circle(0.020))
    >>> round(float(C[1, 1]) * 100 * 1e3, 3)
    20.21
    """
    return _by(cantilever_compliance, length, material, section, theory)


def beam_stiffness(
    length: ArrayLike, material: Material, section: CrossSection, theory: BeamTheory | None = None
) -> NDArray[np.float64]:
    """Tip stiffness of a beam clamped at its base, the inverse of `beam_compliance`.

    ``K[y, y] = 12EIz/(L^3 (1+p))``, ``K[rz, rz] = (4+p)EIz/(L (1+p))``,
    ``K[y, rz] = -6EIz/(L^2 (1+p))`` with ``p = 12EIz/(ky G A L^2)``, alike for z.

    Parameters
    ----------
    length, material, section, theory
        As for `beam_compliance`.

    Returns
    -------
    (..., 6, 6) array
        Stiffness [N/m, N/rad, N m/rad] of the tip, symmetric positive definite.

    Raises
    ------
    InputError
        As for `beam_compliance`.

    Examples
    --------
    >>> from robostiff.elasticity import beam_stiffness, circle, material
    >>> float(round(beam_stiffness(1.0, material("steel"), circle(0.020))[0, 0]))
    65973446.0
    """
    return _by(cantilever_stiffness, length, material, section, theory)


def _by(
    matrix: Callable[..., np.ndarray], length: ArrayLike, material: Any, section: Any, theory: Any
) -> np.ndarray:
    if not isinstance(material, Material):
        hint = 'write material("steel") or Material.isotropic(name, E, poisson_ratio, source)'
        raise InputError("material of the beam", got=material, expected="a Material", hint=hint)
    if not isinstance(section, CrossSection):
        subject = "cross-section of the beam"
        hint = "write tube(outer_diameter, inner_diameter) or another shape"
        raise InputError(subject, got=section, expected="a CrossSection", hint=hint)
    L = positive_numbers("length of the beam", length, "m")
    s = section
    factors = (theory or DEFAULT_THEORY).shear_factors(section)
    numbers = (material.E, material.G, s.A, s.Iy, s.Iz, s.J, *factors)
    try:
        return matrix(*exact_together(L, *numbers))
    except ZeroDivisionError:  # products of floats that are below all numbers
        return np.full((6, 6), np.inf)


@frozen
class SlenderBeam:
    """What the compliance of a uniform beam is made of, in the theory of Euler and Bernoulli.

    Numbers or formulas, as `beam_compliance` takes them.
    """

    length: Any
    E: Any
    G: Any
    A: Any
    Iy: Any
    Iz: Any
    J: Any
    material: str  #: its name

    @classmethod
    def of(
        cls, length: Any, material: Material, section: CrossSection, theory: BeamTheory | None
    ) -> SlenderBeam | None:
        """That of a beam; None where shear deforms it."""
        if not isinstance(theory or DEFAULT_THEORY, EulerBernoulli):
            return None
        m, s = material, section
        L, E, G, A, Iy, Iz, J = exact_together(length, m.E, m.G, s.A, s.Iy, s.Iz, s.J)
        return cls(L, E, G, A, Iy, Iz, J, m.name)


class BeamSegment(NamedTuple):
    """A uniform piece of a beam.

    Attributes
    ----------
    length : float or (...) array
        Length [m].
    material : Material
        What it is made of.
    section : CrossSection
        Its cross-section, with the axes of all the others.
    """

    length: ArrayLike
    material: Material
    section: CrossSection


def tapered_compliance(
    segments: Sequence[BeamSegment | tuple[ArrayLike, Material, CrossSection]],
    theory: BeamTheory | None = None,
) -> NDArray[np.float64]:
    """Tip compliance of a beam made of uniform segments, base clamped, centroids on one line.

    ``C = sum over segments of J C_segment J^T``, ``J = [[I, -(v x)], [0, I]]``, v from the tip of
    the segment to the tip of the beam.

    Parameters
    ----------
    segments : sequence of (length, material, section)
        From base to tip. For a smooth taper the error falls with the square of the
        number of segments, each given the cross-section at its middle.
    theory : BeamTheory, optional
        `EulerBernoulli()`, the default, or `Timoshenko()`.

    Returns
    -------
    (..., 6, 6) array
        Compliance [m/N, rad/N, rad/(N m)] of the tip, in the axes of the beam.

    Raises
    ------
    InputError
        No segment; something that is not a segment; or as for `beam_compliance`.

    Examples
    --------
    Two halves make the whole:

    >>> from robostiff.elasticity import beam_compliance, circle, material
    >>> half = BeamSegment(0.5, material("steel"), circle(0.020))
    >>> whole = beam_compliance(1.0, half.material, half.section)
    >>> bool(np.allclose(tapered_compliance([half, half]), whole, rtol=1e-14, atol=0))
    True
    """
    if len(segments) == 0:
        raise InputError("segments of the beam", got=segments, expected="at least one segment")
    compliances, lengths = [], []
    for index, segment in enumerate(segments):
        subject = f"segment {index} of the beam"
        if not (isinstance(segment, tuple) and len(segment) == 3):
            raise InputError(subject, got=segment, expected="(length, material, section)")
        lengths.append(positive_numbers(f"length of {subject}", segment[0], "m"))
        compliances.append(beam_compliance(lengths[-1], *segment[1:], theory))
    return compliance_in_series(exact_arrays(*compliances), lengths)


def shear_compliance(segments: Sequence[BeamSegment]) -> NDArray[np.float64] | None:
    """Compliances (2,) that shear adds across the tip of a beam, ``sum L / (k G A)`` [m/N].

    Along y and along z; None of formulas, and without shear correction factors.
    """
    rows = [
        (length, material.G, section.A, k)
        for length, material, section in segments
        for k in (section.shear_factor_y, section.shear_factor_z)
    ]
    if any(x is None or is_formula(x) for row in rows for x in row):
        return None
    L, G, A, k = np.array(rows, dtype=np.float64).T
    return np.sum((L / (k * G * A)).reshape(-1, 2), axis=0)


def compliance_in_series(
    compliances: Sequence[NDArray[Any]], lengths: Sequence[Any]
) -> NDArray[Any]:
    """Tip compliance of uniform segments with these compliances (..., 6, 6) and lengths [m]."""
    total: NDArray[Any] | None = None
    to_tip: Any = np.zeros((), dtype=compliances[0].dtype)
    for C, length in zip(reversed(compliances), reversed(lengths), strict=True):
        moved = move_compliance(C, np.stack([to_tip, 0 * to_tip, 0 * to_tip], axis=-1))
        total = moved if total is None else total + moved
        to_tip = to_tip + (exact_number(length) if C.dtype == object else np.asarray(length))
    return np.asarray(total)
