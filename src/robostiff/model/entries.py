"""Replacing or listing every number of a robot, and giving its symbols values."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import is_dataclass, replace
from decimal import Context, Decimal, localcontext
from functools import cached_property
from typing import Any, Self, TypeVar

import numpy as np

from robostiff.elasticity.checks import Bounds, error_at
from robostiff.errors import InputError
from robostiff.model.batched import names_of
from robostiff.model.joint import Actuated, Locked
from robostiff.spatial.formula import exact_number, is_formula

Part = TypeVar("Part")
OfSymbols = TypeVar("OfSymbols", bound="Symbolic")

# Limits and laws of drives, nominal values of symbols and left out shear are no part of a formula.
_NO_ENTRIES = frozenset(("limits", "nominal", "meanings", "units", "laws", "shear_left_out"))


def with_entries(
    robot: Part, convert: Callable[[Any], Any], others: Mapping[int, Any] | None = None
) -> Part:
    """The same robot, or part of one, with ``convert(entry)`` in place of every number or formula.

    Parameters
    ----------
    robot : Robot, Linkage, or a part of one
    convert : callable
        Gets a Python float, or a formula as it is; gives a float or a formula, of SymPy or of any
        kind that has ``free_symbols``. The limits of drives and the nominal values of symbols are
        no entries and stay.
    others : mapping of int to parts, optional
        Parts that are converted in place of those of the robot, by the ids of these.

    Returns
    -------
    Robot, Linkage or part
        With arrays of floats where all their entries are floats, and of objects elsewhere.

    Raises
    ------
    InputError
        When an entry cannot be what it has become, such as a negative area.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> from robostiff.spatial import exact_number
    >>> with_entries(load("planar-link"), exact_number).legs[0].chain.elements[0].to
    array([1/2, 0, 0], dtype=object)
    """
    known: dict[int, tuple[Any, Any]] = {}  # many formulas are one object, such as 0 and 1

    def once(value: Any) -> Any:
        if not is_formula(value):
            return convert(value)
        if id(value) not in known:
            known[id(value)] = value, convert(value)
        return known[id(value)][1]

    return _converted(robot, once, {}, lambda array: array, others or {})


def as_meant(robot: Part) -> Part:
    """The same robot, or part of one, with the numbers that were meant in place of rounded ones.

    A component of a vector or rotation that is rounding beside the largest one is 0, and a number
    that rounding separates from a short decimal is this one. So no rounding enters a formula.
    """

    def meant(value: Any) -> Any:
        if is_formula(value):
            return value
        short = float(f"{value:.{_SHORT}g}")
        return short if abs(value - short) <= _ROUNDING * abs(short) else value

    def without_remainders(values: np.ndarray) -> np.ndarray:
        if values.dtype == object or values.shape not in ((3,), (3, 3)):
            return values
        size = np.linalg.norm(values, axis=0)
        return np.where(np.abs(values) <= _ROUNDING * size, 0.0, values)

    return _converted(robot, meant, {}, without_remainders, {})


_ROUNDING = 4 * float(np.finfo(float).eps)
_SHORT = 12  # digits of a number as it is written
_IN_DIGITS = Context(prec=30)  # a formula before it is rounded to a float


def formulas(part: Any, seen: set[int] | None = None) -> Iterator[Any]:
    """Every formula of a robot, or of a part of one; exact SymPy numbers among them.

    A part in several places is looked at once: `seen` has those before.
    """
    seen = set() if seen is None else seen
    if is_formula(part):
        yield part
    elif isinstance(part, np.ndarray):
        if part.dtype == object:
            yield from filter(is_formula, part.flat)
    elif isinstance(part, tuple):
        for member in part:
            yield from formulas(member, seen)
    elif is_dataclass(part) and id(part) not in seen:
        seen.add(id(part))
        for name in names_of(type(part)):
            if name not in _NO_ENTRIES:
                yield from formulas(getattr(part, name), seen)


def _converted(
    part: Any,
    convert: Callable[[Any], Any],
    known: dict[int, Any],
    prepared: Callable[[np.ndarray], np.ndarray],
    others: Mapping[int, Any],
) -> Any:
    """A part with other entries; what is one part in several places stays one."""
    if is_formula(part):
        return convert(part)
    if isinstance(part, int | float | np.number) and not isinstance(part, bool):
        return convert(float(part))
    if isinstance(part, np.ndarray):
        values = prepared(part)
        entries = values.ravel().tolist()
        if values.dtype == object:
            entries = [value if is_formula(value) else float(value) for value in entries]
        converted = [*map(convert, entries)]
        kinds = {type(x): x for x in converted}.values()
        kind = object if any(map(is_formula, kinds)) else float
        # One by one: some entries look like sequences to NumPy.
        return np.fromiter(converted, dtype=kind).reshape(values.shape)
    if isinstance(part, tuple):
        return tuple(_converted(member, convert, known, prepared, others) for member in part)
    if is_dataclass(part):
        if id(part) not in known:
            own = others.get(id(part), part)
            values = {
                name: getattr(own, name)
                if name in _NO_ENTRIES
                else _converted(getattr(own, name), convert, known, prepared, others)
                for name in names_of(type(own))
            }
            known[id(part)] = type(own)(**values)  # pyright: ignore[reportCallIssue]
        return known[id(part)]
    return part


def free_symbols(robot: Any) -> tuple[Any, ...]:
    """The symbols in the formulas of a robot, sorted by name."""
    symbols = set().union(*(formula.free_symbols for formula in formulas(robot)))
    return tuple(sorted(symbols, key=str))


def bounds_of(part: Any, name: str) -> Iterator[tuple[str, Bounds]]:
    """Inequalities of all parts, each with the name of its part."""
    if isinstance(part, tuple):
        for member in part:
            yield from bounds_of(member, name)
    elif isinstance(part, Actuated | Locked):
        if is_formula(part.stiffness):
            yield name, Bounds("stiffness", part.stiffness)
    elif is_dataclass(part):
        bounds = getattr(part, "bounds", None)
        owner = getattr(part, "name", name) if bounds is None else name
        yield from ((name, x) for x in bounds or ())
        for member in names_of(type(part)):
            if member != "bounds":
                yield from bounds_of(getattr(part, member), owner)


class Symbolic:
    """A robot or linkage: its entries are numbers or formulas."""

    name: str
    nominal: Mapping[str, float]

    @cached_property
    def symbols(self) -> tuple[Any, ...]:
        """The SymPy symbols that its formulas depend on, sorted by name."""
        return free_symbols(self) if self.has_formulas else ()

    @cached_property
    def has_formulas(self) -> bool:
        """Whether any entry is a formula, be it an exact number."""
        return any(True for _ in formulas(self))

    @cached_property
    def inequalities(self) -> tuple[tuple[str, Bounds], ...]:
        """Inequalities in its symbols without which a part does not exist, by name of the part.

        Factors whose squares are below roots keep the signs of the nominal values: where one
        vanishes, so does a beam; beyond, it points the other way. The samples of a record are on
        one side, and what depends on the side is a number there.
        """
        if not self.has_formulas:  # of which a robot in numbers has none, without SymPy
            return ()
        import sympy as sp

        bounds = [(self.name, Bounds(f"parameter {x}", x)) for x in self.symbols if x.is_positive]
        unlike: dict[Any, tuple[str, Bounds]] = {}
        powers = (x for f in formulas(self) for x in f.atoms(sp.Pow))
        squares = {x.base for x in powers if getattr(x.exp, "q", 1) == 2 and x.base.is_Add}
        nominal = {x: self.nominal[str(x)] for x in self.symbols} if squares else {}
        hint = "a beam turns round there: load the model with such values to compile it"
        parts = (part for x in squares for part in sp.fraction(sp.together(x)))
        for factor, times in (pair for part in parts for pair in sp.sqf_list(part)[1]):
            if times % 2 == 0 and not factor.is_positive:
                value = factor if factor.subs(nominal) > 0 else -factor
                bounds.append((self.name, Bounds(str(value), value, hint=hint)))
        bounds += [(name, x) for name, x in bounds_of(self, self.name) if x.is_open]
        for name, x in bounds:
            key = x.low, x.value, x.high, x.or_at  # legs alike have the same
            unlike.setdefault(key, (name, x))
        return tuple(unlike.values())

    def error_at(self, rows: np.ndarray) -> InputError | None:
        """What says that a part does not exist at one of the values (symbols, N), if any."""
        return error_at(self.inequalities, self.symbols, rows) if self.inequalities else None

    @cached_property
    def numeric(self) -> Self:
        """The same with all symbols at their nominal values.

        Raises
        ------
        InputError
            When a symbol has none.
        """
        if not self.has_formulas:
            return self
        missing = [str(symbol) for symbol in self.symbols if str(symbol) not in self.nominal]
        if missing:
            raise InputError(
                f"symbols of the robot {self.name!r}",
                got=", ".join(missing),
                expected="a nominal value for each",
                hint=f"write robot.substituted({{{missing[0]!r}: ...}})",
            )
        names = map(str, self.symbols)
        return self.substituted({name: self.nominal[name] for name in names})

    @cached_property
    def in_floats(self) -> Self:
        """The same with floats in place of exact numbers; InputError where it has symbols."""
        if not self.has_formulas:
            return self
        if not self.symbols:
            return self.substituted({})
        names = [str(symbol) for symbol in self.symbols]
        raise InputError(
            f"robot {self.name!r}",
            got="symbols without a number: " + ", ".join(names),
            expected="numbers throughout",
            hint=f"write robot.substituted({{{names[0]!r}: ...}}), robot.numeric for the values of "
            "the model file, or rs.derive(robot) for formulas",
        )

    def substituted(self, values: Mapping[Any, Any]) -> Self:
        """The same with values in place of some of its symbols.

        Parameters
        ----------
        values : mapping of str or Symbol to float or formula
            In SI units.

        Returns
        -------
        Robot or Linkage
            All floats when no symbol is left; otherwise numbers beside formulas stay exact.

        Raises
        ------
        InputError
            When a name is no symbol of the robot, or a formula has no real value there.
        """
        by_name = {str(name): value for name, value in values.items()}
        names = dict.fromkeys(map(str, self.symbols))
        for name in (x for x in by_name if x not in names):
            expected = ", ".join(names) or "none, as it has no symbols"
            raise InputError(f"symbol of the robot {self.name!r}", got=name, expected=expected)
        symbols = [symbol for symbol in self.symbols if str(symbol) in by_name]
        chosen = {x: exact_number(by_name[str(x)]) for x in symbols}
        for symbol, value in chosen.items():
            if (symbol.is_positive and value.is_positive is False) or (
                symbol.is_real and value.is_real is False
            ):
                raise InputError(
                    f"value of {symbol}",
                    got=str(value),
                    expected="a positive number" if symbol.is_positive else "a real number",
                    hint="the formulas were made for a symbol with this assumption",
                )
        rest = set(self.symbols) - chosen.keys()
        rest = rest.union(*(value.free_symbols for value in chosen.values()))

        known: dict[Any, Any] = {}  # legs have the same formulas

        def put_in(entry: Any) -> Any:
            if isinstance(entry, float):
                return entry
            if entry not in known:
                # While symbols are left, numbers beside them stay exact.
                known[entry] = entry.xreplace(chosen) if rest else _number(entry, chosen)
            return known[entry]

        nominal = {name: value for name, value in self.nominal.items() if name not in by_name}
        result = replace(with_entries(self, put_in), nominal=nominal)  # pyright: ignore
        if not rest:
            vars(result).update(symbols=(), has_formulas=False)  # as they are, without looking
        return result


def _number(formula: Any, values: Mapping[Any, Any]) -> float:
    try:
        with localcontext(_IN_DIGITS):
            number = float(_decimal(formula, values))
    except ArithmeticError:  # complex, or infinite
        number = np.nan
    if not np.isfinite(number):
        subject = "formula of the robot at these values"
        expected = "a real finite number"
        raise InputError(subject, got=str(formula), expected=expected, hint="choose other values")
    return number


def _decimal(formula: Any, values: Mapping[Any, Any]) -> Decimal:
    formula = values.get(formula, formula)
    if formula.is_Rational:
        return Decimal(int(formula.p)) / int(formula.q)
    if formula.is_Mul:
        return math.prod((_decimal(x, values) for x in formula.args), start=Decimal(1))
    if formula.is_Pow and formula.exp.is_Rational:
        return _decimal(formula.base, values) ** _decimal(formula.exp, values)
    # Replaced before: evalf leaves a remainder of differences that are exactly zero.
    return Decimal(str(formula.xreplace(values).evalf(_IN_DIGITS.prec)))
