"""Symbols, angles and square roots of which formulas consist."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import reduce
from typing import Any

import sympy as sp


@dataclass(frozen=True)
class Atoms:
    """Roots, angles and symbols of some expressions, each list in a fixed order.

    Attributes
    ----------
    roots : tuple of SymPy expressions
        Square roots, outer before inner; roots of them, such as a**(1/4), too.
    angles : tuple of SymPy expressions
        Arguments of sines and cosines.
    symbols : tuple of sympy.Symbol
        Those that occur outside of angles, and pi.
    """

    roots: tuple[Any, ...]
    angles: tuple[Any, ...]
    symbols: tuple[Any, ...]


def prepare(expression: Any) -> Any:
    """A SymPy expression in the functions of a field; floats as exact decimals.

    Examples
    --------
    >>> a = sp.Symbol("a")
    >>> prepare(0.25 * sp.sin(2 * a))
    sin(a)*cos(a)/2
    >>> prepare(sp.sqrt(3 + 2 * sp.sqrt(2)))
    1 + sqrt(2)
    """
    prepared: Any = sp.sympify(expression)
    if prepared.is_Symbol or prepared.is_Rational:
        return prepared
    if prepared.has(sp.Float):
        prepared = sp.nsimplify(prepared, rational=True)
    if prepared.has(sp.tan):
        prepared = prepared.rewrite(sp.tan, sp.cos)
    if any(not f.args[0].is_Symbol for f in prepared.atoms(sp.sin, sp.cos)):
        prepared = sp.expand_trig(prepared)
    numbers = [root for root in prepared.atoms(sp.Pow) if is_root(root) and not root.free_symbols]
    return prepared.xreplace({root: sp.sqrtdenest(root) for root in numbers})


def atoms_of(expressions: Iterable[Any]) -> Atoms:
    """Roots, angles and symbols of prepared expressions."""
    roots: set[Any] = set()
    angles: set[Any] = set()
    symbols: set[Any] = set()
    pending = list(expressions)
    seen: set[Any] = set()
    while pending:
        expression = pending.pop()
        # pi is transcendental: nothing that is rational in it vanishes unless it always does.
        if expression.is_Symbol or expression is sp.pi:
            symbols.add(expression)
            continue
        if expression in seen:
            continue
        seen.add(expression)
        if isinstance(expression, sp.sin | sp.cos):
            angles.add(expression.args[0])
            continue
        if is_root(expression):
            root = sp.Pow(expression.base, sp.Rational(1, expression.exp.q))
            if is_root(root):
                roots.add(root)
                pending.append(root**2)
            else:
                pending.append(root)
        pending.extend(expression.args)
    return Atoms(
        tuple(sorted(roots, key=_outer_first)),
        tuple(sorted(angles, key=str)),
        tuple(sorted(symbols, key=str)),
    )


def is_root(expression: Any) -> bool:
    """Whether an expression is a power of square roots: exponents p/2, p/4, p/8, ..."""
    if not (expression.is_Pow and expression.exp.is_Rational):
        return False
    q = int(expression.exp.q)
    return q > 1 and q & (q - 1) == 0


def _outer_first(root: Any) -> tuple[int, int, str]:
    return -root.base.count_ops(), -int(root.exp.q), str(root)


@dataclass(frozen=True)
class Angles:
    """Angles whose sines and cosines are generators.

    Attributes
    ----------
    independent : tuple of SymPy expressions
        None is a rational multiple of another.
    shares : dict
        For directions with several multiples, the one of which all are whole multiples:
        ``{phi: 1/2}`` for phi and phi / 2.
    """

    independent: tuple[Any, ...]
    shares: dict[Any, Any]

    @classmethod
    def of(cls, angles: Iterable[Any]) -> Angles:
        """Independent angles for some angles.

        Examples
        --------
        >>> phi, psi = sp.symbols("phi psi")
        >>> Angles.of([phi, phi / 2, phi / 3, psi / 2]).independent
        (phi/6, psi/2)
        """
        multiples: dict[Any, list[Any]] = {}
        for angle in angles:
            multiple, direction = angle.as_coeff_Mul(rational=True)
            multiples.setdefault(direction, []).append(multiple)
        shares = {
            direction: reduce(sp.gcd, found)
            for direction, found in multiples.items()
            if len(found) > 1
        }
        independent = [
            shares.get(direction, found[0]) * direction for direction, found in multiples.items()
        ]
        return cls(tuple(sorted(independent, key=str)), shares)

    def expanded(self, function: Any) -> Any | None:
        """A sine or cosine in those of the independent angles; None for other expressions."""
        if not isinstance(function, sp.sin | sp.cos):
            return None
        argument: Any = function.args[0]
        multiple, direction = argument.as_coeff_Mul(rational=True)
        share = self.shares.get(direction)
        if share is None or multiple == share or not (multiple / share).is_Integer:
            return None
        angle = sp.Dummy()
        whole: Any = sp.expand_trig(function.func(multiple / share * angle))
        return whole.xreplace({angle: share * direction})
