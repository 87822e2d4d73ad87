"""What all formulas have in common: their symbols, and values in place of all of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import sympy as sp

if TYPE_CHECKING:
    from robostiff.analytic.exact.definition import Definition


class Formula(ABC):
    """A formula in given symbols, perhaps by named steps."""

    definitions: Any = ()  # of each kind of formula: its named steps, in order

    @property
    @abstractmethod
    def _expressions(self) -> Iterable[Any]:
        """What it consists of beside its steps, and its conditions."""

    @property
    def is_closed(self) -> bool:
        """Whether it is written in the given symbols alone."""
        return not self.definitions

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """The given symbols, those of conditions among them, in alphabetical order."""
        steps: tuple[Definition, ...] = self.definitions
        expressions = [*self._expressions, *(d.expression for d in steps)]
        found = set().union(*(e.free_symbols for e in expressions))
        return tuple(sorted(found - {d.symbol for d in steps}, key=str))

    @property
    def free_symbols(self) -> set[sp.Symbol]:
        """The given symbols as a set, as SymPy's expressions have them."""
        return set(self.symbols)

    @abstractmethod
    def substituted(self, values: Mapping[Any, Any]) -> Any:
        """Its matrix, or two of them, at values of its symbols."""

    def evalf(self, n: int = 15, subs: Mapping[Any, Any] | None = None) -> Any:
        """The same in n digits, at values of all or some of the symbols.

        Parameters
        ----------
        n : int
            Digits.
        subs : mapping of str or Symbol to numbers, quantities or formulas, optional
            In SI units; symbols without a value stay.

        Returns
        -------
        Matrix, or a tuple of two of a derivative

        Raises
        ------
        InputError
            When the formula does not hold at these values.
        """
        found = self.substituted(subs or {})
        return tuple(M.evalf(n) for M in found) if isinstance(found, tuple) else found.evalf(n)
