"""What differs between the legs of a robot: angles of points on circles, or coordinates."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.vectors.vector_expressions import Coordinates, Equation, Turned
from robostiff.errors import InputError

_FULL_TURN = 1440  # quarters of a degree
_SAME = 1e-9
_WHOLE = 1e-6
_SLOPE = 0.1  # in place of zero
_STEP = 0.01  # of an angle, to see which points turn with it


@dataclass
class LegTable:
    """Columns of what differs, one row a leg.

    `nominal`: of the symbols, to distinguish angles from their cosines.
    """

    nominal: dict[str, float]
    columns: dict[str, list[Any]] = field(default_factory=dict)  # by name
    angles: list[str] = field(default_factory=list)

    def equations(
        self, letter: str, angle: str, each: Sequence[Sequence[Any]], rotation: str | None = None
    ) -> list[Equation]:
        """The equation of a vector of all legs, with an angle where they lie on a circle about z.

        It is turned where there is a rotation. None where all three coordinates differ between the
        legs: then the vector itself is a column, unless it is turned.

        Examples
        --------
        >>> r = sp.Symbol("r", positive=True)
        >>> table = LegTable({"r": 0.3})
        >>> table.equations("b", "psi", [(r, 0, 0), (0, r, 0)])[0].expression.parts
        (r*cos(psi_i), r*sin(psi_i), 0)
        >>> table.columns
        {'psi_i': [0, pi/2]}
        """
        found = first = tuple(map(sp.sympify, each[0]))
        if not all(_are_same(first, v) for v in each[1:]):
            # Points that are as far from the z axis, and as high, have a radius and angles.
            polar = [
                self.polar(*map(sp.sympify, v[:2])) for v in each if _are_same(first[2:], v[2:])
            ]
            known = [x for x in polar if x and polar[0] and _are_same(polar[0][:1], x[:1])]
            differ = (any(not _are_same((v[k],), (first[k],)) for v in each[1:]) for k in range(3))
            if len(known) == len(each):
                radius, turned = known[0][0], self.angle(angle, [x for _, x in known])
                found = radius * sp.cos(turned), radius * sp.sin(turned), first[2]
            elif rotation is None and all(differ):
                self.columns[f"{letter}_i"] = [Coordinates(*map(sp.sympify, v)) for v in each]
                return []
            else:
                columns = enumerate("xyz")
                found = [self.scalar(f"{letter}_i{x}", [v[k] for v in each]) for k, x in columns]
        vector = Coordinates(*found)
        return [Equation(f"{letter}_i", vector if rotation is None else Turned(rotation, vector))]

    def keep(self, used: Container[str]) -> None:
        """Leave the columns that are used."""
        self.columns = {name: x for name, x in self.columns.items() if name in used}
        self.angles = [name for name in self.angles if name in used]

    def angle(self, name: str, each: Sequence[Any]) -> Any:
        """An angle of all legs: a column, perhaps of another one from which it differs by one."""
        if all(x == each[0] for x in each):
            return each[0]
        for known in self.angles:
            apart = {_wrapped(a - b) for a, b in zip(each, self.columns[known], strict=True)}
            if len(apart) == 1:
                return sp.Symbol(known, real=True) + apart.pop()
        self.columns[f"{name}_i"] = list(each)
        self.angles.append(f"{name}_i")
        return sp.Symbol(f"{name}_i", real=True)

    def turns_of_one_another(self) -> list[list[int]] | None:
        """Legs that turns about z map on one another; None where more than angles differ."""
        if not self.angles or len(self.angles) < len(self.columns):
            return None
        first = self.columns[self.angles[0]]
        groups: dict[tuple[Any, ...], list[int]] = {}
        for leg, start in enumerate(first):
            angles = [self.columns[name][leg] for name in self.angles[1:]]
            key = tuple(_wrapped(angle - start) for angle in angles)
            # With a symbol, legs may also turn by it: these are no turns of one another.
            groups.setdefault((*key, start - _number(start)), []).append(leg)
        return list(groups.values())

    def scalar(self, name: str, each: Sequence[Any]) -> Any:
        """A scalar of all legs: its formula where they have one, a column otherwise."""
        if all(_are_same((each[0],), (x,)) for x in each[1:]):
            return sp.sympify(each[0])
        self.columns[name] = [sp.sympify(x) for x in each]
        return sp.Symbol(name, real=True)

    def polar(self, x: Any, y: Any) -> tuple[Any, Any] | None:
        """Radius and angle of a point in the plane; None where they are no short formulas."""
        symbols = sorted(x.free_symbols | y.free_symbols, key=str)
        turning = [
            s
            for s in symbols
            if any(s in f.free_symbols for f in (x + sp.I * y).atoms(sp.sin, sp.cos))
        ]

        # At a slope of zero, what slopes has no angle.
        near = {s.name: self.nominal.get(s.name, 1.0) or _SLOPE for s in symbols}

        def angle(**other: float) -> float:
            values = {s: near[s.name] + other.get(s.name, 0.0) for s in symbols}
            across, up = map(float, values_of([x, y], values))
            return float(np.arctan2(up, across))

        here = angle()
        slopes = {s: (angle(**{s.name: _STEP}) - here) / _STEP for s in turning}
        if any(abs(n - round(n)) > _WHOLE for n in slopes.values()):
            return None
        slopes = {s: round(n) for s, n in slopes.items()}
        written = sum((n * s for s, n in slopes.items()), sp.Integer(0))
        start = here - sum(n * near[s.name] for s, n in slopes.items())
        quarters = start / (2 * np.pi) * _FULL_TURN
        if abs(quarters - round(quarters)) > _SAME * _FULL_TURN:
            return None
        written += _wrapped(2 * sp.pi * sp.Rational(round(quarters), _FULL_TURN))
        square = sp.expand(sp.expand_trig(x**2 + y**2))
        known = ExactField([square])
        square = known.expression(known.element(square))
        in_sines = sp.expand(square.replace(sp.cos, lambda t: sp.sqrt(1 - sp.sin(t) ** 2)))
        for form in dict.fromkeys((square, in_sines)):
            radius = sp.sqrt(sp.factor(form)).replace(sp.Abs, lambda size: size)
            if _are_same((radius * sp.cos(written), radius * sp.sin(written)), (x, y)):
                return radius, written
        return None


def _number(angle: Any) -> Any:
    """The part of a sum without symbols."""
    terms = sp.Add.make_args(sp.expand(angle))
    return sum((t for t in terms if not t.free_symbols), sp.Integer(0))


def _wrapped(angle: Any) -> Any:
    """The same angle between 0 and a full turn, as far as it is a number."""
    number = _number(angle)
    return sp.expand(angle) - number + number % (2 * sp.pi)


def _are_same(first: Sequence[Any], other: Sequence[Any]) -> bool:
    """Whether formulas are equal, in exact arithmetic."""
    for a, b in zip(first, other, strict=True):
        difference = sp.expand_trig(sp.sympify(a) - sp.sympify(b))
        if difference == 0:
            continue
        try:
            known = ExactField([difference])
            if not known.element(difference).is_zero:
                return False
        except InputError:
            return False
    return True
