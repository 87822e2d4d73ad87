"""Rotations by a rotation vector, with the rates of the rotation and their derivative."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.spatial import skew

# Below this angle series answer: differences of cosines lose their digits there.
_SMALL = 0.05
_IDENTITY = np.eye(3)
_SKEWS = skew(np.eye(3)).reshape(3, 9)
# Sin a/a, b, c, and the derivatives of b and c by a, divided by a: by powers of a^2.
_SERIES = np.array(
    [
        [1, 1 / 2, 1 / 6, -1 / 12, -1 / 60],
        [-1 / 6, -1 / 24, -1 / 120, 1 / 180, 1 / 1260],
        [1 / 120, 1 / 720, 1 / 5040, -1 / 6720, -1 / 60480],
        [-1 / 5040, -1 / 40320, 0, 0, 0],
    ]
)
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


@dataclass(frozen=True)
class FiniteTurn:
    """Rotation exp(r x) and its angular velocity W dr: the left Jacobian of SO(3).

    ``W = I + b S + c S^2`` with ``S = (r x)``, ``a = |r|``, ``b = (1 - cos a)/a^2`` and
    ``c = (a - sin a)/a^3``.

    Attributes
    ----------
    r : (..., 3) array
        Rotation vectors [rad].
    R, W : (..., 3, 3) arrays
        ``d exp(r x) = ((W dr) x) exp(r x)``.
    factors : tuple of four (..., 1) arrays
        b, c, and their derivatives by a, divided by a.
    """

    r: np.ndarray
    R: np.ndarray
    W: np.ndarray
    factors: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]

    def rate_felt(self, m: np.ndarray) -> np.ndarray:
        """Derivative of ``m . W[:, k]`` by ``r[b]`` (..., 3, 3), rows k.

        With ``dS^2/dr_b = E_b S + S E_b`` and ``u = m x r`` it is
        ``(b' u + c' u x r) r^T + b (m x) + c ((m . r) I - m r^T + (u x))``; m is (..., 3).

        Examples
        --------
        >>> turn_and_rates(np.zeros((1, 3))).rate_felt(np.array([[0.0, 0, 1]]))[0, 1, 0]
        np.float64(0.5)
        """
        b, c, b_rate, c_rate = self.factors
        r = self.r
        u = crossed(m, r)
        along = np.sum(m * r, axis=-1, keepdims=True)
        rows = b_rate * u + c_rate * crossed(u, r) - c * m
        return (
            rows[..., None] * r[..., None, :]
            + skews(b * m + c * u)
            + (c * along)[..., None] * _IDENTITY
        )


def turn_and_rates(r: np.ndarray) -> FiniteTurn:
    """Turn by rotation vectors (..., 3) [rad].

    Examples
    --------
    >>> turn_and_rates(np.array([[0.0, 0, np.pi / 2]])).R.round(12)[0, 1, 0]
    np.float64(1.0)
    """
    S = skews(r)
    SS = S @ S
    first, b, c, b_rate, c_rate = _coefficients(np.sqrt(np.sum(r * r, axis=-1, keepdims=True)))
    B, C = b[..., None], c[..., None]
    R = _IDENTITY + first[..., None] * S + B * SS
    W = _IDENTITY + B * S + C * SS
    return FiniteTurn(r, R, W, (b, c, b_rate, c_rate))


def skews(v: np.ndarray) -> np.ndarray:
    """Matrices (v x) of vectors (..., 3), by one product."""
    return (v @ _SKEWS).reshape(*v.shape, 3)


def crossed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``a x b`` of vectors (..., 3), few calls for few vectors."""
    return a[..., _NEXT] * b[..., _LAST] - a[..., _LAST] * b[..., _NEXT]


def _coefficients(a: np.ndarray) -> tuple[np.ndarray, ...]:
    """Sin a/a, b, c, and the derivatives of b and c by a, divided by a."""
    u = a * a
    small = a < _SMALL
    if np.all(small):
        return _series(u)
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
    return tuple(np.where(small, n, f) for n, f in zip(near, far, strict=True))


def _series(u: np.ndarray) -> tuple[np.ndarray, ...]:
    found = np.concatenate([np.ones(u.shape), u, u * u, u * u * u], axis=-1) @ _SERIES
    return tuple(found[..., i : i + 1] for i in range(5))
