"""What a written formula consists of, and its printer, with the strings in which languages differ.

Words, equations, tables and names are the same in all languages.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar

import sympy as sp
from sympy.printing.printer import Printer

from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.export.entries import (
    constant_name,
    decimal,
    differential_parts,
    factored_matrix,
    function_name,
    in_decimals,
    is_word,
    joined_terms,
    name_parts,
    number_in_front,
    operations,
    ordered_terms,
    printed_product,
    readable,
    readable_matrix,
    without_lost_digits,
)
from robostiff.analytic.vectors.vector_expressions import (
    Columns,
    Coordinates,
    Cross,
    Dot,
    Equation,
    Norm,
    Over,
    Stacked,
    Sum,
    Times,
    Turned,
    Turns,
    Vector,
)
from robostiff.frozen import frozen

#: A matrix with more operations than this is not written out between other equations.
LONGEST = 1500


@frozen
class Title:
    """A title; level 1 is the title of the whole."""

    text: str
    level: int = 2


@frozen
class Sentences:
    """Sentences; `{}` in them stands for a formula each, or for a name, where they have some."""

    text: str
    formulas: tuple[Any, ...] = ()


@frozen
class EquationRows:
    """Equations of scalars, vectors and matrices, one below the other.

    `springs`: definitions that are stiffnesses, for the nomenclature, which has the numbers.
    """

    rows: tuple[Equation, ...]
    springs: tuple[Definition, ...] = ()


@frozen
class MatrixEquation:
    """``name = whole = factor * rest``; a column is given as the row that it is written as."""

    name: str
    whole: sp.ImmutableMatrix
    factor: Any = sp.S.One
    rest: Any = None

    @property
    def is_vector(self) -> bool:
        """Whether it is a column, written as a row."""
        return self.whole.rows == 1


@frozen
class FormulaTable:
    """Rows of a name in words and of formulas, under a head of names."""

    head: tuple[Vector | str, ...]
    rows: tuple[tuple[str, tuple[Any, ...]], ...]
    of: str = "leg"  # what the rows are


#: Names, of vectors and matrices as `Vector`, and their meaning.
Meaning = tuple[tuple[Vector | str, ...], str]


@frozen
class Nomenclature:
    """Names and their meanings; several names with the same meaning are listed together."""

    rows: tuple[Meaning, ...]


Block = Title | Sentences | EquationRows | MatrixEquation | FormulaTable | Nomenclature


def equations(definitions: Sequence[Definition]) -> EquationRows:
    """Definitions as equations; stiffnesses in numbers are left to the nomenclature."""
    springs = tuple(d for d in definitions if d.parts)
    shown = [d for d in definitions if not is_value(d)]
    return EquationRows(
        tuple(Equation(d.symbol.name, in_decimals(d.expression)) for d in shown), springs
    )


def is_value(definition: Definition) -> bool:
    """Whether it is a stiffness in numbers."""
    return bool(definition.parts) and definition.expression.is_number


def scalar_unless_name(name: str, expression: Any) -> list[Block]:
    """The same where the expression is more than the name itself."""
    is_name = expression.is_Symbol and expression.name == name
    return [] if is_name else [equation(name, readable(expression))]


def equation(name: str, expression: Any) -> EquationRows:
    """``name = expression`` alone; of matrices see `Notation.fixed`."""
    return EquationRows((Equation(name, expression),))


def column_equation(name: str, column: Any) -> MatrixEquation:
    """``name = column``, written as a row."""
    return MatrixEquation(name, readable_matrix(column).T)


def stiffness_equation(name: str, K: Any) -> MatrixEquation:
    """``name = factor * matrix`` of a stiffness matrix."""
    K = without_lost_digits(K)
    return MatrixEquation(name, readable_matrix(K), *factored_matrix(K))


def unless_long(name: str, K: Any, column: Any = None) -> list[Block]:
    """``name = K``, or ``name = column``, or a sentence where that is long."""
    count = operations(K)
    if count > LONGEST:
        words = f"{{}} takes {count} operations and is not written out."
        return [Sentences(words, (Vector(name),))]
    return [stiffness_equation(name, K) if column is None else column_equation(name, column)]


def meanings_of_given(given: Iterable[str], meanings: Mapping[str, str]) -> list[Meaning]:
    """Rows of given symbols; those with the same meaning stand in one."""
    rows: dict[str, list[str]] = {}
    for name in given:
        rows.setdefault(meanings.get(name, "given"), []).append(name)
    return [(tuple(names), meaning) for meaning, names in rows.items()]


#: Axes of a leg, or of an arm, and their origin.
OWN_AXES = (Vector("R_0"), Vector("v_0"))


def own_axes(found: Any) -> list[Block]:
    """The axes of a leg in the world, and their origin."""
    axes, arm = OWN_AXES
    return [
        MatrixEquation(axes.name, readable_matrix(found.axes)),
        column_equation(arm.name, found.arm),
    ]


def transport(after: str, before: str) -> EquationRows:
    """``after = T before T^T``: from own axes to the reference point, eq. (11)-(13)."""
    moved: Any = f"T {before} T^T"
    lever: Any = "[R_0, 0; (v_0 ×) R_0, R_0]"
    return EquationRows((Equation(after, moved), Equation("T", lever)))


_HALF = sp.Rational(1, 2)
_TOKEN = re.compile(r"sum over \w+ of|sum of|\^T|\^-1|\$?[A-Za-z][\w']*|\S")
_OPERATORS = {"acos": "arccos", "asin": "arcsin", "atan": "arctan", "log": "ln"}


class Notation(Printer):
    """How a language writes scalars, vectors and matrices."""

    printmethod = "_in_language"  # no class has it
    # sums and products
    minus: str = " - "
    plus: str = " + "
    beside: str = " "  # between factors
    apart: str  # between a word and what it multiplies
    cross: str
    dot: str  # also before a number
    # fractions, roots and powers
    fraction: str
    in_a_line: str = "{}/{}"  # a small fraction, as an exponent
    root: str
    raised: str
    scientific: str  # a mantissa and an exponent
    partial: str  # of derivatives
    # functions
    operator: str  # the name of a function that the language has
    other: str  # and of another
    apply: str = ""  # between it and the brackets
    comma: str = ", "
    constants: ClassVar[dict[str, str]]
    brackets: str = "({})"
    norm: str
    # brackets that may stand on different lines, a stroke, and a power after a bracket
    opening: str
    closing: str
    slash: str
    power: str
    # matrices
    zero: str = "0"
    matrix_signs: tuple[str, str, str, str]  # start, between cells, between rows, end
    transposed: str  # what follows a transposed matrix
    inverse: str
    total: str
    total_over: str  # an index
    # names
    below: str  # subscripts

    # --- names ---

    def word(self, word: str) -> str:
        """A part of a name: a letter, a number, or a word."""
        return word

    def bold(self, letter: str) -> str:
        """The letter of a vector or matrix."""
        return letter

    def subscripted(self, letter: str, primes: int, subscripts: Sequence[str]) -> str:
        """A written letter with primes and written subscripts."""
        below = self.below.format(",".join(subscripts)) if subscripts else ""
        return letter + "'" * primes + below

    def name(self, name: str, *, bold: bool = False) -> str:
        """Name of a symbol with its subscripts; of a matrix or vector in bold type."""
        differential = differential_parts(name)
        if differential is not None:
            above, below = self.name(differential[0], bold=bold), self.name(differential[1])
            return self.over(f"{self.partial}{above}", f"{self.partial}{below}")
        parts = name_parts(name)
        letter = self.bold(parts.letter) if bold else self.word(parts.letter)
        return self.subscripted(letter, parts.primes, list(map(self.word, parts.subscripts)))

    # --- vectors and matrices ---

    def over(self, above: str, below: str) -> str:
        """A fraction of written expressions."""
        return self.fraction.format(above, below)

    def raise_to(self, base: str, power: str) -> str:
        """A written power."""
        return self.raised.format(base, power)

    def in_brackets(self, written: str) -> str:
        """Round brackets, as high as what is in them."""
        return self.brackets.format(written)

    def matrix(self, rows: list[list[str]]) -> str:
        """Written entries in brackets."""
        start, cells, lines, end = self.matrix_signs
        return start + lines.join(cells.join(row) for row in rows) + end

    def written(self, expression: Any) -> str:  # noqa: PLR0912
        """An expression of scalars, vectors and matrices."""
        write = self.written
        match expression:
            case Vector(name):
                found = self.name(name, bold=True)
            case Coordinates(parts):
                found = self.in_brackets(", ".join(map(self.write, parts)))
            case Sum(terms):
                signed = [(" - " if sign < 0 else " + ") + write(term) for sign, term in terms]
                found = (
                    "".join(signed).removeprefix(" + ").replace(" - ", "-", bool(terms[0][0] < 0))
                )
            case Turned((rotation, vector)):
                found = f"{write(rotation)} {self._factor(vector)}"
            case Over((vector, scalar)):
                found = self.over(write(vector), write(scalar))
            case Times((scalar, vector)):
                number = self.write(scalar)
                number = self.in_brackets(number) if scalar.is_Add else number
                is_apart = isinstance(scalar, sp.Symbol) and is_word(scalar.name)
                found = f"{number}{self.apart if is_apart else ' '}{self._factor(vector)}"
            case Cross((left, right)) | Dot((left, right)):
                sign = self.cross if isinstance(expression, Cross) else self.dot
                found = f"{self._factor(left)} {sign} {self._factor(right)}"
            case Norm((vector,)):
                found = self.norm.format(write(vector))
            case Stacked(both):
                each = (self.zero if x == 0 else write(x) for x in both)
                found = self.matrix([[x] for x in each])
            case Turns(turns):
                named = ((write(Vector(f"R_{axis}")), write(x)) for axis, x in turns)
                found = " ".join(f"{R}{self.in_brackets(angle)}" for R, angle in named)
                found = found or self.fixed("1")
            case Columns(vectors):
                found = self.matrix([list(map(write, vectors))])
            case str():
                found = self.fixed(expression)
            case _:
                found = self.write(expression)
        return found

    def fixed(self, text: str) -> str:
        """A formula of matrices as plain text has it: ``sum over i of K_i``, ``w w^T / c``.

        Names are those of matrices and vectors, and of scalars after ``$`` and ``/``.
        """
        return self._sum(deque(_TOKEN.findall(text)))

    def _sum(self, tokens: deque[str]) -> str:
        found = self._product(tokens)
        while tokens and tokens[0] in "+-":
            sign = tokens.popleft()
            found += f" {sign} {self._product(tokens)}"
        return found

    def _product(self, tokens: deque[str]) -> str:
        factors: list[str] = []
        while tokens and tokens[0] not in ("+", "-", ")", "]", ",", ";"):
            match tokens.popleft():
                case "/":
                    return self.over(" ".join(factors), self.name(tokens.popleft()))
                case "^T":
                    factors[-1] += self.transposed
                case "^-1":
                    factors[-1] += self.inverse
                case "(":
                    factors.append(self.in_brackets(self._sum(tokens)))
                    tokens.popleft()
                case "[":
                    rows, sign = [[self._sum(tokens)]], tokens.popleft()
                    while sign != "]":
                        rows += [[]] * (sign == ";")
                        rows[-1] = [*rows[-1], self._sum(tokens)]
                        sign = tokens.popleft()
                    factors.append(self.matrix(rows))
                case "0" | "1" as number:
                    factors.append(self.zero.replace("0", number))
                case "×":
                    factors.append(self.cross)
                case "sum of":
                    return f"{self.total} {self._product(tokens)}"
                case total if total.startswith("sum over "):
                    return f"{self.total_over.format(total.split()[2])} {self._product(tokens)}"
                case name:
                    factors.append(self.name(name.strip("$"), bold=name[0] != "$"))
        return " ".join(factors)

    def _factor(self, part: Any) -> str:
        is_bare = not isinstance(part, Sum | Turned | Times | Cross)
        return self.written(part) if is_bare else self.in_brackets(self.written(part))

    # --- scalars ---

    def write(self, expression: Any) -> str:
        """An expression of SymPy."""
        return self.doprint(expression)

    def number(self, digits: str) -> str:
        """Digits of a number without its sign."""
        return digits

    def applied(self, function: Any, power: str = "") -> str:
        """A function with its arguments, and the power to which it is raised."""
        arguments = self.comma.join(map(self._print, function.args))
        name = function_name(function)
        if name == "abs":
            return self.norm.format(arguments)
        is_other = name in (None, "atan2")
        head = (self.other if is_other else self.operator).format(
            self.quoted(name or str(function.func)) if is_other else _OPERATORS.get(name, name)
        )
        head = self.raise_to(head, power) if power else head
        return f"{head}{self.apply}{self.in_brackets(arguments)}"

    def quoted(self, name: str) -> str:
        """The name of a function that the language does not have."""
        return name

    def times(self, factor: str, *, apart: bool) -> str:
        """What stands before a factor that is not the first; `apart` where one is a word."""
        if factor[0].isdigit():
            return f" {self.dot} "
        return self.apart if apart else self.beside

    def emptyPrinter(self, expr: Any) -> str:
        """What has no rule: a function by its name, or a word."""
        return self.applied(expr) if expr.args else self.word(str(expr))

    def _print_Symbol(self, expr: Any) -> str:
        return self.name(expr.name)

    def _print_Integer(self, expr: Any) -> str:
        return "-" * bool(expr < 0) + self.number(str(abs(expr)))

    def _print_Float(self, expr: Any) -> str:
        mantissa, _, exponent = decimal(abs(expr)).partition("e")
        written = self.number(mantissa)
        if exponent:
            written = self.scientific.format(written, self.number(exponent))
        return "-" * bool(expr < 0) + written

    def _print_NumberSymbol(self, expr: Any) -> str:
        return self.constants.get(constant_name(expr) or "") or self.word(str(expr))

    def _print_Add(self, expr: Any) -> str:
        return joined_terms(map(self._print, ordered_terms(expr)), self.minus, self.plus)

    def _print_Mul(self, expr: Any) -> str:
        number, rest = number_in_front(expr)
        if rest is not None:
            return f"{self._print(number)} {self._factors((rest,), alone=True)}"
        product = printed_product(expr)
        written = self._factors(product.above, alone=not product.below)
        if product.below:
            written = self.over(written, self._factors(product.below))
        return f"-{written}" if product.negative else written

    _print_Rational = _print_Mul

    def _print_Pow(self, expr: Any) -> str:
        base, exponent = expr.base, expr.exp
        if exponent.is_Rational and exponent.is_negative:
            return self._print_Mul(expr)
        if exponent == _HALF:
            return self.root.format(self._print(base))
        power = self._print(exponent)
        if exponent.is_Rational and not exponent.is_Integer:
            power = self.in_a_line.format(exponent.p, exponent.q)
        if function_name(base) not in {None, "abs", "exp"} and exponent.is_Integer:
            return self.applied(base, power)
        bare = self._print(base)
        is_bare = base.is_Symbol or (base.is_Integer and base >= 0)
        return self.raise_to(bare if is_bare else self.in_brackets(bare), power)

    def _factors(self, factors: tuple[Any, ...], *, alone: bool = False) -> str:
        if len(factors) == 1 and not alone:
            return self._print(factors[0])
        written, was_word = "", False
        for factor in factors:
            text, bare = self._print(factor), factor.base if factor.is_Pow else factor
            word = bare.is_Symbol and is_word(bare.name)
            if factor.is_Add or text.startswith("-"):
                text = self.in_brackets(text)
            written += (self.times(text, apart=word or was_word) if written else "") + text
            was_word = word
        return written or self._print(sp.Integer(1))
