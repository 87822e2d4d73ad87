"""A derivation and its legs as plain data for JSON, with expressions as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.export.languages_of_code import refuse_derivative

_SCHEMA = "robostiff derive 2"
_LEFT_OUT = {"at_vector_level", "general_rank", "steps_asked", "unit", "before"}


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
    symbols = [x.name for x in derivation.symbols]
    return {"schema": _SCHEMA, "symbols": symbols, **_plain(derivation)}


def _plain(part: Any) -> Any:
    if isinstance(part, sp.MatrixBase):
        rows = [[_plain(x) for x in row] for row in part.tolist()]
        return [x for (x,) in rows] if part.cols == 1 else rows
    if isinstance(part, sp.Basic):
        return sp.sstr(part, full_prec=True)
    if isinstance(part, tuple):
        return [_plain(x) for x in part]
    if is_dataclass(part):
        names = [x.name for x in fields(part) if x.name not in _LEFT_OUT]
        return {name: _plain(getattr(part, name)) for name in names}
    return dict(part) if isinstance(part, Mapping) else part
