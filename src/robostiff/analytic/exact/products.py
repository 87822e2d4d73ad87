"""Products and quotients of long polynomials, in pieces that stay within a limit.

A call into FLINT cannot be interrupted, and its size is known only afterwards. In pieces, Ctrl-C
is heard between two of them, and a product that grows beyond the limit is given up on the way.
"""

from __future__ import annotations

from typing import Any

from flint.utils.flint_exceptions import DomainError

from robostiff.analytic.budget import FormulaTooLargeError, spend

# Pairs of terms that one call multiplies or divides: some tenths of a second.
PIECE = 2_000_000


def product(a: Any, b: Any, limit: int, piece: int = PIECE) -> Any:
    """The product of two polynomials of one ring.

    Raises
    ------
    FormulaTooLargeError
        When it has more than `limit` terms, or some of its pieces together have.
    """
    spend()
    if len(a) * len(b) <= piece:
        whole = a * b
        if len(whole) > limit:
            raise FormulaTooLargeError.beyond(limit)
        return whole
    long, short = (a, b) if len(a) >= len(b) else (b, a)
    total = None
    for part in _parts(long, max(1, piece // len(short))):
        spend()
        term = part * short
        total = term if total is None else total + term
        if len(total) > limit:
            raise FormulaTooLargeError.beyond(limit)
    return total


def quotient(a: Any, d: Any, piece: int = PIECE) -> Any | None:
    """The exact quotient of two polynomials of one ring; None when d does not divide a.

    Examples
    --------
    >>> import flint
    >>> x, y = flint.fmpq_mpoly_ctx.get(["x", "y"], flint.Ordering.lex).gens()
    >>> quotient(x * y**2 - y + x * y - 1, y + 1)
    x*y - 1
    >>> quotient(x * y, y + 1) is None
    True
    """
    if len(a) * len(d) <= _DIVISION * piece:
        return _whole_quotient(a, d)
    total = a.context().constant(0)
    for part in _parts_apart(a, d):
        spend()
        divided = _whole_quotient(part, d)
        if divided is None:
            return None
        total = total + divided
    return total


# Pairs of terms of dividend and divisor cost far less than pairs of terms of a product.
_DIVISION = 100


def _whole_quotient(a: Any, d: Any) -> Any | None:
    try:
        return a / d
    except DomainError:
        return None


def _parts(polynomial: Any, terms: int) -> list[Any]:
    """A polynomial as a sum of polynomials with so many terms."""
    ring = polynomial.context()
    items = list(polynomial.to_dict().items())
    return [ring.from_dict(dict(items[i : i + terms])) for i in range(0, len(items), terms)]


def _parts_apart(a: Any, d: Any) -> list[Any]:
    """Sums of the terms of a alike in the variables that d has not: d divides each or not a."""
    foreign = [place for place, degree in enumerate(d.degrees()) if not degree]
    groups: dict[tuple[int, ...], dict[Any, Any]] = {}
    for powers, coefficient in a.to_dict().items():
        key = tuple(powers[place] for place in foreign)
        groups.setdefault(key, {})[powers] = coefficient
    return [a.context().from_dict(group) for group in groups.values()]
