"""Legs that carry a force along the line between two points alone, as springs between these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from robostiff.record import Entry, reciprocal, square_root
from robostiff.spatial import cross
from robostiff.statics.kernels.elements import RecordedElement, RecordedJoint, RecordedSpring

_SAME = 1e-9  # of the length, or of a compliance: rounding at the samples


@dataclass(frozen=True)
class RecordedStrut:
    """A spring between a point of the base and one of the platform.

    Attributes
    ----------
    A, B : (3,) arrays of entries and numbers
        At the unloaded posture [m].
    stiffness : entry or number
        Along the line [N/m].
    """

    A: np.ndarray
    B: np.ndarray
    stiffness: Any

    @property
    def length(self) -> Any:
        """Unloaded [m]."""
        d = self.B - self.A
        return square_root(d @ d)

    def at(self, u: np.ndarray, c: np.ndarray) -> StrutTerms:
        """What it carries when B has moved by u; c is from the point of the platform to B.

        With e along the line, ``w = (e, c x e)`` and the force t the stiffness, symmetric part, is
        ``(k - t/l) w w^T + (t/l) [[I, -c~], [c~, -c~ c~]] + t (e c^T + c e^T - 2 (e . c) I) / 2``
        with the last term for turns alone.
        """
        d = self.B + u - self.A
        length = square_root(d @ d)
        by = reciprocal(length)
        e = d * by
        stretch = length - self.length
        t = self.stiffness * stretch
        w = np.concatenate([e, cross(c, e)])
        by_turn = t * by
        rest = self.stiffness - by_turn
        K: dict[tuple[int, int], Any] = {}
        C = np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]], dtype=object)
        along = e @ c
        square = c @ c
        scaled = w * rest
        for i in range(6):
            for j in range(i, 6):
                K[i, j] = scaled[i] * w[j]
        for i in range(3):
            K[i, i] = K[i, i] + by_turn
            for j in range(3):
                K[i, 3 + j] = K[i, 3 + j] - by_turn * C[i, j]
        turned = c * by_turn
        half = e * (t * 0.5)
        for i in range(3):
            for j in range(i, 3):
                own = half[i] * c[j] + half[j] * c[i] - turned[i] * c[j]
                if i == j:
                    own = own + by_turn * square - t * along
                K[3 + i, 3 + j] = K[3 + i, 3 + j] + own
        return StrutTerms(w * t, K, t, length)


@dataclass(frozen=True)
class StrutTerms:
    """Wrench on the strut (6,), upper triangle of its stiffness, its force [N] and length [m]."""

    W: np.ndarray
    K: dict[tuple[int, int], Any]
    t: Any
    length: Any


def recorded_strut(elements: Sequence[RecordedElement], length: float) -> RecordedStrut | None:
    """A chain that carries a force along one line alone, as a spring; None for any other.

    It turns freely about two points, about one of them in all directions. What lies between is
    straight, and a force along it bends nothing; springs at the points are equally soft in
    all directions. Whether it stays straight is another question, of its buckling.

    Parameters
    ----------
    elements : sequence of RecordedElement
        From the base to the platform.
    length : float
        Of the robot [m].
    """
    turns = [
        (k, e)
        for k, e in enumerate(elements)
        if isinstance(e, RecordedJoint) and e.turns and _nothing(e.stiffness)
    ]
    if len(turns) < 5 or not all(_nothing(e.slide) for _, e in turns):
        return None
    places = _clusters([e.point for _, e in turns], [e.axis for _, e in turns], length)
    if places is None:
        return None
    first, A, B = places
    kinks = [k for k, _ in turns]
    groups = turns[:first], turns[first:]
    counts = sorted(_independent([e.axis for _, e in own]) for own in groups)
    d = B - A
    along = d * reciprocal(square_root(d @ d))
    compliances = []
    for k, own in enumerate(elements):
        if k in kinks:
            continue
        if k < kinks[0] or k > kinks[-1]:
            compliances.append(_at_end(own, A if k < kinks[0] else B, length))
        else:
            inside = kinks[first - 1] < k < kinks[first]
            compliances.append(_between(own, along, A, length) if inside else None)
    if counts not in ([2, 3], [3, 3]) or not compliances or None in compliances:
        return None
    return RecordedStrut(A, B, reciprocal(reduce(add, compliances)))


def _at_end(own: RecordedElement, at: np.ndarray, length: float) -> Any:
    """Compliance of a spring at a point, alike in all directions; None of anything else."""
    if isinstance(own, RecordedJoint) or any(_nothing(k) for k in own.stiffness):
        return None
    C = _compliance(own)
    size = C[0, 0]
    if _nothing(size) or not _zero((own.point - at) * (1 / length)):
        return None
    rest = C.copy()
    for i in range(3):
        rest[i, i] = rest[i, i] - size
    return size if _zero(rest.reshape(-1) * (1 / _mean(size))) else None


def _between(own: RecordedElement, along: np.ndarray, A: np.ndarray, length: float) -> Any:
    """Compliance along the line; None where a force along it does more than stretch."""
    if any(_nothing(k) for k in own.springs):
        return None
    if isinstance(own, RecordedJoint):
        is_slide = not own.turns and _zero(cross(own.axis, along))
        return reciprocal(own.stiffness) if is_slide else None
    if not _zero(cross(own.point - A, along) * (1 / length)):
        return None
    local = own.rotation.T @ along
    twist = _compliance(own)[:, :3] @ local
    size = local @ twist[:3]
    bends = np.concatenate([(twist[:3] - local * size), twist[3:] * length])
    return size if _zero(bends * (1 / _mean(size))) else None


def _compliance(own: RecordedSpring) -> np.ndarray:
    found = np.zeros((6, 6), dtype=int).astype(object)
    for k, column in zip(own.stiffness, own.modes.T, strict=True):
        found = found + column[:, None] * column[None, :] * reciprocal(k)
    return found


def _clusters(
    points: Sequence[np.ndarray], axes: Sequence[np.ndarray], length: float
) -> tuple[int, np.ndarray, np.ndarray] | None:
    """How many joints turn about the first point, and the two points; None of other chains."""
    A, B = points[0], points[-1]
    on_A = [_zero(cross(p - A, a) * (1 / length)) for p, a in zip(points, axes, strict=True)]
    on_B = [_zero(cross(p - B, a) * (1 / length)) for p, a in zip(points, axes, strict=True)]
    for first in range(2, len(points) - 1):
        if all(on_A[:first]) and all(on_B[first:]):
            return first, A, B
    return None


def _independent(axes: Sequence[np.ndarray]) -> int:
    """Rank of some axes at the samples."""
    count = max((x.sample.size for a in axes for x in a if isinstance(x, Entry)), default=1)
    values = np.array([[np.broadcast_to(_values(x), count) for x in a] for a in axes])
    return min(
        int(np.linalg.matrix_rank(values[:, :, k], tol=1e-6)) for k in range(values.shape[2])
    )


def _zero(values: np.ndarray) -> bool:
    return all(np.all(np.abs(_values(x)) <= _SAME) for x in values)


def _nothing(value: Any) -> bool:
    return not isinstance(value, Entry) and float(value) == 0.0


def _mean(value: Any) -> float:
    return float(np.mean(np.abs(_values(value))))


def _values(value: Any) -> np.ndarray:
    return value.sample if isinstance(value, Entry) else np.array([float(value)])
