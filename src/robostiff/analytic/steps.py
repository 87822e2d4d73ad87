"""The recursion (15) as named steps: it never explodes, whatever the joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Definition


@dataclass(frozen=True)
class NamedStage:
    """One step of the recursion (15), its intermediates named."""

    u: Any
    mu: sp.Expr
    K: Any
    definitions: tuple[Definition, ...]


def eliminate_by_name(K: Any, J: Any, stage: int) -> NamedStage:
    """Stiffness after one more passive joint, with names u_i_j, mu_i and K_i_jk, eq. (15).

    A joint along one coordinate takes the index rule (19), (20): its row and column vanish.

    Parameters
    ----------
    K : (n, n) SymPy matrix
        Before, in given symbols and names defined before.
    J : (n, 1) SymPy matrix
        Twist of the joint.
    stage : int
        Number i of the joint, from 1.

    Examples
    --------
    >>> K = sp.Matrix(sp.MatrixSymbol("K", 2, 2))
    >>> [str(d.symbol) for d in eliminate_by_name(K, sp.Matrix([0, 1]), 1).definitions]
    ['K_1_11']
    """
    n = K.rows
    names = _Names(stage)
    used = [k for k in range(n) if J[k, 0] != 0]
    alone = used[0] if len(used) == 1 else None
    u = [sp.Add(*(K[j, k] * J[k, 0] for k in used)) for j in range(n)]
    if alone is None:
        u = [names.give(f"u_{stage}_{j + 1}", entry) for j, entry in enumerate(u)]
    mu = sp.Add(*(J[k, 0] * u[k] for k in used))
    if alone is None:
        mu = names.give(f"mu_{stage}", mu)
    after = sp.zeros(n, n)
    for i in range(n):
        for j in range(i, n):
            if alone in {i, j}:
                continue
            entry = K[i, j] - u[i] * u[j] / mu if u[i] != 0 and u[j] != 0 else K[i, j]
            after[i, j] = names.give(f"K_{stage}_{i + 1}{j + 1}", entry)
            after[j, i] = after[i, j]
    return NamedStage(
        sp.ImmutableMatrix(u), mu, sp.ImmutableMatrix(after), tuple(names.definitions)
    )


class _Names:
    """Names for what is worth one: symbols and numbers keep their own."""

    def __init__(self, stage: int) -> None:
        self.stage = stage
        self.definitions: list[Definition] = []

    def give(self, name: str, expression: sp.Expr) -> sp.Expr:
        if expression.is_Atom or (-expression).is_Atom:
            return expression
        symbol = sp.Symbol(name)
        self.definitions.append(Definition(symbol, expression))
        return symbol
