"""The formulas of a uniform cantilever, for entries of any kind, and the beam that a matrix is of.

Only ``+ - * /`` are used. Numbers give float arrays; anything else (SymPy, fractions.Fraction, a
recorder) gives object arrays with exact zeros. Nothing is validated here; `beam_compliance` and
`beam_stiffness` are the front doors for numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np

_ALIKE = 1e-9  # of an entry: what a beam's compliance may miss of the formula


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
    y_rz = L * L / (2 * E * Iz)
    z_ry = -(L * L) / (2 * E * Iy)
    return _assembled(
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
    return _assembled(
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


def _assembled(entries: dict[tuple[int, int], Any]) -> np.ndarray:
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


def uniform_beam(C: np.ndarray) -> UniformBeam | None:
    """The uniform beam that has a compliance (6, 6) about its far end; None where none has.

    Examples
    --------
    >>> beam = uniform_beam(cantilever_compliance(0.5, 2e11, 8e10, 1e-3, 1e-8, 2e-8, 2e-8))
    >>> beam.length, uniform_beam(np.eye(6)) is None
    (0.5, True)
    """
    rows = C.tolist()
    stretch, dy, dz, twist, ry, rz = diagonal = [rows[i][i] for i in range(6)]
    if not all(c > 0 for c in diagonal) or not (L := 2.0 * rows[1][5] / rz) > 0:
        return None
    shear_y, shear_z = dy / L - rz * L / 3.0, dz / L - ry * L / 3.0
    size_y, size_z = dy / L, dz / L
    if shear_y < -_ALIKE * size_y or shear_z < -_ALIKE * size_z:
        return None
    shear_y = shear_y if shear_y > _ALIKE * size_y else 0.0
    shear_z = shear_z if shear_z > _ALIKE * size_z else 0.0
    across = {(1, 5): 0.5 * L * rz, (2, 4): -0.5 * L * ry}
    for i, j in np.ndindex(6, 6):
        apart = abs(rows[i][j] - across.get((min(i, j), max(i, j)), 0.0))
        if i != j and apart > _ALIKE * math.sqrt(diagonal[i] * diagonal[j]):
            return None
    return UniformBeam(L, L / stretch, L / ry, L / rz, L / twist, shear_y, shear_z)
