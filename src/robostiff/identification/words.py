"""What measurements do not tell, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.identification.unknowns import Unknown, UnknownKind
from robostiff.markup import number

# Of the largest column of its kind, and of the largest singular value: what is nothing.
_NO_COLUMN, _NO_VALUE = 1e-9, 1e-8
# Of the largest singular value, and correlations: what is little.
_WEAK, _CORRELATED = 1e-4, 0.98
# Correlations that are reported, but are no more than usual.
_REPORTED = 0.9
_PART = 1e-4  # of the largest entry of a null vector


@dataclass(frozen=True)
class Identifiability:
    """What some rates of readings tell of the unknowns.

    Attributes
    ----------
    fixed : tuple of int
        Unknowns that have to keep their values.
    not_identified, weak, correlated : tuple of str
        Sentences; the last ones of correlations from 0.9 to 0.98, which are not weak yet.
    """

    fixed: tuple[int, ...]
    not_identified: tuple[str, ...]
    weak: tuple[str, ...]
    correlated: tuple[str, ...]


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
    n, length = len(unknowns), np.linalg.norm(J, axis=0)
    # columns that are nothing beside those of their kind
    springs = (UnknownKind.COMPLIANCE, UnknownKind.FACTOR)
    scaled = length * [abs(u.nominal) if u.kind in springs else 1.0 for u in unknowns]
    kinds = [(unknown.kind, unknown.unit) for unknown in unknowns]
    largest = {kind: max(scaled[[other == kind for other in kinds]]) for kind in kinds}
    fixed = [k for k in range(n) if scaled[k] <= _NO_COLUMN * largest[kinds[k]]]
    without = [unknowns[k] for k in fixed]
    sentences = [
        f"no measurement depends on {unknown.name}: no load strains it (a force that is parallel "
        "to its axis, or meets it, does not); add a load in another direction or at another point"
        for unknown in without
        if unknown.kind in springs
    ]
    sentences += [
        f"no measurement depends on {name}; add other postures or markers"
        for name in names_in_words([unknown for unknown in without if unknown.kind not in springs])
    ]
    free = [k for k in range(n) if k not in fixed]
    weak, correlated = [], []
    if free:
        S = J[:, free] / length[free]
        R: np.ndarray = np.asarray(np.linalg.qr(S, mode="r"))
        _, s, Vt = np.linalg.svd(R, full_matrices=True)
        s = np.append(s, np.zeros(len(free) - len(s)))
        null = Vt[s <= _NO_VALUE * s[0]].T
        order = np.array([[*UnknownKind].index(unknowns[k].kind) for k in free])
        effect = length[free] * [abs(unknowns[k].nominal) or 1.0 for k in free]
        # one member is fixed for each null vector: of those that are clearly a part of what is
        # left, the first in order, and among them that of least effect
        pivots, rest = [], null.copy()
        for _ in range(null.shape[1]):
            size = np.linalg.norm(rest, axis=1)
            size[pivots] = 0.0
            able = np.flatnonzero(size > 0.1 * size.max())
            pivots.append(int(able[np.lexsort((effect[able], order[able]))[0]]))
            direction = rest[pivots[-1]] / np.linalg.norm(rest[pivots[-1]])
            rest = rest - np.outer(rest @ direction, direction)
        # null vectors, each with one member that no other has
        vectors = null @ np.linalg.inv(null[pivots])
        for pivot, vector in zip(pivots, vectors.T, strict=True):
            size = np.abs(vector)
            members = [i for i in np.argsort(-size) if size[i] > _PART * size.max() and i != pivot]
            unknown, others = unknowns[free[pivot]], [unknowns[free[i]] for i in members]
            words = f"{_listed([unknown, *others])} cannot be told apart"
            if len(others) == 1 and unknown.kind is others[0].kind is UnknownKind.COMPLIANCE:
                ratio = vector[members[0]] / vector[pivot]
                if abs(ratio * length[free[pivot]] / length[free[members[0]]] + 1) < 1e-3:
                    words = f"only the sum of {unknown.name} and {others[0].name} is determined"
            sentences.append(f"{words}: {unknown.name} keeps its value")
            fixed.append(free[pivot])
        several = [unknowns[k] for k in free if k not in fixed]
        if several:
            R = R[:, [k not in fixed for k in free]]
            _, s, Vt = np.linalg.svd(R, full_matrices=False)
            for value, vector in zip(s, Vt, strict=True):
                if value < _WEAK * s[0]:
                    size = np.abs(vector)
                    group = [several[i] for i in np.argsort(-size) if size[i] > 0.1]
                    weak.append(
                        f"{_listed(group)} {'are' if len(group) > 1 else 'is'} hardly determined: "
                        f"errors grow {number(s[0] / value, 1)} times in this direction"
                    )
            weak += _correlated(R, several, _CORRELATED, np.inf)
            correlated = _correlated(R, several, _REPORTED, _CORRELATED)
    return Identifiability(tuple(fixed), tuple(sentences), tuple(weak), tuple(correlated))


def _correlated(R: np.ndarray, unknowns: Sequence[Unknown], least: float, most: float) -> list[str]:
    """Parameters whose errors go together with those of others, by correlations between two."""
    inverse = np.linalg.pinv(R)
    covariance = inverse @ inverse.T
    d = np.sqrt(np.diag(covariance))
    size = np.abs(covariance / np.outer(d, d))
    together = (size > least) & (size <= most)
    sentences = []
    for i, unknown in enumerate(unknowns):
        others = [unknowns[j] for j in range(i + 1, len(unknowns)) if together[i, j]]
        if others and unknown.kind is not UnknownKind.FRAME:
            sentences.append(
                f"errors of {unknown.name} go together with those of {_listed(others)}, "
                f"correlations above {least}: other postures or loads would tell them apart"
            )
    return sentences


def _listed(unknowns: Sequence[Unknown]) -> str:
    """Names in a sentence; of many the first ones."""
    names = names_in_words(unknowns)
    shown = [*names[:6], *([f"{len(names) - 6} more"] if len(names) > 6 else [])]
    if len(shown) == 1:
        return shown[0]
    return f"{', '.join(shown[:-1])} and {shown[-1]}"


def names_in_words(unknowns: Sequence[Unknown]) -> list[str]:
    """Names of unknowns; several coordinates of an instrument or a marker are its place or turn.

    Examples
    --------
    >>> place = ("place", "m1")
    >>> several = [Unknown(f"m1 {a}", UnknownKind.FRAME, 0.0, frame=place) for a in "xyz"]
    >>> names_in_words(several), names_in_words(several[:1])
    (['the place of m1'], ['m1 x'])
    """
    frames = [unknown.frame for unknown in unknowns]
    whole = {frame for frame in frames if frame[0] and frames.count(frame) > 1}
    names = []
    for unknown in unknowns:
        of = unknown.frame[1]
        words = " and ".join(what for what in ("place", "turn") if (what, of) in whole)
        names.append(f"the {words} of {of}" if unknown.frame in whole else unknown.name)
    return list(dict.fromkeys(names))
