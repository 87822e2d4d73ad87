"""What an approximate solution leaves of a linear system, with more digits than its entries."""

from __future__ import annotations

import numpy as np

from robostiff.spatial.shapes import Float

_BITS = np.finfo(float).nmant + 1


def residual(
    A: Float[np.ndarray, "m n"], x: Float[np.ndarray, "n k"], b: Float[np.ndarray, "m k"]
) -> Float[np.ndarray, "m k"]:
    """``b - A x``, of which rounding leaves a part of 1e-22 of the sizes of A and x.

    Leading bits of A and x are split off, so few that their products add up exactly. A step of
    refinement with this residual gives all entries of x to their own digits, the small ones too.

    Examples
    --------
    >>> A, x = np.array([[1.0, 1 / 3]]), np.array([[1.0], [-3.0]])
    >>> residual(A, x, np.zeros((1, 1))) == -(2.0**-54)
    array([[ True]])
    """
    if x.size == 0 or A.size == 0:
        return b.copy()
    bits = (_BITS - int(np.ceil(np.log2(A.shape[1])))) // 2
    A_1, x_1 = _leading(A, bits, 1), _leading(x, bits, 0)
    return ((b - A_1 @ x_1) - A_1 @ (x - x_1)) - (A - A_1) @ x


def _leading(values: np.ndarray, bits: int, axis: int) -> np.ndarray:
    """Values rounded to so many bits of the largest along an axis."""
    _, exponent = np.frexp(np.max(np.abs(values), axis=axis, keepdims=True))
    shift = np.ldexp(1.0, exponent + (_BITS - bits))
    return (values + shift) - shift
