"""The uniform beam that a compliance matrix is of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_ALIKE = 1e-9  # of an entry: what a beam's compliance may miss of the formula


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
    >>> from robostiff.elasticity.cantilever import cantilever_compliance
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
    expected = np.diag(diagonal)
    expected[[1, 5], [5, 1]], expected[[2, 4], [4, 2]] = 0.5 * L * rz, -0.5 * L * ry
    if np.any(np.abs(C - expected) > _ALIKE * np.sqrt(np.outer(diagonal, diagonal))):
        return None
    return UniformBeam(float(L), L / stretch, L / ry, L / rz, L / twist, shear_y, shear_z)
