"""Inequalities without which a section, material or drive does not exist."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from robostiff.errors import InputError
from robostiff.spatial.formula import exact_together, is_above


@dataclass(frozen=True)
class Bounds:
    """``low < value < high`` of a number of a part; InputError where that is certainly wrong."""

    subject: str
    value: Any
    low: Any = 0
    high: Any = None
    expected: str = "a positive number"
    hint: str | None = None

    def __post_init__(self) -> None:
        if any(is_above(0, x, or_at=True) for x in self.differences.values()):
            raise InputError(self.subject, got=self.value, expected=self.expected, hint=self.hint)

    @property
    def differences(self) -> dict[str, Any]:
        """What is positive where they hold, by words."""
        low, value, high = exact_together(self.low, self.value, self.high)
        above = {f"more than {low}": value - low}
        return above if high is None else {**above, self.expected: high - value}

    @property
    def is_open(self) -> bool:
        """Whether a formula leaves them open."""
        return not all(is_above(x, 0) for x in self.differences.values())


def left_open(bounds: Iterable[Bounds]) -> tuple[Bounds, ...]:
    """Those that formulas leave open."""
    return tuple(x for x in bounds if x.is_open)
