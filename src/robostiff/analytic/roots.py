"""Square roots as generators of a field: independent of each other, with polynomial squares."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.errors import InputError

# Larger prime factors of a number under a root stay together.
_LARGEST_PRIME = 100_000


@dataclass(frozen=True)
class Radicand:
    """A radicand, a fraction n / d, in factors.

    Attributes
    ----------
    root : SymPy expression
        As it was given.
    product : SymPy expression
        n d, a polynomial.
    below : SymPy expression
        d. The root is sqrt(n d) / |d|.
    factors : dict
        Powers of the irreducible factors of n d, -1 and primes among them; empty for a root over
        other roots or over sines, which is left as it is.
    """

    root: Any
    product: Any
    below: Any
    factors: dict[Any, int]

    @property
    def sign(self) -> Any:
        """1 if d is positive, else d: then d sqrt(n / d) is a generator itself."""
        return 1 if self.below.is_positive else self.below


@dataclass(frozen=True)
class RootValue:
    """A root as a fraction without roots, times generators."""

    coefficient: Any
    generators: tuple[Any, ...]


class Roots:
    """Generators for some square roots.

    Roots stay as they were given where no product of them is a square. Otherwise they are split
    into roots of irreducible factors, as far as these are known to be positive: sqrt(6) beside
    sqrt(2) becomes sqrt(2) sqrt(3).

    Parameters
    ----------
    roots : iterable of SymPy expressions
    taken_apart : callable
        Gives the `Radicand` of a root.

    Raises
    ------
    InputError
        When a number under a root is negative, or a root of a square has no known sign.
    """

    def __init__(self, roots: Iterable[Any], taken_apart: Callable[[Any], Radicand]) -> None:
        self.squares: dict[Any, Any] = {}
        self.values: dict[Any, RootValue] = {}
        self._known: dict[Any, Any] = {}
        radicands = [taken_apart(root) for root in roots]
        plain = [r for r in radicands if r.factors and r.sign == 1]
        split = not _are_independent({r.product: r.factors for r in plain})
        for r in radicands:
            self.values[r.root] = self._split(r) if split and r in plain else self._whole(r)

    def _whole(self, radicand: Radicand) -> RootValue:
        return RootValue(1 / radicand.below, (self._generator(radicand.product, radicand),))

    def _split(self, radicand: Radicand) -> RootValue:
        """Known positive factors apart, those of unknown sign together."""
        outside, rest, parts = 1 / radicand.below, sp.S.One, []
        for factor, power in radicand.factors.items():
            if not factor.is_positive:
                rest *= factor**power
                continue
            outside *= factor ** (power // 2)
            if power % 2:
                parts.append(self._generator(factor, radicand))
        if rest == -1:
            raise InputError("square root", got=str(radicand.root), expected="a positive radicand")
        if rest != 1:
            unknown = [p for f, p in radicand.factors.items() if not f.is_positive]
            if not any(power % 2 for power in unknown):
                raise InputError(
                    "square root of a square",
                    got=str(radicand.root),
                    expected="symbols whose assumptions decide its sign",
                    hint="declare them, such as Symbol('a', positive=True), or write the root out",
                )
            parts.append(self._generator(sp.expand(rest), radicand))
        return RootValue(outside, tuple(parts))

    def _generator(self, square: Any, radicand: Radicand) -> Any:
        """The generator with this square, as it was given if it was."""
        key = square, radicand.sign
        if key not in self._known:
            as_given = square == radicand.product
            is_whole = as_given and (radicand.below == 1 or radicand.sign != 1)
            generator = radicand.below * radicand.root if is_whole else sp.sqrt(square)
            self._known[key] = generator
            self.squares[generator] = square
        return self._known[key]


def factors_of(polynomial: Any, written: Callable[[Any], Any]) -> dict[Any, int]:
    """Powers of -1, the primes and the irreducible factors of a polynomial, as SymPy knows them."""
    content, parts = polynomial.factor()
    powers: dict[Any, int] = {}
    for base, power in parts:
        factor = written(base)
        if factor.is_negative:
            factor = sp.expand(-factor)
            content = content * (-1) ** int(power)
        powers[factor] = int(power)
    for number, sign in ((content.p, 1), (content.q, -1)):
        for prime, power in sp.factorint(int(number), limit=_LARGEST_PRIME).items():
            powers[sp.Integer(prime)] = sign * power
    return powers


def _are_independent(radicands: dict[Any, dict[Any, int]]) -> bool:
    """Whether no product of them is a square: their powers modulo 2 are linearly independent."""
    echelon: dict[Any, set[Any]] = {}
    for factors in radicands.values():
        odd = {factor for factor, power in factors.items() if power % 2}
        while odd:
            pivot = min(odd, key=str)
            if pivot not in echelon:
                echelon[pivot] = odd
                break
            odd = odd ^ echelon[pivot]
        if not odd:
            return False
    return True
