"""How near the wrenches of a leg are to meeting no compliance, at the samples of its record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robostiff.record import Entry
from robostiff.recorded.elimination import Column, Conjugate
from robostiff.recorded.working_frame import LocalLeg
from robostiff.spatial import skew


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
    C = sum(
        (_moved_compliance(spring.R, spring.p, spring.compliance, count) for spring in leg.springs),
        np.zeros((count, 6, 6)),
    )
    for twist, stiffness in leg.drives:
        t = at_samples(twist, count)
        C = C + t[:, :, None] * t[:, None, :] / at_samples([stiffness], count)[:, :, None]
    trace = np.einsum("sii,i->s", C[:, own][:, :, own], scale**2)
    ratios = []
    for w, mu in zip(conjugate.wrenches, conjugate.mu, strict=True):
        unit = at_samples(w, count) / scale
        ratios.append(at_samples([mu], count)[:, 0] / np.einsum("si,si->s", unit, unit) / trace)
    return float(np.min(ratios))


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
