"""Measures of stiffness as formulas of K and C; NaN goes in and out where there is none."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.principal_values import symmetric_eigenvalues
from robostiff.elastostatics import scaling
from robostiff.spatial import Space


def principal_stiffnesses(K: np.ndarray) -> dict[str, np.ndarray]:
    """Eigenvalues of the two diagonal blocks of K [N/m], [N m/rad], ascending.

    They depend on the reference point, not on the directions of the axes; neither mixes units.

    Parameters
    ----------
    K : (N, n, n) array

    Examples
    --------
    >>> values = principal_stiffnesses(np.diag([3.0, 1.0, 2.0, 6.0, 5.0, 4.0])[None])
    >>> values["translational_stiffness"], values["rotational_stiffness"]
    (array([[1., 2., 3.]]), array([[4., 5., 6.]]))
    """
    d = Space.of_size(K.shape[-1]).translations
    found = {}
    for name, block in (
        ("translational_stiffness", K[:, :d, :d]),
        ("rotational_stiffness", K[:, d:, d:]),
    ):
        # K is positive semidefinite by construction; what is below zero is rounding.
        found[name] = np.maximum(symmetric_eigenvalues(block), 0.0)
    return found


def worst_deflection(C: np.ndarray) -> dict[str, np.ndarray]:
    """Largest displacement per unit force over all directions of the force [m/N].

    The largest eigenvalue of the displacement-force block of the compliance: no moment acts, and
    the platform may turn.

    Parameters
    ----------
    C : (N, n, n) array
        Compliance [m/N, 1/N, rad/(N m)].

    Examples
    --------
    >>> float(worst_deflection(np.diag([1e-8, 3e-8, 2e-8, 1, 1, 1])[None])["worst_deflection"][0])
    3e-08
    """
    d = Space.of_size(C.shape[-1]).translations
    return {"worst_deflection": symmetric_eigenvalues(C[:, :d, :d])[:, -1]}


def stiffness_indices(K: np.ndarray, rank: np.ndarray, length: float) -> dict[str, np.ndarray]:
    """Eigenvalues of K scaled by a characteristic length, their ratio, and the determinant.

    Rotations times the length L are displacements, moments over it forces: all entries of
    S^-1 K S^-1, S = diag(1, 1, 1, L, L, L), are in N/m, and eigenvalues have a meaning.

    Parameters
    ----------
    K : (N, n, n) array
    rank : (N,) array of int
        Where it is below n the smallest eigenvalue is zero, and the determinant has no logarithm.
    length : float
        [m].

    References
    ----------
    C. Gosselin: Stiffness mapping for parallel manipulators. IEEE Transactions on Robotics and
    Automation 6(3), 1990 (maps of stiffness). G. Carbone, M. Ceccarelli: Comparison of indices for
    stiffness performance evaluation. Frontiers of Mechanical Engineering in China 5(3), 2010
    (eigenvalues, their ratio and the determinant as indices). O. Ma, J. Angeles: Optimum
    architecture design of platform manipulators. ICAR 1991 (characteristic length).

    Examples
    --------
    >>> K = np.diag([1e6, 1e6, 4e6, 1e6, 1e6, 1e6])[None]
    >>> found = stiffness_indices(K, np.array([6]), length=0.5)
    >>> float(found["isotropy"][0])
    0.25
    """
    space = Space.of_size(K.shape[-1])
    s = scaling(np.array(length), space)
    scaled = K / np.outer(s, s)
    known = np.isfinite(scaled[:, 0, 0])
    eigenvalues = np.full(scaled.shape[:2], np.nan)
    if np.any(known):
        eigenvalues[known] = np.linalg.eigvalsh(scaled[known])
    smallest, largest = eigenvalues[:, 0], eigenvalues[:, -1]
    singular = known & (rank < space.size)
    smallest = np.where(singular, 0.0, smallest)
    positive = known & (smallest > 0)
    logarithms = np.log10(
        eigenvalues, where=positive[:, None], out=np.full(scaled.shape[:2], np.nan)
    )
    return {
        "smallest_eigenvalue": smallest,
        "largest_eigenvalue": largest,
        "isotropy": np.divide(
            smallest, largest, out=np.full(len(K), np.nan), where=known & (largest > 0)
        ),
        "log10_determinant": np.sum(logarithms, axis=-1),
    }
