"""What an exact field is made of: symbols, angles, roots; elements, and how these are written."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cmp_to_key, reduce
from operator import itemgetter
from typing import Any, ClassVar

import flint
import sympy as sp
from sympy.core.cache import cacheit

from robostiff.analytic.exact.definition import count_of, parts_of
from robostiff.errors import InputError
from robostiff.frozen import frozen

_IN_ORDER = cmp_to_key(sp.Basic.compare)
# SymPy sorts by class first: any product stands for all of them among numbers, symbols, powers and
# functions.
_PRODUCT = 2 * sp.Symbol("x")
_A_PRODUCT = "product"
_first = itemgetter(0)


@frozen
class Element:
    """An element of an exact field: a canonical fraction of polynomials.

    Supports ``+ - * /``, integer powers and ``==`` with elements and integers.
    """

    field: Any  # an ExactField, which makes it
    num: Any
    den: Any

    @property
    def is_zero(self) -> bool:
        """Whether it is exactly zero."""
        return bool(self.num.is_zero())

    @property
    def has_unit_denominator(self) -> bool:
        """Whether it is a polynomial."""
        return bool(self.den.is_one())

    @property
    def terms(self) -> int:
        """Number of terms of numerator and denominator together."""
        return len(self.num) + len(self.den)

    def __add__(self, other: Element | int) -> Element:
        b = self._coerced(other)
        if self.is_zero or b.is_zero:
            return b if self.is_zero else self
        if self.den == b.den:
            if self.den.is_one():
                return Element(self.field, self.num + b.num, self.den)
            return self.field.fraction(self.num + b.num, self.den)
        return self.field.fraction(self.num * b.den + b.num * self.den, self.den * b.den)

    def __mul__(self, other: Element | int) -> Element:
        b = self._coerced(other)
        if self.is_zero or b.is_zero:
            return self.field.zero
        return self.field.fraction(self.num * b.num, self.den * b.den)

    def __truediv__(self, other: Element | int) -> Element:
        b = self._coerced(other)
        return self.field.fraction(self.num * b.den, self.den * b.num)

    def __neg__(self) -> Element:
        return Element(self.field, -self.num, self.den)

    def __sub__(self, other: Element | int) -> Element:
        return self + (-self._coerced(other))

    def __rsub__(self, other: int) -> Element:
        return self._coerced(other) - self

    def __rtruediv__(self, other: int) -> Element:
        return self._coerced(other) / self

    def __pow__(self, power: int) -> Element:
        base = self if power >= 0 else 1 / self
        num, den = base.num ** abs(power), base.den ** abs(power)
        if self.field.relations and (self.field.has_roots(num) or self.field.has_roots(den)):
            return self.field.fraction(num, den)
        return Element(self.field, num, den)  # without a common factor, as before

    __radd__ = __add__
    __rmul__ = __mul__

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Element | int):
            return NotImplemented
        return (self - self._coerced(other)).is_zero

    __hash__: ClassVar[None]  # type: ignore[assignment]  # as any class with __eq__

    def _coerced(self, other: Element | int) -> Element:
        if isinstance(other, Element):
            return other
        return Element(self.field, self.field.ring.constant(other), self.field.ring.constant(1))


class PolynomialWriter:
    """Writes polynomials of some generators as SymPy expressions.

    SymPy sorts and merges the factors of every product and the terms of every sum anew. Of a
    polynomial the factors are known to be distinct, so that ranking each of them once is enough;
    the result is the same expression, arguments in the same order. Roots are left to SymPy, as
    they may merge with each other and with what they are roots of.

    Terms are taken from FLINT as text, which it writes in a third of the time in which it hands
    out exponents and coefficients one by one.

    `generators`: symbols, sines, cosines and roots; in the text they are g0, g1, ...
    """

    def __init__(self, generators: Sequence[Any]) -> None:
        self._generators = tuple(generators)
        merging = (not (g.is_Symbol or isinstance(g, sp.sin | sp.cos)) for g in generators)
        self._merging = {f"g{i}" for i, merges in enumerate(merging) if merges}
        # Factors of products by their text, in order, and their ranks.
        self._ranked: tuple[list[Any], dict[str, int]] = [_PRODUCT], {_A_PRODUCT: 0}

    def expressions(self, polynomials: Sequence[Any]) -> list[Any]:
        """Several of them as canonical sums of products; their factors are ranked together."""
        # Factors of the terms as text, ["-2", "g0", "g1^3"]; equal polynomials are written once.
        each = [str(x).replace(" - ", " + -").replace("-g", "-1*g") for x in polynomials]
        texts = {x: [term.split("*") for term in x.split(" + ")] for x in dict.fromkeys(each)}
        factors = {factor for terms in texts.values() for term in terms for factor in term}
        ordered, ranks = self._ranked
        missing = factors - ranks.keys()
        if missing:
            written = {factor: ordered[rank] for factor, rank in ranks.items()}
            for factor in missing:
                name, _, power = factor.partition("^")
                if name.startswith("g"):
                    generator = self._generators[int(name[1:])]
                    is_plain = generator.is_Symbol
                    written[factor] = (
                        sp.Pow(generator, int(power), evaluate=not is_plain) if power else generator
                    )
                else:
                    written[factor] = sp.Rational(*map(int, name.split("/")))

            names = sorted(written, key=lambda factor: _IN_ORDER(written[factor]))
            self._ranked = [written[x] for x in names], {x: rank for rank, x in enumerate(names)}
        sums = {text: self._sum(terms) for text, terms in texts.items()}
        return [sums[text] for text in each]

    def _sum(self, terms: list[list[str]]) -> Any:
        ordered, ranks = self._ranked
        if self._merging and any(
            x.partition("^")[0] in self._merging for term in terms for x in term
        ):
            return sp.Add(*(sp.Mul(*(ordered[ranks[x]] for x in term)) for term in terms))
        among_terms, make, written = ranks[_A_PRODUCT], sp.Mul._from_args, []
        for term in terms:
            if len(term) == 1:
                rank = ranks[term[0]]
                written.append(((rank,), ordered[rank]))
                continue
            keys = sorted([ranks[factor] for factor in term])
            product = make(tuple([ordered[rank] for rank in keys]), True)
            written.append(((among_terms, len(keys), *keys), product))
        if len(written) == 1:
            return written[0][1]
        written.sort(key=_first)
        whole: Any = sp.Add._from_args(tuple([term for _, term in written]), True)
        return whole


def power_of(base: Any, power: Any = sp.S.NegativeOne) -> Any:
    """A whole power as SymPy would write it; of a sum it would look for terms that are infinite."""
    return sp.Pow(base, power, evaluate=not base.is_Add or power == 1)


def made_of(expression: Any, parts: Sequence[Any]) -> Any:
    """An expression with other parts, as SymPy would write it."""
    if expression.is_Mul:
        return sp.Mul(*parts)
    if expression.is_Pow and parts[1] is sp.S.Half:
        return root_of(parts[0])
    if expression.is_Pow and parts[1].is_Integer:
        return power_of(*parts)
    return expression.func(*parts)


def root_of(radicand: Any) -> Any:
    """A square root of what is real, as SymPy would write it; it would look for imaginary parts."""
    if not (radicand.is_Add or radicand.is_Mul):
        return sp.sqrt(radicand)
    factors = radicand.args if radicand.is_Mul else (radicand,)
    # Where it would find no factor of a known sign, it looks longest: in sums with symbols in all
    # terms, some of them subtracted.
    sums = [x for x in factors if x.is_Add and all(t.free_symbols for t in x.args)]
    sums = [x for x in sums if len({t.could_extract_minus_sign() for t in x.args}) == 2]
    rest = [x for x in factors if x is sp.S.NegativeOne or x in sums]
    plain = (x for x in factors if x.is_Symbol or x.is_Rational or (x.is_Pow and x.base.is_Symbol))
    known = [x for x in plain if x.is_positive]
    if radicand.is_Add or len(rest) == len(factors):
        return sp.Pow(radicand, sp.S.Half, evaluate=False)
    if rest and len(known) + len(rest) == len(factors):
        outside = sp.Mul(*(sp.Pow(x, sp.S.Half, evaluate=False) for x in known))
        return outside * sp.Pow(sp.Mul(*rest), sp.S.Half, evaluate=False)
    return sp.expand_power_base(sp.Pow(radicand, sp.S.Half, evaluate=False), deep=False)


class OutsideFieldError(InputError):
    """An expression of another function, or a root of a square of which no sign is known."""


# Larger prime factors of a number under a root stay together.
_LARGEST_PRIME = 100_000


@frozen
class Atoms:
    """Roots, angles and symbols of some expressions, each list in a fixed order."""

    roots: tuple[Any, ...]  # square roots, outer before inner; roots of them, such as a**(1/4), too
    angles: tuple[Any, ...]  # arguments of sines and cosines
    symbols: tuple[Any, ...]  # those that occur outside of angles, and pi


@cacheit
def prepare(expression: Any) -> Any:
    """A SymPy expression in the functions of a field; floats as exact decimals."""
    prepared: Any = sp.sympify(expression)
    if prepared.is_Symbol or prepared.is_Rational:
        return prepared
    if any(x.is_Float for x in parts_of(prepared)):
        prepared = sp.nsimplify(prepared, rational=True)
    if any(isinstance(x, sp.tan) for x in parts_of(prepared)):
        prepared = prepared.rewrite(sp.tan, sp.cos)
    turning = (x for x in parts_of(prepared) if isinstance(x, sp.sin | sp.cos))
    if any(not x.args[0].is_Symbol for x in turning):
        hyperbolic = {x: sp.Dummy() for x in parts_of(prepared) if isinstance(x, sp.tanh)}
        prepared = sp.expand_trig(prepared.xreplace(hyperbolic))
        prepared = prepared.xreplace({kept: x for x, kept in hyperbolic.items()})
    # A root of a rational number has no other in it.
    roots = (x for x in parts_of(prepared) if is_root(x) and not x.base.is_Rational)
    numbers = [x for x in roots if not x.free_symbols]
    return prepared.xreplace({x: sp.sqrtdenest(x) for x in numbers}) if numbers else prepared


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
        if expression.is_Symbol or expression is sp.pi or isinstance(expression, sp.tanh):
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
        tuple(sorted(roots, key=lambda x: (-count_of(x.base), -int(x.exp.q), str(x)))),
        tuple(sorted(angles, key=str)),
        tuple(sorted(symbols, key=lambda x: x.name if x.is_Symbol else str(x))),
    )


def is_root(expression: Any) -> bool:
    """Whether an expression is a power of square roots: exponents p/2, p/4, p/8, ..."""
    if not (expression.is_Pow and expression.exp.is_Rational):
        return False
    q = int(expression.exp.q)
    return q > 1 and q & (q - 1) == 0


@frozen
class Angles:
    """Angles whose sines and cosines are generators."""

    independent: tuple[Any, ...]  # none is a rational multiple of another
    # for directions with several multiples, the one of which all are whole multiples: ``{phi:
    # 1/2}`` for phi and phi / 2
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

    def expand(self, function: Any) -> Any | None:
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


@frozen
class Radicand:
    """A radicand, a fraction n / d, in factors."""

    root: Any  # as it was given
    product: Any  # n d, a polynomial
    below: Any  # d. The root is sqrt(n d) / |d|.
    # powers of the irreducible factors of n d, -1 and primes among them; empty for a root over
    # other roots or over sines, which is left as it is
    factors: dict[Any, int]

    @property
    def sign(self) -> Any:
        """1 if d is positive, else d: then d sqrt(n / d) is a generator itself."""
        return 1 if self.below.is_positive else self.below


#: A root as a fraction without roots, times generators.
RootValue = tuple[Any, tuple[Any, ...]]


class Roots:
    """Generators for some square roots.

    Roots stay as they were given where no product of them is a square. Otherwise they are split
    into roots of irreducible factors, as far as these are known to be positive: sqrt(6) beside
    sqrt(2) becomes sqrt(2) sqrt(3).

    `taken_apart`: gives the `Radicand` of a root.

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
        # No product of them is a square where powers modulo 2 are linearly independent.
        each = {r.product: r.factors for r in plain}.values()
        odd = [{x for x, power in factors.items() if power % 2} for factors in each]
        every = set().union(*odd)
        bits = [int(x in own) for own in odd for x in every]
        split = flint.nmod_mat(len(odd), len(every), bits, 2).rank() < len(odd)
        for r in radicands:
            if split and r in plain:
                self.values[r.root] = self._split(r)
            else:
                self.values[r.root] = 1 / r.below, (self._generator(r.product, r),)

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
                raise OutsideFieldError(
                    "square root of a square",
                    got=str(radicand.root),
                    expected="symbols whose assumptions decide its sign",
                    hint="declare them, such as Symbol('a', positive=True), or write the root out",
                )
            parts.append(self._generator(sp.expand(rest), radicand))
        return outside, tuple(parts)

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
    """Powers of -1, the primes and the irreducible factors of a polynomial, as SymPy finds them."""
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
