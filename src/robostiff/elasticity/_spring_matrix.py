"""Checks of a 6x6 stiffness or compliance that somebody wrote down or exported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robostiff.errors import InputError
from robostiff.spatial import Space, refuse_quantities

Matrix = NDArray[np.float64]

_TWIST, _WRENCH = Space.SPATIAL.twist_order, Space.SPATIAL.wrench_order

# Part of the block scale by which mirror entries may differ: more than rounding and unit
# conversion leave, less than a slip of the pen makes.
SYMMETRY_TOLERANCE = 1e-9

# Part of the largest eigenvalue, in the length-scaled metric, below which an eigenvalue is zero:
# rounding of a 6x6 leaves some 1e-15.
RANK_TOLERANCE = 1e-12


@dataclass(frozen=True)
class MatrixKind:
    """Words for one kind of 6x6 matrix."""

    name: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    unit: str

    def entry(self, matrix: Matrix, i: int, j: int) -> str:
        """One entry in words: ``[Fx, dy] = 3``."""
        return f"[{self.rows[i]}, {self.columns[j]}] = {matrix[i, j]:.10g}"


STIFFNESS = MatrixKind("stiffness matrix", rows=_WRENCH, columns=_TWIST, unit="N/m")
COMPLIANCE = MatrixKind("compliance matrix", rows=_TWIST, columns=_WRENCH, unit="m/N")


@dataclass(frozen=True)
class ScaledSpectrum:
    """Eigenvalues of ``D M D``, where D makes translations and rotations weigh alike.

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
    """The matrix as floats (6, 6), exactly symmetric; InputError for anything but rounding."""
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
