"""Rotations of elastic parts by finite vectors, their rates, and products of many vectors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.spatial import skew

#: Turn of an elastic part up to which series answer [rad]; entries have nothing else.
FURTHEST_TURN = 0.2
_SKEWS = skew(np.eye(3)).reshape(3, 9)
# b, c, and their derivatives by a, divided by a: by powers of a^2.
_SERIES = np.array(
    [
        [1 / 2, 1 / 6, -1 / 12, -1 / 60],
        [-1 / 24, -1 / 120, 1 / 180, 1 / 1260],
        [1 / 720, 1 / 5040, -1 / 6720, -1 / 60480],
        [-1 / 40320, -1 / 362880, 1 / 453600, 1 / 4989600],
        [1 / 3628800, 1 / 39916800, -1 / 47900160, -1 / 622702080],
    ]
)
NEXT, LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


@dataclass(frozen=True)
class FiniteTurn:
    """Rotation exp(r x) and its angular velocity W dr: the left Jacobian of SO(3).

    ``W = I + b S + c S^2`` with ``S = (r x)``, ``a = |r|``, ``b = (1 - cos a)/a^2`` and
    ``c = (a - sin a)/a^3``.

    Attributes
    ----------
    r : (..., 3) array
        Rotation vectors [rad].
    square : (..., 1) array
        a^2.
    R, W : (..., 3, 3) arrays
        ``d exp(r x) = ((W dr) x) exp(r x)``.
    factors : (..., 4) array
        b, c, and their derivatives by a, divided by a.
    """

    r: np.ndarray
    square: np.ndarray
    R: np.ndarray
    W: np.ndarray
    factors: np.ndarray

    @staticmethod
    def of(r: np.ndarray) -> FiniteTurn:
        """Turn by rotation vectors (..., 3) [rad], of numbers or of entries.

        Examples
        --------
        >>> FiniteTurn.of(np.array([[0.0, 0, np.pi / 2]])).R.round(12)[0, 1, 0]
        np.float64(1.0)
        """
        S, u = skews(r), (r * r).sum(axis=-1, keepdims=True)
        SS, factors = S @ S, _factors(u)
        b, c, first = (
            own[..., None]
            for own in (factors[..., :1], factors[..., 1:2], 1 - u * factors[..., 1:2])
        )
        unit = np.eye(3, dtype=int)
        return FiniteTurn(r, u, S * first + SS * b + unit, S * b + SS * c + unit, factors)

    def rate(self, m: np.ndarray) -> np.ndarray:
        """Symmetric part of the derivative of ``m . W[:, k]`` by ``r[b]`` (..., 3, 3).

        With ``dS^2/dr_b = E_b S + S E_b`` and ``u = m x r`` it is that of ``(b' u + c' u x r - c m)
        r^T + c (m . r) I``; m is (..., 3).

        Examples
        --------
        >>> FiniteTurn.of(np.array([[0.1, 0, 0]])).rate(np.array([[1.0, 0, 0]]))[0].round(5)
        array([[0.     , 0.     , 0.     ],
               [0.     , 0.01666, 0.     ],
               [0.     , 0.     , 0.01666]])
        """
        _, c, b_rate, c_rate = (self.factors[..., i : i + 1] for i in range(4))
        r, u = self.r, crossed(m, self.r)
        rows = u * b_rate + crossed(u, r) * c_rate - m * c
        outer = rows[..., :, None] * r[..., None, :]
        along = c * (m * r).sum(axis=-1, keepdims=True)
        return (outer + np.swapaxes(outer, -1, -2)) * 0.5 + along[..., None] * np.eye(3, dtype=int)


def skews(v: np.ndarray) -> np.ndarray:
    """Matrices (v x) of vectors (..., 3), by one product."""
    return (v @ _SKEWS).reshape(*v.shape, 3)


def crossed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``a x b`` of vectors (..., 3), few calls for few vectors."""
    return a[..., NEXT] * b[..., LAST] - a[..., LAST] * b[..., NEXT]


def sum_of_crossed(S: np.ndarray) -> np.ndarray:
    """Sum of ``s x f`` (..., 3) from that of ``s f^T`` (..., 3, 3)."""
    return S[..., NEXT, LAST] - S[..., LAST, NEXT]


def _factors(u: np.ndarray) -> np.ndarray:
    """b, c, and their derivatives by a, divided by a (..., 4), of ``u = a^2`` (..., 1)."""
    is_near = np.ones(u.shape, dtype=bool) if u.dtype == object else u < FURTHEST_TURN**2
    near = np.where(is_near, u, 0) if not np.all(is_near) else u
    square = near * near
    one = np.ones(u.shape, dtype=int).astype(u.dtype)
    found = np.concatenate([one, near, square, square * near, square * square], axis=-1) @ _SERIES
    if np.all(is_near):
        return found
    a = np.sqrt(np.where(is_near, 1.0, u))
    s, v = np.sin(a), 2.0 * np.sin(0.5 * a) ** 2
    far = (
        v / a**2,
        (a - s) / a**3,
        (s / a**2 - 2 * v / a**3) / a,
        (v / a**3 - 3 * (a - s) / a**4) / a,
    )
    return np.where(is_near, found, np.concatenate(far, axis=-1))
