"""Elements of an exact field: canonical fractions of polynomials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from robostiff.analytic.field import ExactField


@dataclass(frozen=True)
class Element:
    """An element of an exact field: a canonical fraction of polynomials.

    Supports ``+ - * /``, integer powers and ``==`` with elements and integers.
    """

    field: ExactField
    num: Any
    den: Any

    @property
    def is_zero(self) -> bool:
        """Whether it is exactly zero."""
        return bool(self.num.is_zero())

    @property
    def has_unit_denominator(self) -> bool:
        """Whether it is a polynomial."""
        return bool(self.den.is_one())

    @property
    def terms(self) -> int:
        """Number of terms of numerator and denominator together."""
        return len(self.num) + len(self.den)

    def __add__(self, other: Element | int) -> Element:
        b = self._coerced(other)
        if self.is_zero or b.is_zero:
            return b if self.is_zero else self
        if self.den == b.den:
            if self.den.is_one():
                return Element(self.field, self.num + b.num, self.den)
            return self.field.fraction(self.num + b.num, self.den)
        return self.field.fraction(self.num * b.den + b.num * self.den, self.den * b.den)

    def __mul__(self, other: Element | int) -> Element:
        b = self._coerced(other)
        if self.is_zero or b.is_zero:
            return self.field.zero
        return self.field.fraction(self.num * b.num, self.den * b.den)

    def __truediv__(self, other: Element | int) -> Element:
        b = self._coerced(other)
        return self.field.fraction(self.num * b.den, self.den * b.num)

    def __neg__(self) -> Element:
        return Element(self.field, -self.num, self.den)

    def __sub__(self, other: Element | int) -> Element:
        return self + (-self._coerced(other))

    def __rsub__(self, other: int) -> Element:
        return self._coerced(other) - self

    def __rtruediv__(self, other: int) -> Element:
        return self._coerced(other) / self

    def __pow__(self, power: int) -> Element:
        base = self if power >= 0 else 1 / self
        result = self.field.one
        for _ in range(abs(power)):
            result = result * base
        return result

    __radd__ = __add__
    __rmul__ = __mul__

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Element | int):
            return NotImplemented
        return (self - self._coerced(other)).is_zero

    __hash__ = None  # type: ignore[assignment]

    def _coerced(self, other: Element | int) -> Element:
        if isinstance(other, Element):
            return other
        return Element(self.field, self.field.ring.constant(other), self.field.ring.constant(1))
