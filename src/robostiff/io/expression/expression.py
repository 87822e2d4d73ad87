"""Expressions: from text to a tree by operator precedence (Pratt), and its values."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TypeAlias

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.io.expression import functions
from robostiff.io.expression.functions import CONSTANTS, FLOATS, RULES, Mathematics
from robostiff.io.suggest import did_you_mean, listing, nearest
from robostiff.io.units import UNIT_WORDS, SIQuantity, Unit, is_unit_word, make_quantity, read_unit
from robostiff.io.units.unit import NUMBER, after_space


@frozen
class Token:
    """A piece of the text: kind is ``number``, ``name``, ``end``, or the operator itself."""

    kind: str
    text: str
    column: int
    quantity: SIQuantity | None = None  # of a number, in base units
    digits: str = ""  # as they were written, without the unit
    unit: Unit | None = None


@frozen
class ParsedOperation:
    """A sign, an operator between two operands, or a function of the table, applied."""

    name: str
    operands: tuple[Node, ...]
    column: int


#: A number, a parameter or an operation.
Node: TypeAlias = Token | ParsedOperation

LONGEST_TEXT = 1000
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_OPERATOR = re.compile(r"\*\*|[-+*/^(),]")
_SHOWN = 60
_SIGNS = dict.fromkeys("·⋅×", "write *") | dict.fromkeys("−–", "write -")
_SIGNS |= {"%": "write 0.05 for 5 %", "\xa0": "write an ordinary space"}


def error_at(
    text: str, column: int, got: object, expected: str, hint: str | None = None
) -> InputError:
    """The error for one column of an expression."""
    start = max(0, min(column - 1 - _SHOWN // 2, len(text) - _SHOWN))
    shown = text[start : start + _SHOWN]
    if start > 0:
        shown = "…" + shown
    if start + _SHOWN < len(text):
        shown += "…"
    return InputError(
        f"expression {shown!r}, column {column}", got=got, expected=expected, hint=hint
    )


def tokens(text: str) -> Iterator[Token]:
    """The tokens of the text, one after the other, closed by one of kind ``end``."""
    if len(text) > LONGEST_TEXT:
        got = Words(f"{len(text)} characters")
        hint = "split it over several parameters"
        raise InputError("expression", got=got, expected=f"at most {LONGEST_TEXT}", hint=hint)
    start, previous, leading_slash = after_space(text, 0), "", True
    while start < len(text):
        if match := NUMBER.match(text, start):
            token, end = _number(text, match, leading_slash=leading_slash)
        elif match := _NAME.match(text, start) or _OPERATOR.match(text, start):
            word, end = match[0], match.end()
            kind = "name" if match.re is _NAME else "^" if word == "**" else word
            token = Token(kind, word, start + 1)
        else:
            expected = "numbers with units, parameters, + - * / ^, functions and brackets"
            raise error_at(text, start + 1, text[start], expected, _SIGNS.get(text[start]))
        yield token
        is_sign = token.kind in ("+", "-") and previous not in ("number", "name", ")")
        if not is_sign:  # R/-2/m is as ambiguous as R/2/m
            leading_slash = token.kind not in ("/", "^")
        start, previous = after_space(text, end), token.kind
    yield Token("end", "", len(text) + 1)


def _number(text: str, match: re.Match[str], *, leading_slash: bool) -> tuple[Token, int]:
    start, digits = match.start(), match[0]
    try:
        unit, end = read_unit(text, match.end(), leading_slash=leading_slash)
    except InputError as error:
        column, expected = match.end() + 1, str(error.expected)
        raise error_at(text, column, error.got, expected, error.hint) from None
    start_of_word = after_space(text, match.end())
    word = _NAME.match(text, start_of_word) if unit is None else None
    if word is not None:  # either a misspelt unit or a forgotten product sign
        hint = f"for a product write {digits}*{word[0]}"
        near = nearest(word[0], UNIT_WORDS) if len(word[0]) > 1 else None
        if near is not None and not is_unit_word(word[0]):
            hint = f"did you mean the unit {near}? {hint}"
        raise error_at(text, start_of_word + 1, word[0], "a unit or an operator", hint)
    quantity = make_quantity(float(digits), unit)
    if not math.isfinite(quantity.magnitude):
        raise error_at(text, start + 1, text[start:end], "a finite number")
    return Token("number", text[start:end], start + 1, quantity, digits, unit), end


DEEPEST = 50

_SUM, _PRODUCT, _SIGN, _POWER = 1, 2, 3, 4
_BINDING = {"+": _SUM, "-": _SUM, "*": _PRODUCT, "/": _PRODUCT, "^": _POWER}


@dataclass
class _Parser:
    text: str
    tokens: tuple[Token, ...]
    position: int = 0
    depth: int = 0
    names: dict[str, None] = field(default_factory=dict)

    @property
    def next(self) -> Token:
        return self.tokens[self.position]

    def take(self) -> Token:
        token = self.next
        self.position += 1
        return token

    def expect(self, kind: str, expected: str) -> None:
        if self.next.kind != kind:
            raise self.unexpected(expected)
        self.take()

    def expression(self, weakest: int) -> Node:
        """The operand here, with every operator that binds at least as tightly as `weakest`."""
        self.depth += 1
        if self.depth > DEEPEST:
            got = Words(f"more than {DEEPEST} levels of nesting")
            raise error_at(self.text, self.next.column, got, f"at most {DEEPEST}")
        left = self.prefix()
        while (binding := _BINDING.get(self.next.kind, 0)) >= weakest:
            operator = self.take()
            # 2^3^2 is 2^(3^2), and 2^-1 works; all others apply from left to right
            right = self.expression(_SIGN if binding == _POWER else binding + 1)
            left = ParsedOperation(operator.kind, (left, right), operator.column)
        self.depth -= 1
        return left

    def prefix(self) -> Node:
        token = self.next
        if token.kind in ("+", "-"):
            self.take()
            operand = self.expression(_SIGN)  # -2^2 is -(2^2)
            return ParsedOperation("-", (operand,), token.column) if token.kind == "-" else operand
        if token.kind == "(":
            self.take()
            inner = self.expression(_SUM)
            self.expect(")", "an operator or )")
            return inner
        if token.kind not in ("number", "name"):
            raise self.unexpected("a number, a parameter, a function or (")
        self.take()
        if token.kind == "number":
            return token
        return self.call(token) if self.next.kind == "(" else self.name(token)

    def call(self, function: Token) -> Node:
        counts = RULES.get(function.text)
        if counts is None:
            expected = f"one of the functions {', '.join(RULES)}"
            hint = did_you_mean(function.text, RULES) or "write * for a product with brackets"
            raise error_at(self.text, function.column, function.text, expected, hint)
        self.take()
        arguments = []
        while self.next.kind != ")" or arguments:  # no comma before the bracket
            arguments.append(self.expression(_SUM))
            if self.next.kind == ")":
                break
            self.expect(",", "a comma or )")
        self.take()
        if len(arguments) not in counts:
            came, fewest = (f"{n} argument{'s' * (n != 1)}" for n in (len(arguments), counts[0]))
            got = Words(f"{came} of {function.text}")
            expected = f"at least {fewest}" if len(counts) > 1 else fewest
            raise error_at(self.text, function.column, got, expected)
        return ParsedOperation(function.text, tuple(arguments), function.column)

    def name(self, token: Token) -> Node:
        word, column = token.text, token.column
        if is_unit_word(word):
            raise error_at(self.text, column, word, "a number before a unit", f"write 1 {word}")
        if word in RULES:
            expected = "brackets after the name of a function"
            raise error_at(self.text, column, word, expected, f"write {word}(...)")
        if word not in CONSTANTS:
            self.names[word] = None
        return token

    def unexpected(self, expected: str) -> InputError:
        token = self.next
        got = Words("the end") if token.kind == "end" else token.text
        hint = None
        before = self.tokens[self.position - 1] if self.position else None
        if before and before.kind == "number" and token.kind == ",":
            hint = "decimals have a point, as 0.5"
        elif before and before.kind in ("number", "name", ")") and token.kind in ("name", "("):
            factor = "1 " * is_unit_word(token.text)
            hint = f"for a product write {before.text}*{factor}{token.text}"
        return error_at(self.text, token.column, got, expected, hint)


@frozen
class Expression:
    """An arithmetic expression, made by `parse`.

    Attributes
    ----------
    text : str
        As it was written.
    root : Node
        Its tree.
    names : tuple of str
        The parameters it uses, in order of appearance.
    """

    text: str
    root: Node = field(repr=False, compare=False)
    names: tuple[str, ...] = field(repr=False, compare=False)

    def evaluate(
        self, environment: Mapping[str, SIQuantity], mathematics: Mathematics = FLOATS
    ) -> SIQuantity:
        """The value, in base units (m, kg, s, rad).

        Parameters
        ----------
        environment : mapping of str to quantity
            A value for each of `names`.
        mathematics : Mathematics
            The functions of the magnitudes.

        Raises
        ------
        InputError
            If a name is unknown, dimensions do not fit, or the value is not a finite number; the
            message names the column in the text.
        """
        return self._value(self.root, environment, mathematics)

    def _value(
        self, node: Node, environment: Mapping[str, SIQuantity], mathematics: Mathematics
    ) -> SIQuantity:
        operations: list[ParsedOperation] = []
        # Along first operands, which may be many, in a loop.
        while isinstance(node, ParsedOperation):
            operations.append(node)
            node = node.operands[0]
        name = node.text
        if node.quantity is not None:
            number = mathematics.number
            result = node.quantity if number is None else number(node.digits, node.unit)
        elif name in environment:
            result = environment[name]
            if not isinstance(result, SIQuantity):
                raise error_at(self.text, node.column, f"{name} = {result!r}", "a quantity for it")
        elif name in mathematics.constants:
            result = make_quantity(mathematics.constants[name])
        else:
            expected = f"a number, or {known_names(environment)}"
            hint = did_you_mean(name, environment)
            raise error_at(self.text, node.column, name, expected, hint)
        for op in reversed(operations):
            rest = [self._value(x, environment, mathematics) for x in op.operands[1:]]
            operands = [result, *rest]
            try:
                result = functions.apply(op.name, operands, mathematics)
                known = mathematics.is_finite(result.magnitude)
            except InputError as error:
                got, expected = error.got, str(error.expected)
                raise error_at(self.text, op.column, got, expected, error.hint) from None
            except (ArithmeticError, ValueError):
                known = False
            if not known:
                got = Words(functions.in_words(op.name, operands))
                raise error_at(self.text, op.column, got, "a finite real result")
        return result

    @property
    def is_quantity(self) -> bool:
        """Whether it is one number, perhaps with a sign and a unit."""
        root = self.root
        if isinstance(root, ParsedOperation) and root.name == "-" and len(root.operands) == 1:
            (root,) = root.operands
        return isinstance(root, Token) and root.kind == "number"


def parse(text: str) -> Expression:
    """Read an expression.

    Numbers may carry a unit (``300 mm``, ``1e8 N/m``), which binds tighter than any operator.
    Then come ``^`` or ``**`` (from the right), signs, ``* /``, ``+ -``; functions are sin, cos,
    tan, asin, acos, atan, atan2, sqrt, abs, min, max and hypot, and ``pi`` is known.

    Parameters
    ----------
    text : str
        At most 1000 characters.

    Raises
    ------
    InputError
        If the text is no expression; the message names the column.

    Examples
    --------
    >>> parse("R*cos(phi) + 10 mm").names
    ('R', 'phi')
    >>> parse("2 R")
    Traceback (most recent call last):
    robostiff.errors.InputError: expression '2 R', column 3: got 'R', expected a unit or an \
operator; for a product write 2*R
    """
    if not isinstance(text, str):
        raise InputError("expression", got=text, expected="a text such as 2*R")
    return _parsed(text)


@lru_cache(maxsize=4096)  # repeated legs have the same expressions
def _parsed(text: str) -> Expression:
    parser = _Parser(text, tuple(tokens(text)))
    root = parser.expression(_SUM)
    if parser.next.kind != "end":
        raise parser.unexpected("an operator or the end")
    return Expression(text, root, tuple(parser.names))


def known_names(names: Mapping[str, object]) -> str:
    """The defined parameters as text."""
    if not names:
        return "no parameter, as none is defined"
    return f"one of the parameters {listing(list(names))}"
