"""Expressions: parsed once, evaluated with any values of their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from types import MappingProxyType
from typing import Any

from robostiff.errors import InputError
from robostiff.io.expression import functions
from robostiff.io.expression.functions import FLOATS, Mathematics, Refusal
from robostiff.io.expression.parser import (
    Literal,
    Name,
    Node,
    ParsedOperation,
    error_at,
    parse_tree,
)
from robostiff.io.suggest import Words, did_you_mean, listing
from robostiff.io.units import SIQuantity, Unit, exact_quantity, make_quantity
from robostiff.spatial.formula import exact_number, is_possible


@dataclass(frozen=True)
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

        Examples
        --------
        >>> parse("2 * 300 mm").evaluate({}).magnitude
        0.6
        """
        return _Evaluation(self.text, environment, mathematics).value(self.root)

    @property
    def is_quantity(self) -> bool:
        """Whether it is one number, perhaps with a sign and a unit."""
        root = self.root
        if isinstance(root, ParsedOperation) and root.is_sign:
            (root,) = root.operands
        return isinstance(root, Literal)


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
    root, names = parse_tree(text)
    return Expression(text, root, names)


@dataclass(frozen=True)
class _Evaluation:
    text: str
    environment: Mapping[str, SIQuantity]
    mathematics: Mathematics

    def value(self, node: Node) -> SIQuantity:
        operations: list[ParsedOperation] = []
        # Along first operands, which may be many, in a loop.
        while isinstance(node, ParsedOperation):
            operations.append(node)
            node = node.operands[0]
        result = self.named(node) if isinstance(node, Name) else self.literal(node)
        for own in reversed(operations):
            result = self.applied(own, [result, *map(self.value, own.operands[1:])])
        return result

    def literal(self, node: Literal) -> SIQuantity:
        if self.mathematics.number is None:
            return node.quantity
        return self.mathematics.number(node.digits, node.unit)

    def named(self, node: Name) -> SIQuantity:
        if node.name in self.environment:
            value = self.environment[node.name]
            if not isinstance(value, SIQuantity):
                raise self.error(node.column, f"{node.name} = {value!r}", "a quantity for it")
            return value
        if node.name in self.mathematics.constants:
            return make_quantity(self.mathematics.constants[node.name])
        raise error_at(
            self.text,
            node.column,
            got=node.name,
            expected=known_names(self.environment),
            hint=did_you_mean(node.name, self.environment),
        )

    def applied(self, node: ParsedOperation, operands: list[SIQuantity]) -> SIQuantity:
        """The result of an operation, if there is one."""
        try:
            result = functions.apply(node.name, operands, self.mathematics)
            if self.mathematics.is_finite(result.magnitude):
                return result
        except Refusal as refusal:
            raise self.error(node.column, refusal.got, refusal.expected, refusal.hint) from None
        except (ArithmeticError, ValueError):
            pass
        words = Words(functions.in_words(node.name, operands))
        raise self.error(node.column, words, "a finite real result")

    def error(self, column: int, got: str, expected: str, hint: str | None = None) -> InputError:
        return error_at(self.text, column, got=got, expected=expected, hint=hint)


def known_names(names: Mapping[str, object]) -> str:
    """The defined parameters as text."""
    if not names:
        return "no parameter, as none is defined"
    return f"one of the parameters {listing(list(names))}"


_MOST_BITS = 4096  # of a fraction: far more than data need, far less than the memory


@cache
def exact_mathematics() -> Mathematics:
    """The functions of SymPy expressions.

    Examples
    --------
    >>> from robostiff.io.expression import parse
    >>> parse("0.25 mm * cos(120 deg)").evaluate({}, exact_mathematics()).magnitude
    -1/8000
    """
    import sympy as sp

    def hypot(*values: Any) -> Any:
        return sp.sqrt(sum(value**2 for value in values))

    def number(digits: str, unit: Unit | None) -> SIQuantity:
        # Numbers far below the range of floats would need too much memory.
        return exact_quantity(sp.Rational(digits) if float(digits) else sp.Integer(0), unit)

    def power(base: Any, exponent: Any) -> Any:
        # A parameter is a float in the formula of a coordinate.
        base, exponent = sp.sympify(base), sp.sympify(exponent)
        if exponent.is_Float and float(exponent).is_integer():
            exponent = sp.Integer(int(exponent))  # of a polynomial
        if base.is_Rational and exponent.is_Rational:
            bits = max(int(base.p).bit_length(), int(base.q).bit_length())
            if bits * abs(float(exponent)) > _MOST_BITS:
                got = f"a power of {_MOST_BITS} binary digits or more"
                raise Refusal(got, "a number that can be written out")
        return base**exponent

    names = "sin cos tan asin acos atan atan2 sqrt"
    functions = {name: getattr(sp, name) for name in names.split()}
    functions |= {"abs": sp.Abs, "min": sp.Min, "max": sp.Max, "hypot": hypot, "pow": power}
    return Mathematics(
        MappingProxyType(functions),
        MappingProxyType({"pi": sp.pi}),
        is_possible,
        number,
        exact_number,
    )
