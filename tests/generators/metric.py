"""How far apart two stiffness matrices are, whatever the units of force and length."""

from __future__ import annotations

import numpy as np

# Robots here are of the order of a metre: a block smaller than this part of the other one, turns
# and shifts compared by a metre, is noise of a zero.
_NOTHING = 1e-6


def entry_sizes(K: np.ndarray) -> np.ndarray:
    """Size of every entry: the largest of the translation block and of the rotation block.

    Coupling entries have the root of their product.
    """
    t = 3 if K.shape[-1] == 6 else 2
    shift = np.abs(K[..., :t, :t]).max(axis=(-1, -2), keepdims=True)
    turn = np.abs(K[..., t:, t:]).max(axis=(-1, -2), keepdims=True)
    shift, turn = np.maximum(shift, _NOTHING * turn), np.maximum(turn, _NOTHING * shift)
    sizes = np.ones_like(K)
    sizes[..., :t, :t], sizes[..., t:, t:] = shift, turn
    sizes[..., :t, t:] = sizes[..., t:, :t] = np.sqrt(shift * turn)
    return np.where(sizes > 0, sizes, 1.0)


def distance(K: np.ndarray, reference: np.ndarray, sizes_of: np.ndarray | None = None) -> float:
    """Largest |dK_ij| / s_ij, with s_ij the entry sizes of the reference (or of `sizes_of`)."""
    sizes = entry_sizes(np.asarray(reference if sizes_of is None else sizes_of, dtype=float))
    return float(np.max(np.abs(K - reference) / sizes))


def rounding(C: np.ndarray) -> float:
    """What rounding the entries of a compliance may do to its inverse, relative to its size.

    Fifty units in the last place times the condition number, turns and shifts scaled alike.
    """
    values = np.linalg.eigvalsh(C)
    if len(C) == 0 or values[-1] <= 0:
        return 0.0
    t = 3 if len(C) == 6 else 2
    shift, turn = np.trace(C[:t, :t]), np.trace(C[t:, t:])
    s = np.array(
        [1.0] * t + [np.sqrt(shift / turn) if shift > 0 and turn > 0 else 1.0] * (len(C) - t)
    )
    return float(50 * np.finfo(float).eps * np.linalg.cond(C * np.outer(s, s)))
