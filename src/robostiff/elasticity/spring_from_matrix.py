"""Springs given by a full 6x6 matrix, of numbers (finite elements, measurements) or of formulas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robostiff.elasticity.beam import compliance_in_series
from robostiff.elasticity.checks import Bounds
from robostiff.elasticity.spring import Elasticity
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.spatial import (
    Space,
    as_floats,
    block_rotation,
    move_compliance,
    refuse_quantities,
    rotate_stiffness,
    twist_transport,
)
from robostiff.spatial.formula import Entries, exact_arrays, formula_array

_TWIST, _WRENCH = Space.SPATIAL.twist_order, Space.SPATIAL.wrench_order


@frozen
class MatrixKind:
    """Name, units and order of rows and columns of one kind of 6x6 matrix."""

    name: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    unit: str

    def entry(self, matrix: np.ndarray, i: int, j: int) -> str:
        """An entry as text: ``[Fx, dy] = 3``."""
        return f"[{self.rows[i]}, {self.columns[j]}] = {matrix[i, j]:.10g}"


STIFFNESS = MatrixKind("stiffness matrix", rows=_WRENCH, columns=_TWIST, unit="N/m")
COMPLIANCE = MatrixKind("compliance matrix", rows=_TWIST, columns=_WRENCH, unit="m/N")


def symmetric_formulas(matrix: np.ndarray, kind: MatrixKind) -> tuple[Bounds, ...]:
    """What is positive where it is semidefinite; InputError unless it is 6x6 and symmetric."""
    import sympy as sp

    if matrix.shape != (6, 6):
        raise InputError(f"shape of the {kind.name}", got=matrix.shape, expected="(6, 6)")
    for i, j in np.ndindex(6, 6):
        apart: Any = matrix[i, j] - matrix[j, i]
        # Most entries are written alike or are zero: to simplify these would take seconds.
        if apart != 0 and sp.simplify(apart) != 0:
            raise InputError(
                f"{kind.name}, entries [{kind.rows[i]}, {kind.columns[j]}] = {matrix[i, j]} and "
                f"[{kind.rows[j]}, {kind.columns[i]}] = {matrix[j, i]}",
                expected="a symmetric matrix",
            )
    expected = "no negative eigenvalue: a spring does not push in the direction it is pulled"
    bounds = []
    for block in _blocks(matrix):
        pivots: list[int] = []
        for i in block:
            rows = [*pivots, i]
            minor: Any = sp.Matrix(matrix[np.ix_(rows, rows)]).det(method="berkowitz")
            if minor.is_zero is False or sp.simplify(minor) != 0:
                names = ", ".join(kind.rows[j] for j in rows)
                words = f"determinant of the rows {names} of the {kind.name}"
                may_vanish = kind is COMPLIANCE and not pivots  # a rigid direction
                bounds.append(Bounds(words, minor, expected=expected, or_at=may_vanish))
                pivots = rows
            elif not pivots and len(block) > 1:
                entry = f"entry [{kind.rows[i]}, {kind.columns[i]}] = 0"
                raise InputError(f"{kind.name}, {entry}", expected=expected)
    return tuple(bounds)


def _from_formulas(K: np.ndarray) -> Elasticity:
    """Spring of a stiffness of formulas, block by block; of exact numbers by their floats."""
    import sympy as sp

    bounds, zero = symmetric_formulas(K, STIFFNESS), sp.Integer(0)
    C, free = np.full((6, 6), zero, dtype=object), []
    for block in _blocks(K):
        if len(block) == 1 and K[block[0], block[0]] == 0:
            free.append(block[0])
            continue
        part = sp.Matrix(K[np.ix_(block, block)])
        determinant: Any = part.det(method="berkowitz")
        if determinant.is_zero is not False and sp.simplify(determinant) == 0:
            if not any(entry.free_symbols for entry in K.flat):
                return elasticity_from_stiffness(K.astype(float))
            raise InputError(
                STIFFNESS.name,
                got=Words("formulas that leave a coupled direction free"),
                expected="a regular matrix, or free directions along the axes",
                hint="give the compliance instead, or one spring for each direction that holds",
            )
        inverse = (part.adjugate() / determinant).applyfunc(sp.cancel)
        C[np.ix_(block, block)] = np.array(inverse.tolist(), dtype=object)
    freedoms = np.full((6, len(free)), zero, dtype=object)
    freedoms[free, range(len(free))] = sp.Integer(1)
    return Elasticity(C, freedoms, bounds)


def _blocks(K: np.ndarray) -> list[list[int]]:
    """Rows that are coupled with each other, block by block."""
    entries = np.array([entry != 0 for entry in K.flat], dtype=float).reshape(K.shape)
    reached = np.linalg.matrix_power(entries + np.eye(len(K)), len(K)) != 0
    return [np.flatnonzero(row).tolist() for i, row in enumerate(reached) if np.argmax(row) == i]


Matrix = NDArray[np.float64]

# Condition of a stiffness scaled to a unit diagonal, beyond which soft and stiff directions lie
# across the axes.
_DENSE = 1e3

# Relative difference allowed between symmetric entries: more than rounding and unit
# conversion leave, less than a slip of the pen makes.
SYMMETRY_TOLERANCE = 1e-9

# Part of the largest eigenvalue, in the length-scaled metric, below which an eigenvalue is zero:
# rounding of a 6x6 leaves some 1e-15.
RANK_TOLERANCE = 1e-12


def _checked_symmetric(matrix: Any, kind: MatrixKind) -> Matrix:
    """The matrix as floats (6, 6), made exactly symmetric; InputError beyond rounding."""
    refuse_quantities(kind.name, matrix, "6x6 numbers of SI units")
    try:
        array = np.asarray(matrix, dtype=np.float64)
    except (TypeError, ValueError) as error:
        got = matrix.tolist() if isinstance(matrix, np.ndarray) else matrix
        raise InputError(kind.name, got=got, expected="6x6 numbers") from error
    if array.shape != (6, 6):
        expected = f"(6, 6), rows ({', '.join(kind.rows)}), columns ({', '.join(kind.columns)})"
        raise InputError(f"shape of the {kind.name}", got=array.shape, expected=expected)
    if not np.isfinite(array).all():
        i, j = (int(k) for k in np.argwhere(~np.isfinite(array))[0])
        subject = f"{kind.name}, entry {kind.entry(array, i, j)}"
        raise InputError(subject, expected="a finite number")

    magnitude = np.abs(array)
    block = np.sqrt([magnitude[:3, :3].max(), magnitude[3:, 3:].max()]).repeat(3)
    excess = np.abs(array - array.T) - SYMMETRY_TOLERANCE * np.outer(block, block)
    i, j = (int(k) for k in np.unravel_index(excess.argmax(), (6, 6)))
    if excess[i, j] > 0:
        raise InputError(
            f"{kind.name}, entries {kind.entry(array, i, j)} and {kind.entry(array, j, i)}",
            expected="a symmetric matrix",
            hint=f"rows are ({', '.join(kind.rows)}), columns ({', '.join(kind.columns)}); "
            "the scatter of a measurement is averaged by (M + M.T) / 2",
        )
    return (array + array.T) / 2


def _scaled_spectrum(matrix: Matrix, kind: MatrixKind) -> tuple[Matrix, Matrix, Matrix, float]:
    """Diagonal (6,) of D, eigenvalues (6,) of ``D M D`` [N/m or m/N], ascending, and their vectors.

    D is 1 for translations; for rotations 1/l (stiffness) or l (compliance), with l the length that
    gives both diagonal blocks of ``D M D`` one trace. The last number is that up to which
    eigenvalues are zero. Raises InputError if one is negative.
    """
    translation, rotation = np.trace(matrix[:3, :3]), np.trace(matrix[3:, 3:])
    # A block of trace zero leaves nothing to scale, if the matrix is semidefinite at all.
    factor = np.sqrt(translation / rotation) if translation > 0 and rotation > 0 else 1.0
    scale = np.array([1.0, 1.0, 1.0, factor, factor, factor])
    values, vectors = np.linalg.eigh(scale[:, None] * matrix * scale)
    zero = RANK_TOLERANCE * float(np.abs(values).max())
    if values[0] < -zero:
        length = 1 / factor if kind is STIFFNESS else factor
        # The large components of the direction, largest first: 0.80 dx - 0.60 rz.
        first = vectors[:, 0]
        order = np.argsort(-np.abs(first), kind="stable")
        parts = first[order] / np.sign(first[order[0]])
        large = [k for k in range(6) if abs(parts[k]) >= 0.2 * parts[0]]
        names = [kind.columns[order[k]] for k in large]
        words = [f"{'-' if parts[k] < 0 else '+'} {abs(parts[k]):.2f}" for k in large]
        direction = " ".join(f"{size} {name}" for size, name in zip(words, names, strict=True))
        direction = names[0] if len(names) == 1 else direction.removeprefix("+ ")
        raise InputError(
            f"{kind.name}, eigenvalue {values[0]:.4g} {kind.unit} along {direction} "
            f"(rotations scaled by {length:.3g} m)",
            expected="no negative eigenvalue: a spring does not push in the direction it is pulled",
            hint="look for a wrong sign, a wrong unit in the rotation rows, or missing digits",
        )
    return scale, values, vectors, zero


_ROTATION = "a 3x3 rotation matrix, its columns the axes of the spring in those of the element"


def elasticity_from_stiffness(stiffness: Any) -> Elasticity:
    """Spring of a 6x6 stiffness K: ``compliance = K^-1``, or ``K^+`` with ``freedoms = null(K)``.

    Parameters
    ----------
    stiffness : (6, 6) array
        Symmetric positive semidefinite [N/m, N/rad, N m/rad]; wrench (Fx, Fy, Fz, Mx, My, Mz) for a
        twist (dx, dy, dz, rx, ry, rz).

    Returns
    -------
    Elasticity
        Each freedom has one component, its own, of one metre or one radian.

    Raises
    ------
    InputError
        Not 6x6; not finite; not symmetric beyond 1e-9 of its block; a negative eigenvalue; a lone
        stiffness too small beside the others to be distinguished from a free direction.

    Notes
    -----
    Rank is decided by the eigenvalues of ``D K D``, D = diag(1, 1, 1, 1/l, 1/l, 1/l), with the
    characteristic length ``l = sqrt(trace K_rr / trace K_tt)``: those up to 1e-12 of the largest
    are zero. So metres and millimetres decide alike. A singular K gives the pseudo-inverse in this
    metric, ``D (D K D)^+ D``. Another metric would change the compliance by motions along the
    freedoms only, on which no wrench that the spring can carry does work.

    Examples
    --------
    A rubber block that turns freely about z:

    >>> spring = elasticity_from_stiffness(np.diag([1e5, 1e5, 4e5, 200, 200, 0]))
    >>> np.diag(spring.compliance)
    array([1.0e-05, 1.0e-05, 2.5e-06, 5.0e-03, 5.0e-03, 0.0e+00])
    >>> spring.freedoms.T
    array([[0., 0., 0., 0., 0., 1.]])
    """
    formulas = formula_array(stiffness)
    if formulas is not None:
        return _from_formulas(formulas)
    K = _checked_symmetric(stiffness, STIFFNESS)
    scale, values, vectors, zero = _scaled_spectrum(K, STIFFNESS)
    stiff = values > zero
    if stiff.all():
        # Scaled to a unit diagonal, so that units and sizes do not matter.
        size = np.sqrt(np.diagonal(K))
        unit = K / np.outer(size, size)
        inverse = np.linalg.inv(unit)
        found = Elasticity((inverse + inverse.T) / 2 / np.outer(size, size))
        if np.linalg.cond(unit) > _DENSE:
            # The inverse keeps few digits of its stiff directions; a root of K keeps them.
            vars(found)["modes"] = np.linalg.inv(np.linalg.cholesky(unit)).T / size[:, None]
        return found
    # A lone entry of the diagonal below the threshold may be soft, or meant to be free.
    diagonal = scale**2 * np.diagonal(K)
    lone = (np.count_nonzero(K, axis=1) == 1) & (diagonal > 0)
    for i in np.flatnonzero(lone & (diagonal <= zero)).tolist():
        largest = int(diagonal.argmax())
        raise InputError(
            f"{STIFFNESS.name}, entry {STIFFNESS.entry(K, i, i)} beside "
            f"{STIFFNESS.entry(K, largest, largest)}",
            expected=f"a ratio above {RANK_TOLERANCE:g}, between a soft direction and a free one",
            hint="write 0 for a free direction; for a rigid one give the compliance, with a 0 "
            "there: elasticity_from_compliance(C)",
        )
    basis, free = (scale[:, None] * vectors[:, kind] for kind in (stiff, ~stiff))
    compliance = (basis / values[stiff]) @ basis.T
    freedoms = free @ np.linalg.inv(free[_leading_rows(vectors[:, ~stiff])])
    return Elasticity((compliance + compliance.T) / 2, freedoms)


def elasticity_from_compliance(compliance: Any) -> Elasticity:
    """Spring of a 6x6 compliance C; directions of zero compliance are rigid.

    Parameters
    ----------
    compliance : (6, 6) array
        Symmetric positive semidefinite [m/N, rad/N, rad/(N m)]; twist (dx, dy, dz, rx, ry, rz) for
        a wrench (Fx, Fy, Fz, Mx, My, Mz).

    Returns
    -------
    Elasticity
        Without freedoms.

    Raises
    ------
    InputError
        Not 6x6; not finite; not symmetric beyond 1e-9 of its block; a negative eigenvalue.

    Notes
    -----
    A negative eigenvalue counts beyond 1e-12 of the largest one of ``D C D``,
    D = diag(1, 1, 1, l, l, l), with the characteristic length
    ``l = sqrt(trace C_tt / trace C_rr)``.

    Examples
    --------
    >>> elasticity_from_compliance(np.diag([1e-8, 1e-8, 2e-8, 0, 0, 0])).freedoms.shape
    (6, 0)
    """
    formulas = formula_array(compliance)
    if formulas is not None:
        return Elasticity(formulas, bounds=symmetric_formulas(formulas, COMPLIANCE))
    C = _checked_symmetric(compliance, COMPLIANCE)
    _scaled_spectrum(C, COMPLIANCE)
    return Elasticity(C)


# Of its size: by what the compliance of a spring may miss that of its segments.
_TOGETHER = 1e-6


def with_segments(elasticity: Elasticity, segments: Sequence[ArrayLike]) -> Elasticity:
    """The elasticity of a beam along x, with compliances (6, 6) of its uniform segments.

    From its start on, each about its own far end.

    Raises
    ------
    InputError
        When one is of no uniform beam along x, or they are not together that of the spring.

    Examples
    --------
    >>> half = np.diag([1, 1 / 3, 1 / 3, 1, 1, 1])
    >>> half[1, 5] = half[5, 1] = 0.5
    >>> half[2, 4] = half[4, 2] = -0.5
    >>> with_segments(Elasticity(half), [half]).beams[0].length
    1.0
    """
    each = tuple(elasticity_from_compliance(segment).compliance for segment in segments)
    found, C = replace(elasticity, segments=each), elasticity.compliance
    lengths, sizes = [beam.length for beam in found.beams], np.sqrt(np.diagonal(C))
    apart = np.abs(compliance_in_series(each, lengths) - C) if lengths else np.inf
    if np.any(apart > _TOGETHER * np.outer(sizes, sizes)):
        expected = "compliances of uniform beams along x that are together that of the spring"
        raise InputError("segments of the spring", expected=expected)
    return found


def in_element_axes(elasticity: Elasticity, rotation: Entries, offset: Entries) -> Elasticity:
    """The same spring in the axes and about the point of the element that contains it.

    ``C = J B C_spring B^T J^T`` and ``freedoms = J B freedoms_spring``, with ``B = diag(R, R)`` and
    ``J = [[I, -(v x)], [0, I]]``.

    Parameters
    ----------
    elasticity : Elasticity
        In the axes and about the point E where it was measured or computed.
    rotation : (3, 3) array
        R, its columns the axes of the spring in the axes of the element.
    offset : (3,) array
        v = P - E, from the point E of the spring to the point P of the element [m], in the axes of
        the element.

    Raises
    ------
    InputError
        The rotation is not a proper rotation, or the offset is not three finite numbers.

    Examples
    --------
    A hinge spring about z seen from a point 2 m along x, which its turns carry along y:

    >>> hinge = Elasticity(np.diag([0, 0, 0, 0, 0, 0.01]))
    >>> in_element_axes(hinge, rotation=np.eye(3), offset=[2, 0, 0]).compliance[1, 1]
    np.float64(0.04)
    """
    R = formula_array(rotation)
    if R is None:
        subject, expected = "rotation of the spring", _ROTATION
        R = as_floats(subject, rotation, expected, shape=(3, 3))
        error = float(np.abs(R.T @ R - np.eye(3)).max())
        if error > 1e-9:
            raise InputError(f"{subject}, R^T R off the identity by {error:.3g}", expected=expected)
        if np.linalg.det(R) < 0:
            hint = "these axes are left-handed: reverse one of them"
            raise InputError(f"{subject}, determinant -1", expected=expected, hint=hint)
    v = formula_array(offset)
    if v is None:
        v = as_floats("offset of the spring", offset, "three finite numbers [m]", "m", (3,))
    C, freedoms, R, v = exact_arrays(elasticity.compliance, elasticity.freedoms, R, v)
    return Elasticity(
        move_compliance(rotate_stiffness(C, R), v),
        twist_transport(v) @ block_rotation(R) @ freedoms,
        elasticity.bounds,
    )


def _leading_rows(basis: Matrix) -> NDArray[np.intp]:
    """Rows (k,) in which the columns of a basis (6, k) are most independent: pivots of QR."""
    rest = basis
    rows = np.zeros(basis.shape[1], dtype=np.intp)
    for k in range(len(rows)):
        squares = (rest**2).sum(axis=1)
        rows[k] = squares.argmax()
        along = rest[rows[k]] / np.sqrt(squares[rows[k]])
        rest = rest - np.outer(rest @ along, along)
    return np.sort(rows)
