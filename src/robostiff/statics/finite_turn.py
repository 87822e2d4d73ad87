"""Rotations by a rotation vector, with the rates of the rotation and their derivative."""

from __future__ import annotations

import numpy as np

from robostiff.spatial import skew

# Below this angle series answer: differences of cosines lose their digits there.
_SMALL = 0.05
#: GENERATORS[k] is the skew matrix of the k-th unit vector.
GENERATORS = skew(np.eye(3))


def turn_and_rates(r: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rotation exp(r x), its angular velocity W dr, and the derivative of W.

    ``W = I + b S + c S^2`` with ``S = (r x)``, ``a = |r|``, ``b = (1 - cos a)/a^2`` and
    ``c = (a - sin a)/a^3``: the left Jacobian of SO(3).

    Parameters
    ----------
    r : (N, 3) array
        Rotation vectors [rad].

    Returns
    -------
    R : (N, 3, 3) array
        exp(r x).
    W : (N, 3, 3) array
        ``d exp(r x) = ((W dr) x) exp(r x)``.
    D : (N, 3, 3, 3) array
        ``D[..., i, k, b]`` is the derivative of ``W[i, k]`` by ``r[b]``.

    Examples
    --------
    >>> R, W, D = turn_and_rates(np.zeros((1, 3)))
    >>> D[0, 2, 1, 0]  # half of (e_x x e_y)
    np.float64(0.5)
    """
    S = skew(r)
    SS = S @ S
    first, b, c, b_rate, c_rate = _coefficients(np.sqrt(np.einsum("ni,ni->n", r, r)))
    R = np.eye(3) + first * S + b * SS
    W = np.eye(3) + b * S + c * SS
    # dS^2/dr_b = E_b S + S E_b
    turned = np.einsum("bij,njk->nikb", GENERATORS, S) + np.einsum("nij,bjk->nikb", S, GENERATORS)
    D = (
        (b_rate * S + c_rate * SS)[..., None] * r[:, None, None, :]
        + b[..., None] * np.moveaxis(GENERATORS, 0, -1)
        + c[..., None] * turned
    )
    return R, W, D


def turns(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotations about unit vectors (N, 3) by angles (N,) [rad].

    Examples
    --------
    >>> turns(np.array([[0.0, 0, 1]]), np.array([np.pi / 2])).round(12)[0, 1, 0]
    np.float64(1.0)
    """
    E = skew(axis)
    versine = 2.0 * np.sin(0.5 * angle) ** 2
    return np.eye(3) + np.sin(angle)[:, None, None] * E + versine[:, None, None] * (E @ E)


def _coefficients(a: np.ndarray) -> tuple[np.ndarray, ...]:
    """Sin a/a, b, c, and the derivatives of b and c by a, divided by a."""
    u = a * a
    small = a < _SMALL
    if np.all(small):
        return tuple(value[:, None, None] for value in _series(u))
    safe = np.where(small, 1.0, a)
    s, v = np.sin(safe), 2.0 * np.sin(0.5 * safe) ** 2
    far = (
        s / safe,
        v / safe**2,
        (safe - s) / safe**3,
        (s / safe**2 - 2 * v / safe**3) / safe,
        (v / safe**3 - 3 * (safe - s) / safe**4) / safe,
    )
    near = _series(np.where(small, u, 0.0))
    return tuple(np.where(small, n, f)[:, None, None] for n, f in zip(near, far, strict=True))


def _series(u: np.ndarray) -> tuple[np.ndarray, ...]:
    return (
        1 - u / 6 + u * u / 120 - u**3 / 5040,
        0.5 - u / 24 + u * u / 720 - u**3 / 40320,
        1 / 6 - u / 120 + u * u / 5040 - u**3 / 362880,
        -1 / 12 + u / 180 - u * u / 6720,
        -1 / 60 + u / 1260 - u * u / 60480,
    )
