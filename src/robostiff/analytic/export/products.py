"""Products as they are printed: sign, numerator and denominator."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp


@dataclass(frozen=True)
class PrintedProduct:
    """A product or quotient, its factors in the order of printing.

    Attributes
    ----------
    negative : bool
    above, below : tuple of sympy.Expr
        Factors without a sign; empty stands for 1.
    """

    negative: bool
    above: tuple[sp.Expr, ...]
    below: tuple[sp.Expr, ...]


def printed_product(expression: sp.Expr) -> PrintedProduct:
    """Take a product apart without evaluating it.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> printed_product(-2 * x / (3 * y**2))
    PrintedProduct(negative=True, above=(2, x), below=(3, y**2))
    """
    negative = False
    above: list[sp.Expr] = []
    below: list[sp.Expr] = []
    numbers: tuple[list[sp.Expr], list[sp.Expr]] = ([], [])
    for factor in expression.as_ordered_factors():
        if isinstance(factor, sp.Rational):
            negative ^= bool(factor < 0)
            numbers[0].append(sp.Integer(abs(int(factor.p))))
            numbers[1].append(sp.Integer(int(factor.q)))
        elif isinstance(factor, sp.Float):
            negative ^= bool(factor < 0)
            numbers[0].append(abs(factor))
        elif isinstance(factor, sp.Pow) and factor.exp.is_Rational and factor.exp.is_negative:
            power = factor.base if factor.exp == -1 else sp.Pow(factor.base, -factor.exp)
            below.append(power)
        else:
            above.append(factor)
    return PrintedProduct(
        negative,
        (*(n for n in numbers[0] if n != 1), *above),
        (*(n for n in numbers[1] if n != 1), *below),
    )
