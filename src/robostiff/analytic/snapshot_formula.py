"""The stiffness of a whole robot as a formula, from where its joints and springs are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.agreement import AGREED, check_value
from robostiff.analytic.closed import canonical
from robostiff.analytic.elimination import null_space
from robostiff.analytic.field import Element, ExactField
from robostiff.analytic.numeric_value import values_of
from robostiff.analytic.parallel import moved_formula, rotated_formula
from robostiff.errors import InputError
from robostiff.kinematics import leg_compliance, passive_jacobian
from robostiff.model import PlacedLeg, Snapshot, with_entries
from robostiff.model.entries import formulas
from robostiff.spatial import Space, block_rotation
from robostiff.spatial.batch import transposed

# Operations up to which the legs are brought over one denominator; a longer sum reads better apart.
_COMBINED = 2000

# Ranges of the symbols at which a formula is compared with numbers; some suit lengths, some sines.
_RANGES = ((0.5, 1.5), (0.1, 0.9))
_TRIES = 6
_SEED = 11


@dataclass(frozen=True)
class SnapshotFormula:
    """Stiffness of a robot and of its legs about the reference point, world axes.

    Attributes
    ----------
    K : sympy.ImmutableMatrix
        (n x n), every entry a canonical fraction, or a sum of them, one a leg, where the fraction
        would be long.
    legs : tuple of sympy.ImmutableMatrix
        Stiffness of each leg; they add up to K.
    """

    K: sp.ImmutableMatrix
    legs: tuple[sp.ImmutableMatrix, ...]


def snapshot_formula(snapshot: Snapshot) -> SnapshotFormula:
    """Stiffness of a robot whose points, axes and springs are formulas, K = W (W^T C W)^-1 W^T.

    The numerical form's own Jacobians are filled with SymPy expressions, and the wrench basis form
    is carried out in exact arithmetic, leg by leg.

    Parameters
    ----------
    snapshot : Snapshot
        One pose; its arrays hold SymPy expressions, numbers or both. Axes are unit vectors, and
        square roots in them are kept with their relation.

    Returns
    -------
    SnapshotFormula

    Raises
    ------
    DisagreementError
        When formula and numerical form differ at random values of the symbols.
    InputError
        When a transmitted wrench meets no compliance, so that no matrix exists, or the platform
        is flexible.

    Examples
    --------
    A spring along x between two ball joints a length L apart, seen from its end:

    >>> from robostiff.model import Actuated, Motion, Passive, PlacedFreedom, PlacedLeg
    >>> k, L = sp.symbols("k L", positive=True)
    >>> tip, x = np.array([L, 0, 0], dtype=object), np.array([1, 0, 0], dtype=object)
    >>> balls = [PlacedFreedom("ball", Motion.ROTATION, p, e, Passive())
    ...          for p in (0 * tip, tip) for e in np.eye(3, dtype=int).astype(object)]
    >>> slide = PlacedFreedom("slide", Motion.TRANSLATION, 0 * tip, x, Actuated(k))
    >>> rod = Snapshot("rod", (PlacedLeg("rod", (slide, *balls), tip),), tip)
    >>> snapshot_formula(rod).K[0, 0]
    k
    """
    if snapshot.platform is not None:
        raise InputError(
            f"formula of snapshot {snapshot.name!r}",
            got="a flexible platform",
            expected="a rigid one: how a platform bends is computed in numbers alone",
        )
    legs = tuple(_leg_formula(leg, snapshot) for leg in snapshot.legs)
    total: Any = sp.ImmutableMatrix(sum(legs[1:], legs[0]))
    small = sum(entry.count_ops() for entry in total) <= _COMBINED
    K: Any = canonical(total) if small else total
    _check(K, snapshot)
    return SnapshotFormula(K, legs)


def _check(K: Any, snapshot: Snapshot) -> None:
    """Compare the formula with the numerical form at random values of its symbols."""
    from robostiff.analysis import stiffness

    random = np.random.default_rng(_SEED)
    entries = list(formulas(snapshot))
    symbols = sorted(set().union(*(x.free_symbols for x in entries)), key=str)
    for attempt in range(_TRIES):
        low, high = _RANGES[attempt % len(_RANGES)]
        values = {symbol: float(random.uniform(low, high)) for symbol in symbols}
        numbers = np.array(values_of(entries, values), dtype=float)
        if not np.all(np.isfinite(numbers)):
            continue
        known = dict(zip(entries, numbers.tolist(), strict=True))
        try:
            twin: Any = with_entries(snapshot, lambda x, known=known: known.get(x, x))  # pyright: ignore
            result = stiffness(twin)
        except InputError:  # such as a compliance that is not positive at these values
            continue
        if result.answered:
            where, length = f"snapshot {snapshot.name!r}", float(twin.characteristic_length) or 1.0
            check_value(K, (), values, result.K, AGREED, where, length)
            return


def _leg_formula(leg: PlacedLeg, snapshot: Snapshot) -> sp.ImmutableMatrix:
    """Stiffness of a leg about the reference point, derived where its joints look simplest."""
    rows = list(snapshot.space.rows)
    reference = snapshot.reference_point
    frames = [(np.eye(3, dtype=int).astype(object), reference)]
    if snapshot.space is Space.SPATIAL:
        frames += [(spring.rotation, spring.point) for spring in leg.springs]
    problems = [_problem(leg, R, p, rows) for R, p in frames]
    simplest = min(range(len(frames)), key=lambda i: problems[i].terms)
    problem, (R, p) = problems[simplest], frames[simplest]
    K = problem.written(_leg_stiffness(problem.field, leg.name, problem.C, problem.J_q))
    if simplest == 0:
        return K
    return canonical(moved_formula(rotated_formula(K, R), reference - p), [*R.flat])


@dataclass(frozen=True)
class _Problem:
    """Compliance and passive joints of a leg in one frame, in a field of their own."""

    field: ExactField
    C: list[list[Element]]
    J_q: list[list[Element]]

    @property
    def terms(self) -> int:
        """How long the entries are."""
        return sum(element.terms for row in (*self.C, *self.J_q) for element in row)

    def written(self, rows: list[list[Element]]) -> sp.ImmutableMatrix:
        """A matrix of the field in SymPy."""
        return sp.ImmutableMatrix([[self.field.expression(e) for e in row] for row in rows])


def _problem(leg: PlacedLeg, R: np.ndarray, p: np.ndarray, rows: list[int]) -> _Problem:
    to_local = transposed(block_rotation(np.asarray(R, dtype=object)))
    C = to_local @ np.asarray(leg_compliance(leg, p), dtype=object) @ to_local.T
    J_q = to_local @ np.asarray(passive_jacobian(leg, p)[0], dtype=object)
    C, J_q = C[np.ix_(rows, rows)], J_q[rows]
    # A field of its own: the roots of one leg are nothing to the others.
    field = ExactField([*C.flat, *J_q.flat])
    return _Problem(field, _elements(field, C), _elements(field, J_q))


def _leg_stiffness(
    field: ExactField, name: str, C: list[list[Element]], J_q: list[list[Element]]
) -> list[list[Element]]:
    """Sum of w w^T / (w^T C w) over transmitted wrenches made conjugate to one another."""
    n = len(C)
    columns = [list(column) for column in zip(*J_q, strict=True)]
    wrenches = null_space(field, columns, n)
    K = [[field.zero] * n for _ in range(n)]
    while wrenches:
        w, *wrenches = wrenches
        Cw = [_dot(field, row, w) for row in C]
        mu = _dot(field, w, Cw)
        if mu.is_zero:
            raise InputError(
                f"leg {name!r}",
                got="a transmitted wrench that meets no compliance",
                expected="elasticity on every path that carries a load",
                hint="give a link or an actuator of the leg its elasticity",
            )
        scaled = [entry / mu for entry in w]
        K = [[K[i][j] + w[i] * scaled[j] for j in range(n)] for i in range(n)]
        wrenches = [
            [a - _dot(field, Cw, other) * b for a, b in zip(other, scaled, strict=True)]
            for other in wrenches
        ]
    return K


def _dot(field: ExactField, a: list[Element], b: list[Element]) -> Element:
    total = field.zero
    for x, y in zip(a, b, strict=True):
        if not (x.is_zero or y.is_zero):
            total = total + x * y
    return total


def _elements(field: ExactField, matrix: np.ndarray) -> list[list[Element]]:
    return [[field.element(entry) for entry in row] for row in matrix]
