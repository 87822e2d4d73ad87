"""Records read with the lengths and cosines of a generic leg as names."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.springs.contributions import ContributionReader
from robostiff.record import Entry, Record

_SAME = 1e-9


class KnownReading(NamedReading):
    """Reads entries with names for scalars of the leg, recognised at the samples.

    `known`: list of (values at the samples, symbol).
    """

    def __init__(
        self, record: Record, symbols: dict[str, sp.Symbol], springs: Iterable[Definition]
    ) -> None:
        super().__init__(record, symbols, springs)
        self.known: list[tuple[np.ndarray, Any]] = []

    def length(self, value: Any) -> Any:
        """A length, written out: it differs from leg to leg."""
        return self(self.record.simplified(value))

    def _expression(self, value: Any) -> Any:
        return self._of_step(value.step) if isinstance(value, Entry) else super()._expression(value)

    def _of_step(self, step: int) -> Any:
        """A step from its known parts: what lies before these is not read."""
        if step not in self._raw:
            found = self._recognised(step)
            if found is None:
                for argument in self.record.arguments(step):
                    self._of_step(argument)
                found = self._written(step)
            self._raw[step] = found
        return self._raw[step]

    def _recognised(self, step: int) -> Any:
        at = self.record.sample(step)
        for other, symbol in self.known:
            for sign in (1, -1):
                if np.max(np.abs(at - sign * other)) <= _SAME * np.max(np.abs(other)):
                    return sign * symbol
        return None


class KnownContributions(ContributionReader):
    """Writes contributions with names for known squares of the leg."""

    def _sum(self, *pairs: tuple[Any, Any]) -> Any:
        total: Any = sum((x * y for x, y in pairs), sp.Integer(0))
        total = self.record.simplified(total, self.length)
        if isinstance(total, Entry):
            at = total.sample
            for other, symbol in getattr(self.read, "known", ()):
                if np.max(np.abs(at - other**2)) <= _SAME * np.max(np.abs(other)) ** 2:
                    return symbol**2
        return super()._sum(*pairs)
