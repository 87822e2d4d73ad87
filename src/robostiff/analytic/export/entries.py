"""Expressions and entries of matrices as they are printed, and their names."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import sympy as sp

from robostiff.analytic.derivation import Formula
from robostiff.analytic.exact.definition import count_of, matrix_of
from robostiff.analytic.exact.factors import bound_of_terms, factors_of
from robostiff.analytic.exact.field import ExactField
from robostiff.errors import InputError
from robostiff.frozen import frozen

_FUNCTIONS = "acos asin atan atan2 cos cosh exp log sin sinh tan tanh"
#: Functions by the name under which they are written.
FUNCTIONS: dict[str, Any] = {
    "abs": sp.Abs,
    **{name: getattr(sp, name) for name in _FUNCTIONS.split()},
}

#: Numbers that have a name.
CONSTANTS: dict[str, Any] = {"pi": sp.pi, "e": sp.E}

_FUNCTION_NAMES = {function: name for name, function in FUNCTIONS.items()}
_CONSTANT_NAMES = {constant: name for name, constant in CONSTANTS.items()}


def function_name(expression: sp.Basic) -> str | None:
    """Name of the outermost function of an expression; None for other expressions."""
    return _FUNCTION_NAMES.get(expression.func)


def constant_name(expression: sp.Basic) -> str | None:
    """Name of a constant; None for other expressions."""
    return _CONSTANT_NAMES.get(expression)


def unknown(part: sp.Basic) -> InputError:
    """The error for a part of a formula that is not in the vocabulary."""
    allowed = ", ".join(("sums, products, rational powers", *sorted(CONSTANTS, reverse=True)))
    return InputError("formula", got=str(part), expected=f"{allowed}, {', '.join(FUNCTIONS)}")


class PrintedProduct(NamedTuple):
    """A product or quotient, its factors without signs in the order of printing; empty for 1."""

    negative: bool
    above: tuple[sp.Expr, ...]
    below: tuple[sp.Expr, ...]


def printed_product(expression: sp.Expr) -> PrintedProduct:
    """Take a product apart without evaluating it."""
    negative = False
    numbers: tuple[list[Any], list[Any]] = ([], [])
    factors: tuple[list[Any], list[Any]] = ([], [])
    for x in expression.as_ordered_factors():
        if isinstance(x, sp.Rational | sp.Float):
            negative ^= bool(x < 0)
            parts = (abs(x), sp.S.One) if isinstance(x, sp.Float) else abs(x).as_numer_denom()
            for place, part in enumerate(parts):
                numbers[place].extend([part] * (part != 1))
        elif isinstance(x, sp.Pow) and x.exp.is_Rational and x.exp.is_negative:
            factors[1].append(x.base if x.exp == -1 else sp.Pow(x.base, -x.exp))
        else:
            factors[0].append(x)
    above, below = ((*a, *b) for a, b in zip(numbers, factors, strict=True))
    return PrintedProduct(negative, above, below)


def number_in_front(product: Any) -> tuple[sp.Expr, Any]:
    """A fraction before a bracket that has fractions, and the rest; None where it has none."""
    number, rest = product.as_coeff_Mul()
    terms = [term for factor in sp.Mul.make_args(rest) if factor.is_Add for term in factor.args]
    is_before = number.is_Rational and not number.is_Integer
    if not is_before or all(sp.denom(x).is_number for x in terms) or sp.denom(rest) != 1:
        return sp.Integer(1), None
    return number, rest


#: Digits of a decimal in print.
DIGITS = 12
_BITS = sp.Float(1, DIGITS)._prec


def decimal(number: sp.Float) -> str:
    """A decimal as it is printed, without zeros at its end: 0.333333333333, 1.5e-9."""
    is_long = number._prec > _BITS
    return sp.sstr(sp.Float(number, DIGITS) if is_long else number, full_prec=False)


def ordered_terms(expression: Any) -> list[Any]:
    """Terms of a sum as SymPy orders them, a positive one in front where there is one."""
    terms = list(expression.as_ordered_terms())
    plain = (i for i, x in enumerate(terms) if not x.as_coeff_Mul()[0].is_negative)
    first = next(plain, 0)
    return [terms[first], *terms[:first], *terms[first + 1 :]]


def joined_terms(terms: Iterable[str], minus: str = " - ", plus: str = " + ") -> str:
    """Written terms as a sum."""
    first, *others = terms
    return first + "".join(f"{minus}{t[1:]}" if t.startswith("-") else f"{plus}{t}" for t in others)


_SMALL = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi omicron pi rho sigma "
    "tau upsilon phi chi psi omega"
)
_CAPITALS = "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega"
_SMALL_LETTERS = dict(zip(_SMALL.split(), "αβγδεζηθικλμνξοπρστυφχψω", strict=True))
_NAMES_OF_GREEK = {"ς": "sigma", **{letter: name for name, letter in _SMALL_LETTERS.items()}}
#: Greek letters by their English names; no capitals that are Latin letters as well.
GREEK: dict[str, str] = {
    **_SMALL_LETTERS,
    **{name: _SMALL_LETTERS[name.lower()].upper() for name in _CAPITALS.split()},
}


def greek_or(word: str) -> str:
    """A Greek letter by its English name; other words unchanged."""
    name = _NAMES_OF_GREEK.get(word.lower())
    return word if name is None else name if word.islower() else name.capitalize()


@frozen
class NameParts:
    """A letter or word with its subscripts."""

    letter: str  # a letter, a word, or the English name of a Greek letter
    subscripts: tuple[str, ...] = ()  # likewise, from left to right
    primes: int = 0  # how many primes follow the letter


_COORDINATE = re.compile("i(j?[xyz]|j)")


def name_parts(name: str) -> NameParts:
    """Take a name apart at underscores, commas and trailing digits."""
    pieces = [piece for piece in re.split(r"[_,\s{}^]+", name) if piece]
    if not pieces:
        return NameParts(name)
    head, subscripts = pieces[0], pieces[1:]
    stripped = head.rstrip("'′")
    primes = len(head) - len(stripped)
    matched = re.fullmatch(r"(\D+?)(\d+)", stripped)
    if matched:
        stripped, subscripts = matched[1], [matched[2], *subscripts]
    # Of a coordinate of leg i, or of its rod j.
    subscripts = [part for s in subscripts for part in (s if _COORDINATE.fullmatch(s) else (s,))]
    return NameParts(greek_or(stripped or head), tuple(map(greek_or, subscripts)), primes)


def differential_parts(name: str) -> tuple[str, str] | None:
    """Numerator and denominator of derivative names such as dK_1_11_dR; None for other names."""
    matched = re.fullmatch(r"d([A-Za-z][^,\s]*)_d([A-Za-z].*)", name)
    return (matched[1], matched[2]) if matched else None


def is_word(name: str) -> bool:
    """Whether a name begins with a word, which is set apart from what stands beside it."""
    letter = name_parts(name).letter
    return len(letter) > 1 and letter not in GREEK


def symbols_of(expressions: Iterable[Any]) -> set[Any]:
    """Symbols of expressions and matrices."""
    found: set[Any] = set()
    for expression in expressions:
        found |= expression.free_symbols
    return found


def operations(matrix: Any) -> int:
    """Number of operations of all entries of a matrix."""
    return sum(count_of(entry) for entry in matrix.flat())


_SYMBOL = re.compile(r"K(_?[A-Za-z]\w*)?")


def title_of(name: str) -> str:
    """The title of a stiffness: of a robot, or of a matrix K_C."""
    of = "" if _SYMBOL.fullmatch(name) or not name else "of "
    return f"Cartesian stiffness matrix {of}{name}".strip()


class EntryNames:
    """Names for matrices, vectors and their entries that differ from all given symbols.

    `given`: the given symbols, those of the joints included, in alphabetical order; `result`: the
    name of K.
    """

    def __init__(self, derivation: Formula) -> None:
        stages = getattr(derivation, "stages", ())
        matrices: list[Any] = [*derivation.matrices]
        if hasattr(derivation, "stages"):  # some of what is given cancels in K
            matrices += [getattr(derivation, x, sp.S.Zero) for x in ("K0", "C", "axes", "arm")]
        for stage in stages:
            matrices += [stage.J, stage.u, stage.K, stage.mu]
        matrices += [d.expression for d in derivation.definitions]
        used = {symbol.name for symbol in symbols_of(matrices)}
        # The derivation's own names, such as mu_1, u_1_2 and K_1_12, have the same meaning here.
        self.given: tuple[str, ...] = tuple(
            sorted(used - {d.symbol.name for d in derivation.definitions})
        )
        self._stages = len(stages)
        words = " ".join(derivation.name.split())
        self.title: str = title_of(words)
        result = words if _SYMBOL.fullmatch(words) else "K_C"
        while any(name == result or name.startswith(f"{result}_") for name in self.given):
            result = f"{result[0]}'{result[1:]}"
        self.result = result

    def of(self, letter: str, stage: int) -> str:
        """Letter and number of a joint, primed where given symbols are called like one of these."""
        while any(
            (m := re.fullmatch(rf"{letter}_(\d+)(_\d+)?", name)) and int(m[1]) <= self._stages
            for name in self.given
        ):
            letter += "'"
        return f"{letter}_{stage}"

    def generic(self, letter: str) -> str:
        """A letter for what each leg i has; with the index where a given symbol is that letter."""
        return f"{letter}_i" if letter in self.given else letter

    def free(self, name: str) -> str:
        """A name, primed where a given symbol has it."""
        while name in self.given:
            name = f"{name[0]}'{name[1:]}"
        return name


# No search for factors where it would take seconds.
_MOST_OPERATIONS_OF_AN_ENTRY = 60
_MOST_TERMS = 500

# A common factor is written where it leaves less than this part of the operations.
_SHORTER = 0.9


def in_decimals(expression: Any) -> Any:
    """The same expression with numbers of many digits as decimals, as people write them.

    Such are products of a material and a section, or lengths between given points. The exact number
    stays in the formula, and in what is exported to be computed.
    """
    if not _has_long(expression):
        return expression
    if expression.is_number:
        return sp.Float(expression.evalf(DIGITS + 3), DIGITS)
    if expression.is_Add or expression.is_Mul:
        numbers = expression.func(*(part for part in expression.args if part.is_number))
        others = [part for part in expression.args if not part.is_number]
        sums = [part for part in others if part.is_Add] if expression.is_Mul else []
        if sums and _has_long(numbers):  # a number that its terms have in common tells nothing
            others[others.index(sums[0])] = sp.Add(*(numbers * term for term in sums[0].args))
            numbers = sp.Integer(1)
        return expression.func(in_decimals(numbers), *map(in_decimals, others))
    return expression.func(*map(in_decimals, expression.args))


def without_lost_digits(K: sp.ImmutableMatrix) -> sp.ImmutableMatrix:
    """A stiffness matrix in decimals, 0 where its digits do not hold beside the diagonal."""
    if not all(x.is_number for x in K.flat()) or not _has_long(K):
        return K
    values = np.array(K.evalf(DIGITS + 3), dtype=float)
    size = np.sqrt(np.abs(np.diagonal(values)))
    lost = np.abs(values) <= 10.0**-DIGITS * np.outer(size, size)
    return sp.ImmutableMatrix(K.rows, K.cols, lambda i, j: 0 if lost[i, j] else K[i, j])


def _has_long(expression: Any) -> bool:
    """Whether numbers of many digits stand in it."""
    numbers = expression.atoms(sp.Rational)
    return any(len(str(abs(x))) > DIGITS for number in numbers for x in (number.p, number.q))


def readable(expression: Any) -> Any:
    """The same expression, factored where that is shorter."""
    expression = in_decimals(expression)
    before = count_of(expression)
    is_short = 1 < before <= _MOST_OPERATIONS_OF_AN_ENTRY and not expression.has(sp.Float)
    if not is_short or bound_of_terms(expression, _MOST_TERMS) > _MOST_TERMS:
        return expression
    try:
        field = ExactField([expression])
        element = field.element(expression)
    except InputError:
        return expression
    # A sum over compliances stays one where that is no longer than over one denominator.
    found = [
        sp.factor_terms(expression),
        factors_of(field, element.num) / factors_of(field, element.den),
    ]
    shorter = min(found, key=count_of)
    return shorter if count_of(shorter) < before else expression


def readable_matrix(M: sp.ImmutableMatrix) -> sp.ImmutableMatrix:
    """A matrix of readable entries."""
    return matrix_of(M, readable)


def factored_matrix(K: sp.ImmutableMatrix) -> tuple[sp.Expr, sp.ImmutableMatrix]:
    """Common factor of the readable entries and the remaining matrix; 1 where that is not shorter.

    Below it stands only what stands below one of the entries, and no sum over compliances is
    multiplied by it: such sums are not put over a common denominator.
    """
    whole = readable_matrix(K.applyfunc(in_decimals))
    products = {entry: _Product.of(entry) for entry in whole.flat() if entry != 0}
    if not products:
        return sp.Integer(1), whole
    powers = [entry.powers for entry in products.values()]
    least = {base: min(x.get(base, 0) for x in powers) for factors in powers for base in factors}
    below = {base: power for base, power in least.items() if power < 0}
    over_all = [all(x.get(base) == power for base, power in below.items()) for x in powers]
    # Of entries with a sum that has terms over symbols.
    of_sums = [
        is_all
        for factors, is_all in zip(powers, over_all, strict=True)
        if any(sp.denom(x).free_symbols for base in factors if base.is_Add for x in base.args)
    ]
    if not any(over_all) or not all(of_sums):
        for base in below:
            least[base] = min(0, max(factors.get(base, 0) for factors in powers))
    numbers = [entry.number for entry in products.values()]
    number: Any = sp.Integer(1)
    if all(x.is_Rational for x in numbers):  # the largest of which all are whole multiples
        above, below = [int(x.p) for x in numbers], [int(x.q) for x in numbers]
        number = sp.Rational(math.gcd(*above), math.lcm(*below))
    symbols = sp.Mul(*(base**power for base, power in least.items()))
    rest = whole.applyfunc(lambda x: products[x].divided(number, symbols) if x != 0 else x)
    factor = number * symbols
    if operations(rest) + count_of(factor) < _SHORTER * operations(whole):
        return factor, rest
    return sp.Integer(1), whole


@frozen
class _Product:
    """An entry as a number times a product, of which `powers` are those with symbols or pi."""

    number: Any
    product: Any
    powers: dict[Any, Any]

    @classmethod
    def of(cls, entry: Any) -> _Product:
        number, product = entry.as_coeff_Mul()
        parts: dict[Any, Any] = {}
        for part in sp.Mul.make_args(product):
            base, power = part.as_base_exp()
            if base.is_Add and power.is_Integer:  # R/2 - r as R - 2 r
                content, base = base.primitive()
                number *= content**power
            parts[base] = parts.get(base, 0) + power
        powers = {
            base: power
            for base, power in parts.items()
            if power.is_Rational and (base.free_symbols or base.is_NumberSymbol)
        }
        return cls(number, sp.Mul(*(base**power for base, power in parts.items())), powers)

    def divided(self, number: Any, symbols: Any) -> Any:
        """The entry divided by a number and a product of symbols; a sum is not multiplied out."""
        front, rest = self.number / number, self.product / symbols
        return sp.Mul(front, rest, evaluate=False) if rest.is_Add and front != 1 else front * rest
