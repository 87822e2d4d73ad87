"""From text to a tree, by operator precedence (Pratt)."""

from __future__ import annotations

from dataclasses import dataclass, field

from robostiff.errors import InputError
from robostiff.io.expression.functions import CONSTANTS, RULES
from robostiff.io.expression.nodes import Call, Chain, Literal, Name, Negative, Node, Power, Step
from robostiff.io.expression.tokens import Token, error_at, tokens
from robostiff.io.suggest import Words, did_you_mean
from robostiff.io.units import is_unit_word

DEEPEST = 50

_SUM, _PRODUCT, _SIGN, _POWER = 1, 2, 3, 4
_BINDING = {"+": _SUM, "-": _SUM, "*": _PRODUCT, "/": _PRODUCT, "^": _POWER}
_KINDS = {"end": "the end", "number": "a number", "name": "a name"}


def parse_tree(text: str) -> tuple[Node, tuple[str, ...]]:
    """The tree of an expression, and its parameters in order of appearance."""
    parser = _Parser(text, tuple(tokens(text)))
    root = parser.expression(_SUM)
    if parser.next.kind != "end":
        raise parser.unexpected("an operator or the end")
    return root, tuple(parser.names)


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
        """What stands here, with every operator that binds at least as tightly as `weakest`."""
        self.depth += 1
        if self.depth > DEEPEST:
            raise error_at(
                self.text,
                self.next.column,
                got=Words(f"more than {DEEPEST} levels of nesting"),
                expected=f"at most {DEEPEST}",
            )
        left = self.prefix()
        while (binding := _BINDING.get(self.next.kind, 0)) >= weakest:
            left = self.power(left) if binding == _POWER else self.chain(left, binding)
        self.depth -= 1
        return left

    def chain(self, first: Node, binding: int) -> Node:
        column, steps = self.next.column, []
        while _BINDING.get(self.next.kind) == binding:
            operator = self.take()
            operand = self.expression(binding + 1)
            steps.append(Step(operator.kind, operand, operator.column))
        return Chain(first, tuple(steps), column)

    def power(self, base: Node) -> Node:
        operator = self.take()
        return Power(base, self.expression(_SIGN), operator.column)  # 2^3^2 is 2^(3^2), 2^-1 works

    def prefix(self) -> Node:
        token = self.next
        if token.kind in ("+", "-"):
            self.take()
            operand = self.expression(_SIGN)  # -2^2 is -(2^2)
            return Negative(operand, token.column) if token.kind == "-" else operand
        if token.kind == "(":
            self.take()
            inner = self.expression(_SUM)
            self.expect(")", "an operator or )")
            return inner
        if token.kind == "number" and token.quantity is not None:
            self.take()
            return Literal(token.quantity, token.column, token.digits, token.unit)
        if token.kind == "name":
            self.take()
            return self.call(token) if self.next.kind == "(" else self.name(token)
        raise self.unexpected("a number, a parameter, a function or (")

    def call(self, function: Token) -> Node:
        rule = RULES.get(function.text)
        if rule is None:
            raise error_at(
                self.text,
                function.column,
                got=function.text,
                expected=f"one of the functions {', '.join(RULES)}",
                hint=did_you_mean(function.text, RULES) or "write * for a product with brackets",
            )
        self.take()
        arguments = []
        while self.next.kind != ")" or arguments:  # no comma before the bracket
            arguments.append(self.expression(_SUM))
            if self.next.kind == ")":
                break
            self.expect(",", "a comma or )")
        self.take()
        at_least = "at least " if rule.most > rule.fewest else ""
        if not rule.fewest <= len(arguments) <= rule.most:
            raise error_at(
                self.text,
                function.column,
                got=Words(f"{_counted(len(arguments))} of {function.text}"),
                expected=at_least + _counted(rule.fewest),
            )
        return Call(function.text, tuple(arguments), function.column)

    def name(self, token: Token) -> Node:
        if is_unit_word(token.text):
            raise error_at(
                self.text,
                token.column,
                got=token.text,
                expected="a number before a unit",
                hint=f"write 1 {token.text}",
            )
        if token.text in RULES:
            raise error_at(
                self.text,
                token.column,
                got=token.text,
                expected="brackets after the name of a function",
                hint=f"write {token.text}(...)",
            )
        if token.text not in CONSTANTS:
            self.names[token.text] = None
        return Name(token.text, token.column)

    def unexpected(self, expected: str) -> InputError:
        token = self.next
        got = Words("the end") if token.kind == "end" else token.text
        hint = None
        before = self.tokens[self.position - 1] if self.position else None
        if before and before.kind in ("number", "name", ")") and token.kind in ("name", "("):
            hint = f"for a product write {before.text}*{token.text}"
        return error_at(self.text, token.column, got=got, expected=expected, hint=hint)


def _counted(number: int) -> str:
    """A number of arguments in words."""
    return f"{number} argument{'' if number == 1 else 's'}"
