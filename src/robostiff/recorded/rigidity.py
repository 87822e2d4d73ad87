"""Smallest compliance ratio of the wrenches of a leg, at the samples of its record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robostiff.elastostatics import BlockCompliance, Tolerance, block_compliance
from robostiff.record import Entry
from robostiff.recorded.elimination import Column, Conjugate
from robostiff.recorded.working_frame import LocalLeg
from robostiff.spatial import skew

_NOTHING = 1e-20  # square of a wrench beside 1: rounding


def compliance_ratio(
    leg: LocalLeg, conjugate: Conjugate, rows: Sequence[int], length: float, count: int
) -> float:
    """Least compliance of a unit wrench over the trace of C, the smallest of the samples.

    Turns are weighed by the characteristic length. It is right within a factor of the number of
    wrenches; 1 where nothing is transmitted.

    Parameters
    ----------
    leg : LocalLeg
    conjugate : Conjugate
        Wrenches that the leg transmits, in the same frame.
    rows : sequence of int
        Which rows of six they have.
    length : float
        Characteristic length [m].
    count : int
        Number of samples.
    """
    if not conjugate.mu:
        return 1.0
    own = list(rows)
    scale = np.array([1.0] * 3 + [length] * 3)[own]
    C = _compliance(leg, length, count)
    trace = np.einsum("sii,i->s", C[:, own][:, :, own], scale**2)
    ratios = []
    for w, mu in zip(conjugate.wrenches, conjugate.mu, strict=True):
        unit = at_samples(w, count) / scale
        square = np.einsum("si,si->s", unit, unit)
        if np.all(square > _NOTHING):
            ratios.append(at_samples([mu], count)[:, 0] / square / trace)
    return float(np.min(ratios, initial=1.0))


def _compliance(leg: LocalLeg, length: float, count: int) -> np.ndarray:
    """Compliance of a leg about the origin of its frame, joints held (samples, 6, 6)."""
    C = np.zeros((count, 6, 6))
    for spring in leg.springs:
        C = C + _moved_compliance(spring.R, spring.p, spring.compliance, count)
    for twist, stiffness in leg.drives:
        t = at_samples(twist, count)
        C = C + t[:, :, None] * t[:, None, :] / at_samples([stiffness], count)[:, :, None]
    for block in leg.blocks:
        C = C + _block(block, length, count).C
    return C


def _block(block: Sequence[LocalLeg], length: float, count: int) -> BlockCompliance:
    branches = []
    for branch in block:
        J_q = [at_samples(twist, count) for twist in branch.twists]
        J_q += [J for inner in branch.blocks for J in _freedoms(inner, length, count)]
        J = np.stack(J_q, axis=-1) if J_q else np.zeros((count, 6, 0))
        branches.append((_compliance(branch, length, count), J))
    return block_compliance(branches, np.full(count, length), Tolerance())


def _freedoms(block: Sequence[LocalLeg], length: float, count: int) -> list[np.ndarray]:
    J_q = _block(block, length, count).J_q
    return [J_q[..., i] for i in range(J_q.shape[-1])]


def at_samples(column: Column | np.ndarray, count: int) -> np.ndarray:
    """Values of entries and numbers at the samples (samples, n)."""
    return np.stack([_values(x, count) for x in column], axis=-1)


def _moved_compliance(R: np.ndarray, p: np.ndarray, C: np.ndarray, count: int) -> np.ndarray:
    """Compliance of a spring about the origin of the frame, J C J^T (samples, 6, 6)."""
    turn = at_samples(R.ravel(), count).reshape(count, 3, 3)
    J = np.zeros((count, 6, 6))
    J[:, :3, :3] = J[:, 3:, 3:] = turn
    # a twist at p, seen from the origin: v + p x w
    J[:, :3, 3:] = skew(at_samples(p, count)) @ turn
    own = at_samples(np.asarray(C, dtype=object).ravel(), count).reshape(count, 6, 6)
    return J @ own @ np.swapaxes(J, -1, -2)


def _values(x: Any, count: int) -> np.ndarray:
    return x.sample if isinstance(x, Entry) else np.full(count, float(x))
