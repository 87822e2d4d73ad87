"""The tree of an arithmetic expression: small frozen nodes, each with its column (1-based)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from robostiff.io.units import Quantity, Unit


@dataclass(frozen=True)
class Literal:
    """A number, with its unit if it has one: in base units, and as it was written."""

    quantity: Quantity
    column: int
    digits: str
    unit: Unit | None


@dataclass(frozen=True)
class Name:
    """A parameter."""

    name: str
    column: int


@dataclass(frozen=True)
class Negative:
    """Unary minus."""

    operand: Node
    column: int


@dataclass(frozen=True)
class OperatorStep:
    """One operator of a chain, and its right operand."""

    operator: str
    operand: Node
    column: int


@dataclass(frozen=True)
class OperatorChain:
    """Operators of one precedence, applied from left to right: ``a - b + c`` or ``a / b * c``.

    A long sum is one flat node, so that evaluation needs no deep recursion.
    """

    first: Node
    steps: tuple[OperatorStep, ...]
    column: int


@dataclass(frozen=True)
class Power:
    """``base ^ exponent``."""

    base: Node
    exponent: Node
    column: int


@dataclass(frozen=True)
class Call:
    """A function of the table, applied."""

    function: str
    arguments: tuple[Node, ...]
    column: int


Node: TypeAlias = Literal | Name | Negative | OperatorChain | Power | Call
