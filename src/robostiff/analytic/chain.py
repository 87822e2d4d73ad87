"""The stiffness matrix of a chain with passive joints as a formula: the front door."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy as sp

from robostiff.analytic.chain_agreement import check_chain, redundant_joints
from robostiff.analytic.closed import eliminate_exactly
from robostiff.analytic.derivation import Derivation, Stage
from robostiff.analytic.exact_matrix import ExactMatrix
from robostiff.analytic.field import ExactField
from robostiff.analytic.rules import rule_in_words
from robostiff.analytic.steps import eliminate_by_name
from robostiff.analytic.unwritten import Unwritten
from robostiff.errors import InputError
from robostiff.spatial import Space


@dataclass(frozen=True)
class Closed:
    """Canonical closed form in the given symbols alone.

    Attributes
    ----------
    limit : int
        Most terms that an entry may have on the way. With a full stiffness matrix of 21 symbols
        the default answers for any joints along the axes, and for one joint whose axis and place
        are all symbols. Two such joints need a limit of 500 000, and get 160 000 terms in 2
        seconds; their expressions take 5 more to write, and 400 MB. Three are out of reach.
    """

    limit: int = 20_000


@dataclass(frozen=True)
class Steps:
    """Named intermediates, one passive joint after the other, as in Section VI."""


_CLOSED = Closed()


def derive_chain(
    K0: Any,
    joints: Mapping[str, Any],
    form: Closed | Steps = _CLOSED,
    name: str = "K_C",
) -> Derivation:
    """Derive the stiffness matrix of a chain, one passive joint after the other, eq. (15).

    Parameters
    ----------
    K0 : (n, n) matrix
        Stiffness without passive joints: SymPy expressions, numbers or both; n = 6 or 3.
    joints : mapping of str to (n,) columns
        Passive joint twists by name, in the order of elimination.
    form : Closed or Steps
    name : str

    Returns
    -------
    Derivation

    Raises
    ------
    InputError
        When a shape does not fit, K0 is not symmetric, or an expression is none that exact
        arithmetic knows.
    DisagreementError
        When the formula and the block form differ at random values.
    FormulaTooLargeError
        When a closed form would exceed its limit; `Steps` always answers.

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
    start = _checked_stiffness(K0)
    columns = {joint: _checked_column(joint, J, start.rows) for joint, J in joints.items()}
    if isinstance(form, Steps):
        derivation = _by_steps(start, columns, name)
    else:
        derivation = _in_closed_form(start, columns, name, form.limit)
    check_chain(derivation, columns)
    return derivation


def _in_closed_form(
    start: Any, columns: Mapping[str, sp.ImmutableMatrix], name: str, limit: int
) -> Derivation:
    entries = start.flat()
    K = ExactMatrix.of(
        ExactField({*entries, *(entry for J in columns.values() for entry in J.flat())}), start
    )
    # Matrices are written when they are first looked at; a redundant joint leaves the one before.
    written: Any = start
    stages = []
    for joint, J in columns.items():
        stage = eliminate_exactly(K, J, limit)
        if not stage.is_redundant:
            K = stage.after
            written = Unwritten(cache(K.expressions))
        rule = rule_in_words(J, redundant=stage.is_redundant)
        u, mu = Unwritten(stage.u_expression), Unwritten(stage.mu_expression)
        stages.append(Stage(joint, J, rule, u, mu, written))
    return Derivation(name, start, tuple(stages), written, exact=K)


def _by_steps(start: Any, columns: Mapping[str, sp.ImmutableMatrix], name: str) -> Derivation:
    K = start
    stages = []
    redundant = redundant_joints(start, tuple(columns.values()))
    for number, (joint, J) in enumerate(columns.items(), start=1):
        if redundant[number - 1]:
            none: Any = sp.ImmutableMatrix(sp.zeros(start.rows, 1))
            rule = rule_in_words(J, redundant=True)
            stages.append(Stage(joint, J, rule, none, sp.Integer(0), K))
            continue
        stage = eliminate_by_name(K, J, number)
        K = stage.K
        rule = rule_in_words(J, redundant=False)
        stages.append(Stage(joint, J, rule, stage.u, stage.mu, K, stage.definitions))
    definitions = tuple(d for stage in stages for d in stage.definitions)
    return Derivation(name, start, tuple(stages), K, definitions)


def _checked_stiffness(K0: Any) -> Any:
    try:
        K: Any = sp.ImmutableMatrix(K0)
    except (TypeError, ValueError):
        raise InputError("stiffness matrix", got=K0, expected="a square matrix") from None
    Space.of_size(K.rows)
    if K.cols != K.rows:
        raise InputError("stiffness matrix", got=K.shape, expected="a square matrix")
    for i in range(K.rows):
        for j in range(i):
            if K[i, j] != K[j, i] and sp.simplify(K[i, j] - K[j, i]) != 0:
                raise InputError(
                    f"stiffness matrix, entries [{i}, {j}] and [{j}, {i}]",
                    got=f"{K[i, j]} and {K[j, i]}",
                    expected="a symmetric matrix",
                )
    return K


def _checked_column(joint: str, J: Any, n: int) -> sp.ImmutableMatrix:
    column = sp.ImmutableMatrix(J)
    if column.shape == (1, n):
        column = column.T
    if column.shape != (n, 1):
        raise InputError(f"twist of joint {joint!r}", got=column.shape, expected=f"{n} entries")
    if all(entry == 0 for entry in column):
        raise InputError(f"twist of joint {joint!r}", got="zero", expected="a motion")
    return column
