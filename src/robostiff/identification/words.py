"""What measurements do not tell, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.identification.unknowns import Unknown, UnknownKind

# Of the largest column of its kind, and of the largest singular value: what is nothing.
_NO_COLUMN, _NO_VALUE = 1e-9, 1e-8
# Of the largest singular value, and correlations: what is little.
_WEAK, _CORRELATED = 1e-4, 0.98
# Correlations that are told, but are no more than usual.
_TOLD = 0.9
_PART = 1e-4  # of the largest entry of a null vector
_ORDER = (
    UnknownKind.GEOMETRY,
    UnknownKind.OTHER,
    UnknownKind.COMPLIANCE,
    UnknownKind.FACTOR,
    UnknownKind.FRAME,
)


@dataclass(frozen=True)
class Identifiability:
    """What some rates of readings tell of the unknowns.

    Attributes
    ----------
    fixed : tuple of int
        Unknowns that have to keep their values.
    not_identified, weak, correlated : tuple of str
        Sentences; the last ones of correlations from 0.9 to 0.98, which are not weak yet.
    condition : float
        Of the columns at length 1, without those that are fixed.
    """

    fixed: tuple[int, ...]
    not_identified: tuple[str, ...]
    weak: tuple[str, ...]
    correlated: tuple[str, ...]
    condition: float


def identifiability(J: np.ndarray, unknowns: Sequence[Unknown]) -> Identifiability:
    """What readings tell of the unknowns, by their rates.

    Columns of rates are scaled to length 1. A combination of them that vanishes is one that no
    reading sees: one of its members is fixed for each, lengths and angles before frames.

    Parameters
    ----------
    J : (M, n) array
        Rates of readings over their standard deviations.
    unknowns : sequence of Unknown

    References
    ----------
    Golub, Van Loan: Matrix Computations, 4th edition, section 5.4.
    """
    n = len(unknowns)
    length = np.linalg.norm(J, axis=0)
    zero = _without_effect(length, unknowns)
    sentences = [_no_effect(unknowns[k]) for k in zero]
    left = [k for k in range(n) if k not in zero]
    fixed = list(zero)
    condition = 1.0
    if left:
        S = J[:, left] / length[left]
        R: np.ndarray = np.asarray(np.linalg.qr(S, mode="r"))
        _, s, Vt = np.linalg.svd(R, full_matrices=True)
        s = np.append(s, np.zeros(len(left) - len(s)))
        null = Vt[s <= _NO_VALUE * s[0]].T
        order = np.array([_ORDER.index(unknowns[k].kind) for k in left])
        effect = length[left] * [abs(unknowns[k].nominal) or 1.0 for k in left]
        pivots, null = _sparse(null, order, effect)
        for pivot, vector in zip(pivots, null.T, strict=True):
            size = np.abs(vector)
            members = [i for i in np.argsort(-size) if size[i] > _PART * size.max()]
            natural = {left[i]: vector[i] / length[left[i]] for i in members}
            sentences.append(_alias(left[pivot], natural, unknowns))
            fixed.append(left[pivot])
        rest = [i for i in range(len(left)) if left[i] not in fixed]
        weak, correlated = [], []
        if rest:
            _, s, Vt = np.linalg.svd(R[:, rest], full_matrices=False)
            condition = float(s[0] / s[-1])
            for value, vector in zip(s, Vt, strict=True):
                if value < _WEAK * s[0]:
                    names = [
                        unknowns[left[rest[i]]].name
                        for i in np.argsort(-np.abs(vector))
                        if abs(vector[i]) > 0.1
                    ]
                    weak.append(
                        f"{_listed(names)} {'are' if len(names) > 1 else 'is'} hardly determined: "
                        f"errors grow {1 / (value / s[0]):.0e} times in this direction"
                    )
            several = [unknowns[left[i]] for i in rest]
            weak += _correlated(R[:, rest], several, _CORRELATED, np.inf)
            correlated = _correlated(R[:, rest], several, _TOLD, _CORRELATED)
    else:
        weak, correlated = [], []
    return Identifiability(
        tuple(fixed), tuple(sentences), tuple(weak), tuple(correlated), condition
    )


def _without_effect(length: np.ndarray, unknowns: Sequence[Unknown]) -> list[int]:
    """Unknowns that no reading depends on: their columns are nothing beside those of their kind."""
    scaled = np.array(
        [
            size * abs(own.nominal)
            if own.kind in (UnknownKind.COMPLIANCE, UnknownKind.FACTOR)
            else size
            for size, own in zip(length, unknowns, strict=True)
        ]
    )
    found = []
    for k, own in enumerate(unknowns):
        alike = [
            scaled[i] for i, other in enumerate(unknowns) if (other.kind, other.unit) == (
                own.kind, own.unit)
        ]  # fmt: skip
        if scaled[k] <= _NO_COLUMN * max(alike):
            found.append(k)
    return found


def _no_effect(own: Unknown) -> str:
    if own.kind in (UnknownKind.COMPLIANCE, UnknownKind.FACTOR):
        return (
            f"no measurement depends on {own.name}: no load strains it (a force does not that is "
            "parallel to its axis or meets it); add a load in another direction or at another point"
        )
    return f"no measurement depends on {own.name}; add other postures or markers"


def _sparse(
    null: np.ndarray, order: np.ndarray, effect: np.ndarray
) -> tuple[list[int], np.ndarray]:
    """Null vectors (n, k), each with one member that no other has, and these members.

    Of those that are clearly a part of what is left, members are the first in order (n,), and among
    them that of least effect (n,).
    """
    pivots: list[int] = []
    left = null.copy()
    for _ in range(null.shape[1]):
        size = np.linalg.norm(left, axis=1)
        size[pivots] = 0.0
        able = np.flatnonzero(size > 0.1 * size.max())
        pivot = int(able[np.lexsort((effect[able], order[able]))[0]])
        pivots.append(pivot)
        direction = left[pivot] / np.linalg.norm(left[pivot])
        left = left - np.outer(left @ direction, direction)
    if not pivots:
        return [], null
    return pivots, null @ np.linalg.inv(null[pivots])


def _alias(pivot: int, natural: dict[int, float], unknowns: Sequence[Unknown]) -> str:
    """What cannot be told apart, and what is kept of it."""
    own = unknowns[pivot]
    others = [k for k in natural if k != pivot]
    if len(others) == 1:
        (k,) = others
        ratio = natural[k] / natural[pivot]
        alike = own.kind is unknowns[k].kind is UnknownKind.COMPLIANCE
        if alike and abs(ratio + 1) < 1e-3:
            return (
                f"only the sum of {own.name} and {unknowns[k].name} is determined: "
                f"{own.name} keeps its value"
            )
    names = [own.name, *(unknowns[k].name for k in others)]
    return f"{_listed(names)} cannot be told apart: {own.name} keeps its value"


def _correlated(R: np.ndarray, unknowns: Sequence[Unknown], least: float, most: float) -> list[str]:
    """Parameters whose errors go together with those of others, by correlations between two."""
    inverse = np.linalg.pinv(R)
    covariance = inverse @ inverse.T
    d = np.sqrt(np.diag(covariance))
    size = np.abs(covariance / np.outer(d, d))
    together = (size > least) & (size <= most)
    found = []
    for i, one in enumerate(unknowns):
        others = [unknowns[j].name for j in range(i + 1, len(unknowns)) if together[i, j]]
        if others and one.kind is not UnknownKind.FRAME:
            found.append(
                f"errors of {one.name} go together with those of {_listed(others)}, correlations "
                f"above {least}: other postures or loads would tell them apart"
            )
    return found


def _listed(names: Sequence[str]) -> str:
    """Names in a sentence; of many the first ones."""
    shown = [*names[:6], *([f"{len(names) - 6} more"] if len(names) > 6 else [])]
    if len(shown) == 1:
        return shown[0]
    return f"{', '.join(shown[:-1])} and {shown[-1]}"
