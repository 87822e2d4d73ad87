"""The stiffness matrix of a chain with passive joints as a formula, and the rule of each joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from itertools import islice
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.calculus import compliance_formula
from robostiff.analytic.derivation import Derivation, Stage
from robostiff.analytic.exact.closed import eliminate_exactly
from robostiff.analytic.exact.definition import NamedSteps, Unwritten
from robostiff.analytic.exact.factors import ExactMatrix
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.placement.agreement import AGREED, check_value, random_values
from robostiff.elastostatics import matrix_length
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.spatial import Space


def rule_in_words(J: Any, *, redundant: bool) -> str:
    """Name the rule by which a joint is eliminated, eq. (15), (18)-(20)."""
    entries = list(J)
    space = Space.of_size(len(entries))
    t = space.translations
    axes = [name[-1] for name in space.twist_order]
    moves = [p for p in range(t) if entries[p] != 0]
    turns = [p for p in range(t, space.size) if entries[p] != 0]
    if len(moves) + len(turns) == 1:
        (p,) = (*moves, *turns)
        about = f"rotation about {axes[p]} at the reference point"
        motion = about if turns else f"translation along {axes[p]}"
        rule = f"trivial joint (19), row and column {p + 1} vanish"
    else:
        both = [p for p in moves if p + t in turns]
        slides = space.size == 6 and sp.expand(sum(entries[p] * entries[p + t] for p in both)) != 0
        motion = "screw motion" if slides else "rotation" if turns else "translation"
        motion, rule = f"oblique {motion}", "recursion (15)"
        if len(turns) == 1:
            where = "at" if slides and len(moves) == 1 else "away from"
            motion = motion.removeprefix("oblique ")
            motion += f" about {axes[turns[0]]} {where} the reference point"
            rule = "quasi-trivial joint (18)"
    return f"{motion}: {'redundant, mu = 0, nothing changes' if redundant else rule}"


@frozen
class Closed:
    """Canonical closed form in the given symbols.

    Attributes
    ----------
    limit : int
        Most terms that an entry may have on the way; of a robot also a tenth of the digits of its
        numbers. With a full stiffness matrix of 21 symbols the default answers for any joints along
        the axes, and for one joint whose axis and place are all symbols. Two such joints need a
        limit of 500 000, and get 160 000 terms in 2 seconds; their expressions take 5 more to
        write, and 400 MB. Three are out of reach.
    """

    limit: int = 20_000


@frozen
class Steps:
    """Named intermediates, one passive joint after the other, as in Section VI."""


_CLOSED = Closed()


def derive_chain(
    K0: Any = None,
    joints: Mapping[str, Any] | None = None,
    form: Closed | Steps = _CLOSED,
    name: str = "K_C",
    *,
    C: Any = None,
) -> Derivation:
    """Derive the stiffness matrix of a chain, one passive joint after the other, eq. (15).

    Parameters
    ----------
    K0 : (n, n) matrix
        Stiffness without passive joints: SymPy expressions, numbers or both; n = 6 or 3. Left out
        where `C` is given.
    joints : mapping of str to (n,) columns
        Passive joint twists by name, in the order of elimination.
    form : Closed or Steps
    name : str
    C : (n, n) matrix, optional
        Compliance of the springs in place of their stiffness: that of springs in series is the sum
        of theirs about one point.

    Returns
    -------
    Derivation

    Raises
    ------
    InputError
        When a shape does not fit, K0 is not symmetric, C has no inverse, or exact arithmetic
        does not have an expression.
    DisagreementError
        When the formula and the block form differ at random values.
    FormulaTooLargeError
        When a closed form would exceed its limit; `Steps` has no limit.

    Examples
    --------
    Eq. (4): a planar link with a passive joint at its tip.

    >>> K11, K12, K13, K22, K23, K33 = sp.symbols("K11 K12 K13 K22 K23 K33")
    >>> K = sp.Matrix([[K11, K12, K13], [K12, K22, K23], [K13, K23, K33]])
    >>> derivation = derive_chain(K, {"tip": [0, 0, 1]})
    >>> derivation.K[0, 0]
    (K11*K33 - K13**2)/K33
    >>> derivation.stages[0].rule
    'rotation about z at the reference point: trivial joint (19), row and column 3 vanish'
    """
    if (K0 is None) == (C is None) or joints is None:
        given = [n for n, x in (("K0", K0), ("C", C), ("joints", joints)) if x is not None]
        raise InputError(
            "chain",
            got=", ".join(given) or "nothing",
            expected="either K0 or C, and joints",
            hint="write derive_chain(K0, joints) or derive_chain(C=C, joints=joints)",
        )
    start, entries = _checked_stiffness(K0 if C is None else C)
    if C is not None:
        start, entries = _checked_stiffness(compliance_formula(start))
    columns: dict[str, tuple[Any, ...]] = {}  # entries of the twist of each joint
    for joint, J in joints.items():
        if isinstance(J, list | tuple) and not any(isinstance(x, list | tuple) for x in J):
            column, shape = tuple(sp.sympify(x, strict=True) for x in J), (len(J), 1)
        else:
            matrix = _immutable(J)
            column, shape = tuple(matrix.flat()), matrix.shape
        if shape not in ((start.rows, 1), (1, start.rows)):
            expected = f"{start.rows} entries"
            raise InputError(f"twist of joint {joint!r}", got=shape, expected=expected)
        if all(entry == 0 for entry in column):
            raise InputError(f"twist of joint {joint!r}", got=Words("zero"), expected="a motion")
        columns[joint] = column
    if isinstance(form, Steps):
        K, stages, steps = start, list[Stage](), NamedSteps()
        redundant = redundant_joints(start, tuple(columns.values()))
        for number, (joint, J) in enumerate(columns.items(), start=1):
            rule, before = rule_in_words(J, redundant=redundant[number - 1]), len(steps.definitions)
            u, mu = [sp.S.Zero] * start.rows, sp.S.Zero
            if not redundant[number - 1]:
                u, mu, K = steps.eliminate(K, J, f"_{number}_")
            named = tuple(steps.definitions[before:])
            column, u = sp.ImmutableMatrix(J), sp.ImmutableMatrix(u)
            stages.append(Stage(joint, column, rule, u, mu, K, named))
        derivation = Derivation(name, start, tuple(stages), K, tuple(steps.definitions))
    else:
        derivation = _in_closed_form(start, entries, columns, name, form.limit)
    check_chain(derivation, entries, columns)
    return derivation


def _in_closed_form(
    start: Any, entries: list[Any], columns: Mapping[str, tuple[Any, ...]], name: str, limit: int
) -> Derivation:
    field = ExactField({*entries, *(entry for J in columns.values() for entry in J)})
    K = ExactMatrix.of(field, entries)
    # Matrices are written at first use; a redundant joint leaves the matrix unchanged.
    written: Any = start
    stages = []
    for joint, J in columns.items():
        stage = eliminate_exactly(K, J, limit)
        if not stage.is_redundant:
            K = stage.after
            written = Unwritten(cache(K.expressions))
        rule = rule_in_words(J, redundant=stage.is_redundant)
        u, mu = Unwritten(stage.u_expression), Unwritten(stage.mu_expression)
        column = Unwritten(lambda J=J: sp.ImmutableMatrix(J))
        stages.append(Stage(joint, column, rule, u, mu, written))
    return Derivation(name, start, tuple(stages), written)


def _checked_stiffness(K0: Any) -> tuple[Any, list[Any]]:
    """A symmetric matrix, and its entries."""
    try:
        K: Any = _immutable(K0)
    except (TypeError, ValueError):
        raise InputError("stiffness matrix", got=K0, expected="a square matrix") from None
    Space.of_size(K.rows)
    if K.cols != K.rows:
        raise InputError("stiffness matrix", got=K.shape, expected="a square matrix")
    n, entries = K.rows, K.flat()
    for i in range(n):
        for j in range(i):
            a, b = entries[i * n + j], entries[j * n + i]
            if a != b and sp.simplify(a - b) != 0:
                raise InputError(
                    f"stiffness matrix, entries [{i}, {j}] and [{j}, {i}]",
                    got=Words(f"{a} and {b}"),
                    expected="a symmetric matrix",
                )
    return K, entries


def _immutable(M: Any) -> sp.ImmutableMatrix:
    # Several times as fast as making it of its entries.
    return M.as_immutable() if isinstance(M, sp.Matrix) else sp.ImmutableMatrix(M)


_SETS = 2
_SEED = 15
_ZERO = 1e-12  # of the sizes of its terms
_FELT = 1e-6
_FLOOR = 1e-3
_CLEAR = 1e-7  # of the largest singular value: what is not zero


def redundant_joints(K0: Any, columns: Sequence[Any]) -> tuple[bool, ...]:
    """Redundant joints, decided at random values of the symbols.

    A polynomial that is zero at random values is zero (Schwartz and Zippel); in floats, beside the
    sum of the sizes of all terms of which it is made.

    Raises
    ------
    InputError
        When K0 is indefinite: J^T K J = 0 for a joint with K J not zero.
    """
    n, found = K0.rows, [True] * len(columns)
    entries = [*K0, *(x for J in columns for x in J)]
    for _, numbers in islice(random_values(entries, _SEED), _SETS):
        K = numbers[: n * n].reshape(n, n)
        sizes = np.abs(K)
        for i, J in enumerate(numbers[n * n :].reshape(-1, n)):
            u, size_of_u = K @ J, sizes @ np.abs(J)
            mu, size = J @ u, np.abs(J) @ size_of_u
            is_zero = abs(mu) <= _ZERO * size
            if is_zero and np.any(np.abs(u) > _FELT * size_of_u):
                raise InputError(
                    "stiffness matrix",
                    got=Words(
                        "a joint whose motion causes forces but stores no energy, J^T K J = 0"
                    ),
                    expected="a positive semidefinite matrix",
                )
            found[i] &= bool(is_zero)
            if not is_zero:
                K, sizes = K - np.outer(u, u) / mu, sizes + np.abs(np.outer(u, u) / mu)
    return tuple(found)


def check_chain(derivation: Derivation, entries: Sequence[Any], columns: Mapping[str, Any]) -> None:
    """Compare the formula of a chain with the block form, eq. (9), at random values.

    `entries`: those of K0, row by row.

    Raises
    ------
    DisagreementError
        When they differ.
    """
    K0 = derivation.K0
    n, count = K0.rows, len(columns)
    entries = [*entries, *(x for J in columns.values() for x in J)]
    # Formulas that differ do so at almost all values: the first at which the block form decides.
    for values, numbers in random_values(entries, _SEED):
        K = numbers[: n * n].reshape(n, n)
        J = numbers[n * n :].reshape(count, n).T
        expected = _block_form(K, J)
        if expected is None:
            continue
        # A part of K0 is added on both sides: where K vanishes, rounding is not compared.
        whole, expected = derivation.K + K0 * sp.Rational(1, 1000), expected + _FLOOR * K
        where = f"chain {derivation.name!r}"
        length = 1.0 / float(matrix_length(K, np.zeros((n, 0))))
        check_value(whole, derivation.definitions, values, expected, AGREED, where, length)
        return


def _block_form(K: np.ndarray, J: np.ndarray) -> np.ndarray | None:
    """K - K J (J^T K J)^-1 J^T K without redundant joints; None where these are undecided."""
    if J.size == 0:
        return K
    KJ = K @ J
    U, s, Vt = np.linalg.svd(J.T @ KJ)
    kept = s > _CLEAR * s[0]
    if s[0] == 0:
        return K
    if np.any(s[~kept] > 1e-12 * s[0]) or s[kept][-1] < 1e-4 * s[0]:
        return None
    inverse = (Vt[kept].T / s[kept]) @ U[:, kept].T
    return K - KJ @ inverse @ KJ.T
