"""Checks of a 6x6 stiffness or compliance, of numbers or of formulas."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robostiff.errors import InputError
from robostiff.spatial import Space, refuse_quantities

Matrix = NDArray[np.float64]

_TWIST, _WRENCH = Space.SPATIAL.twist_order, Space.SPATIAL.wrench_order

# Relative difference allowed between symmetric entries: more than rounding and unit
# conversion leave, less than a slip of the pen makes.
SYMMETRY_TOLERANCE = 1e-9

# Part of the largest eigenvalue, in the length-scaled metric, below which an eigenvalue is zero:
# rounding of a 6x6 leaves some 1e-15.
RANK_TOLERANCE = 1e-12


@dataclass(frozen=True)
class MatrixKind:
    """Name, units and order of rows and columns of one kind of 6x6 matrix."""

    name: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    unit: str

    def entry(self, matrix: Matrix, i: int, j: int) -> str:
        """An entry as text: ``[Fx, dy] = 3``."""
        return f"[{self.rows[i]}, {self.columns[j]}] = {matrix[i, j]:.10g}"


STIFFNESS = MatrixKind("stiffness matrix", rows=_WRENCH, columns=_TWIST, unit="N/m")
COMPLIANCE = MatrixKind("compliance matrix", rows=_TWIST, columns=_WRENCH, unit="m/N")


@dataclass(frozen=True)
class ScaledSpectrum:
    """Eigenvalues of ``D M D``, where D scales rotations to translations.

    Attributes
    ----------
    scale : (6,) array
        Diagonal of D: 1 for translations; for rotations 1/l (stiffness) or l (compliance), with l
        the characteristic length that gives both diagonal blocks of ``D M D`` one trace.
    values : (6,) array
        Eigenvalues [N/m] or [m/N], ascending.
    vectors : (6, 6) array
        Their eigenvectors, in columns.
    """

    scale: Matrix
    values: Matrix
    vectors: Matrix

    @property
    def threshold(self) -> float:
        """Eigenvalues up to this one are zero."""
        return RANK_TOLERANCE * float(np.abs(self.values).max())


def checked_symmetric(matrix: Any, kind: MatrixKind) -> Matrix:
    """The matrix as floats (6, 6), made exactly symmetric; InputError beyond rounding."""
    refuse_quantities(kind.name, matrix, "6x6 numbers of SI units")
    try:
        array = np.asarray(matrix, dtype=np.float64)
    except (TypeError, ValueError) as error:
        got = matrix.tolist() if isinstance(matrix, np.ndarray) else matrix
        raise InputError(kind.name, got=got, expected="6x6 numbers") from error
    if array.shape != (6, 6):
        raise InputError(
            f"shape of the {kind.name}",
            got=array.shape,
            expected=f"(6, 6), rows ({', '.join(kind.rows)}), columns ({', '.join(kind.columns)})",
        )
    if not np.isfinite(array).all():
        i, j = (int(k) for k in np.argwhere(~np.isfinite(array))[0])
        raise InputError(
            f"{kind.name}, entry {kind.entry(array, i, j)}", expected="a finite number"
        )

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


def scaled_spectrum(matrix: Matrix, kind: MatrixKind) -> ScaledSpectrum:
    """Eigenvalues in the length-scaled metric; InputError if one is negative."""
    translation, rotation = np.trace(matrix[:3, :3]), np.trace(matrix[3:, 3:])
    # A block of trace zero leaves nothing to scale, if the matrix is semidefinite at all.
    factor = np.sqrt(translation / rotation) if translation > 0 and rotation > 0 else 1.0
    scale = np.array([1.0, 1.0, 1.0, factor, factor, factor])
    values, vectors = np.linalg.eigh(scale[:, None] * matrix * scale)
    spectrum = ScaledSpectrum(scale, values, vectors)
    if values[0] < -spectrum.threshold:
        length = 1 / factor if kind is STIFFNESS else factor
        direction = _in_words(vectors[:, 0], kind.columns)
        raise InputError(
            f"{kind.name}, eigenvalue {values[0]:.4g} {kind.unit} along {direction} "
            f"(rotations scaled by {length:.3g} m)",
            expected="no negative eigenvalue: a spring does not push in the direction it is pulled",
            hint="look for a wrong sign, a wrong unit in the rotation rows, or missing digits",
        )
    return spectrum


def _in_words(vector: Matrix, names: tuple[str, ...]) -> str:
    """The large components of a direction, largest first: ``0.80 dx - 0.60 rz``."""
    order = np.argsort(-np.abs(vector), kind="stable")
    large = [k for k in order if abs(vector[k]) >= 0.2 * abs(vector[order[0]])]
    sign = 1.0 if vector[large[0]] > 0 else -1.0
    if len(large) == 1:
        return names[large[0]]
    words = f"{abs(vector[large[0]]):.2f} {names[large[0]]}"
    for k in large[1:]:
        words += f" {'+' if sign * vector[k] > 0 else '-'} {abs(vector[k]):.2f} {names[k]}"
    return words


def symmetric_formulas(matrix: np.ndarray, kind: MatrixKind) -> np.ndarray:
    """The matrix itself; InputError unless it is 6x6, symmetric, and may be semidefinite."""
    import sympy as sp

    if matrix.shape != (6, 6):
        raise InputError(f"shape of the {kind.name}", got=matrix.shape, expected="(6, 6)")
    for i, j in np.ndindex(6, 6):
        difference: Any = matrix[i, j] - matrix[j, i]
        if sp.simplify(difference) != 0:
            raise InputError(
                f"{kind.name}, entries [{kind.rows[i]}, {kind.columns[j]}] = {matrix[i, j]} and "
                f"[{kind.rows[j]}, {kind.columns[i]}] = {matrix[j, i]}",
                expected="a symmetric matrix",
            )
    for i in range(6):
        if matrix[i, i].is_negative or (matrix[i, i] == 0 and any(matrix[i] != 0)):
            raise InputError(
                f"{kind.name}, entry [{kind.rows[i]}, {kind.columns[i]}] = {matrix[i, i]}",
                expected="no negative eigenvalue: a spring does not push in the direction it is "
                "pulled",
            )
    return matrix


def inverse_of_formulas(K: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Compliance (6, 6) and freedoms (6, k) of a stiffness; None where a coupled block is singular.

    Directions that no entry couples are taken block by block; a row of zeros is a freedom.
    """
    import sympy as sp

    zero = sp.Integer(0)
    C, free = np.full((6, 6), zero, dtype=object), []
    for block in _blocks(K):
        if len(block) == 1 and K[block[0], block[0]] == 0:
            free.append(block[0])
            continue
        part = sp.Matrix(K[np.ix_(block, block)])
        determinant: Any = part.det(method="berkowitz")
        if sp.simplify(determinant) == 0:
            return None
        inverse = part.inv(method="ADJ").applyfunc(sp.cancel)
        C[np.ix_(block, block)] = np.array(inverse.tolist(), dtype=object)
    freedoms = np.full((6, len(free)), zero, dtype=object)
    for column, row in enumerate(free):
        freedoms[row, column] = sp.Integer(1)
    return C, freedoms


def _blocks(K: np.ndarray) -> list[list[int]]:
    """Rows that are coupled with each other, block by block."""
    left, blocks = list(range(6)), []
    while left:
        block: list[int] = []
        reached: list[Any] = [left[0]]
        while reached:
            i = reached.pop()
            if i in left:
                left.remove(i)
                block.append(i)
                reached += [j for j in left if K[i, j] != 0]
        blocks.append(sorted(block))
    return blocks
