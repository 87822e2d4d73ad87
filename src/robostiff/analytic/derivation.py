"""A derivation of K_C: its first matrix, what each passive joint subtracts, and the result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import sympy as sp

from robostiff.errors import InputError

if TYPE_CHECKING:
    from robostiff.analytic.exact_matrix import ExactMatrix


@dataclass(frozen=True)
class Unwritten:
    """A formula in exact arithmetic, and a function that writes it.

    Attributes
    ----------
    write : callable
        Returns the SymPy expression or matrix.
    """

    write: Callable[[], Any]


class WrittenField:
    """A field of a frozen dataclass that may be given as `Unwritten`; it is written at first use.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Answer:
    ...     value: WrittenField = WrittenField()
    >>> Answer(Unwritten(lambda: 6 * 7)).value
    42
    >>> Answer(42) == Answer(Unwritten(lambda: 6 * 7))
    True
    """

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type) -> Any:
        if instance is None:
            # So that dataclass() sees a field without a default.
            raise AttributeError(self._name)
        value = instance.__dict__[self._name]
        if isinstance(value, Unwritten):
            value = instance.__dict__[self._name] = value.write()
        return value

    def __set__(self, instance: Any, value: Any) -> None:
        instance.__dict__[self._name] = value


@dataclass(frozen=True)
class Definition:
    """A named intermediate: ``symbol = expression`` of symbols given or defined before.

    Attributes
    ----------
    symbol : sympy.Symbol
    expression : sympy.Expr
    """

    symbol: sp.Symbol
    expression: sp.Expr


@dataclass(frozen=True)
class Stage:
    """One passive joint, eq. (15): u = K J, mu = J^T u, K <- K - u u^T / mu.

    A closed form writes u, mu and K in SymPy when they are first looked at.

    Attributes
    ----------
    joint : str
        Name of the joint.
    J : sympy.ImmutableMatrix
        Its column of J_q (n x 1).
    rule : str
        In words what the stage does, such as "trivial joint (19): row and column 6 vanish".
    u : sympy.ImmutableMatrix
        (n x 1).
    mu : sympy.Expr
        0 for a redundant joint, which leaves K unchanged.
    K : sympy.ImmutableMatrix
        Stiffness after the joint (n x n).
    definitions : tuple of Definition
        Intermediates that this stage names, in order; empty in closed form.
    """

    joint: str
    J: sp.ImmutableMatrix
    rule: str
    u: WrittenField = WrittenField()
    mu: WrittenField = WrittenField()
    K: WrittenField = WrittenField()
    definitions: tuple[Definition, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        return Stage, tuple(getattr(self, attribute.name) for attribute in fields(self))

    @property
    def is_redundant(self) -> bool:
        """Whether the joint adds no freedom to those before it."""
        return self.mu == 0


@dataclass(frozen=True)
class Derivation:
    """A stiffness matrix as a formula, with its derivation.

    A closed form writes K in SymPy when it is first looked at.

    Attributes
    ----------
    name : str
    K0 : sympy.ImmutableMatrix
        Stiffness without passive joints (n x n).
    stages : tuple of Stage
        One a passive joint, in the order of elimination.
    K : sympy.ImmutableMatrix
        The result (n x n), in symbols given or defined.
    definitions : tuple of Definition
        All named intermediates in the order in which they can be computed; empty in closed form.
    exact : ExactMatrix or None
        A closed form of K before it is written in SymPy: polynomials over one denominator.
    """

    name: str
    K0: sp.ImmutableMatrix
    stages: tuple[Stage, ...]
    K: WrittenField = WrittenField()
    definitions: tuple[Definition, ...] = ()
    exact: ExactMatrix | None = field(default=None, compare=False, repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        # FLINT's polynomials cannot be pickled.
        return Derivation, (self.name, self.K0, self.stages, self.K, self.definitions)

    def _repr_html_(self) -> str:
        from robostiff.analytic.export.html import derivation_html

        return derivation_html(self, first_heading=3)

    @property
    def is_closed(self) -> bool:
        """Whether K is written in the given symbols alone."""
        return not self.definitions

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """The given symbols, in alphabetical order."""
        expressions = [*self.K, *(d.expression for d in self.definitions)]
        found = set().union(*(e.free_symbols for e in expressions))
        defined = {d.symbol for d in self.definitions}
        return tuple(sorted(found - defined, key=str))

    def substituted(self, values: dict[sp.Symbol, float]) -> sp.ImmutableMatrix:
        """K at given values, the definitions computed one after the other.

        Raises
        ------
        InputError
            When a symbol has no value.
        """
        missing = [str(symbol) for symbol in self.symbols if symbol not in values]
        if missing:
            raise InputError("values of symbols", got=f"none for {', '.join(missing)}")
        known: dict[sp.Basic, sp.Basic] = {s: sp.sympify(v) for s, v in values.items()}
        for definition in self.definitions:
            known[definition.symbol] = definition.expression.xreplace(known)
        return sp.ImmutableMatrix(self.K.xreplace(known))
