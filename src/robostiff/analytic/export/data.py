"""A derivation and its legs as plain data for JSON, with expressions as text."""

from __future__ import annotations

from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Derivation, Stage
from robostiff.analytic.exact.definition import Condition, Definition
from robostiff.analytic.export.outline import refuse_derivative
from robostiff.analytic.robot_derivation import InNames, LegDerivation

_SCHEMA = "robostiff derive 2"
_OF_DERIVATION = ("name", "meanings", "K0", "stages", "K", "definitions", "conditions")
_OF_ROBOT = ("legs", "where", "coordinates", "following", "remark", "named")
_PARTS: dict[type, tuple[str, ...]] = {
    Condition: ("words", "expression", "equations", "leg"),
    Definition: ("symbol", "expression", "parts"),
    InNames: ("K", "legs", "definitions"),
    Stage: ("joint", "rule", "J", "u", "mu", "K", "definitions"),
    LegDerivation: (
        *("name", "joints", "redundant", "elastic"),
        *("wrenches", "compliances", "K", "definitions"),
    ),
}


def derivation_data(derivation: Derivation) -> dict[str, Any]:
    """A derivation as plain data, ready for JSON.

    Expressions are text such as ``k*r**2/2``, which `robostiff.io.expression.parse` and SymPy read;
    columns are lists of them, matrices lists of rows.

    Parameters
    ----------
    derivation : Derivation

    Examples
    --------
    >>> k = sp.Symbol("k", positive=True)
    >>> K = sp.ImmutableMatrix(sp.diag(k / 2, k**2, 0))
    >>> data = derivation_data(Derivation("K_C", K, (), K))
    >>> data["symbols"], data["K"][0]
    (['k'], ['k/2', '0', '0'])
    """
    refuse_derivative(derivation)
    names = [*_OF_DERIVATION, *(x for x in _OF_ROBOT if hasattr(derivation, x))]
    symbols = [x.name for x in derivation.symbols]
    parts = {name: _plain(getattr(derivation, name)) for name in names}
    return {"schema": _SCHEMA, "symbols": symbols, **parts}


def _plain(part: Any) -> Any:
    if part is None or isinstance(part, str):
        return part
    if isinstance(part, sp.MatrixBase):
        rows = [[_plain(x) for x in row] for row in part.tolist()]
        return [x for (x,) in rows] if part.cols == 1 else rows
    if isinstance(part, sp.Basic):
        return sp.sstr(part, full_prec=True)
    if isinstance(part, tuple):
        return [_plain(x) for x in part]
    if type(part) in _PARTS:
        return {name: _plain(getattr(part, name)) for name in _PARTS[type(part)]}
    return dict(part)
