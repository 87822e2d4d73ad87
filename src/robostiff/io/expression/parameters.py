"""Named parameters that may depend on each other, in any order."""

from __future__ import annotations

import graphlib
import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from numbers import Real
from types import MappingProxyType
from typing import Any

from robostiff.errors import InputError, Words, warn_of_slip
from robostiff.io.expression.expression import Expression, known_names, parse
from robostiff.io.expression.functions import CONSTANTS, FLOATS, RULES, Mathematics
from robostiff.io.suggest import did_you_mean
from robostiff.io.units import SIQuantity, is_unit_word, make_quantity, own_quantity

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
_MOST = 4000
_LONGEST_SHOWN = 70
_FAR = 999.0  # times what a parameter was: as millimetres that are taken for metres


class ParameterError(InputError):
    """A parameter that cannot be used; `name` is its name."""

    def __init__(self, name: str, *, within: str | None = None, **words: Any) -> None:
        self.name = name
        subject = f"parameter {name}" if within is None else f"parameter {name}: {within}"
        super().__init__(subject, **words)


def parameter_values(
    definitions: Mapping[str, Any],
    overrides: Mapping[str, Any] = MappingProxyType({}),
    mathematics: Mathematics = FLOATS,
) -> dict[str, SIQuantity]:
    """Values of parameters, in base units and in the order of their definitions.

    Parameters
    ----------
    definitions : mapping of str to (str or float)
        Texts are expressions, which may use other parameters in any order.
    overrides : mapping of str to (str, float or quantity), optional
        Other definitions for some of them. What is overridden keeps its dimension; a bare number
        takes the SI unit of what it replaces.
    mathematics : Mathematics
        The functions of the magnitudes.

    Raises
    ------
    ParameterError
        If a name or a definition cannot be used, parameters depend on themselves, or an override
        names no parameter or has another dimension.

    Examples
    --------
    >>> parameter_values({"h": "2*R", "R": "300 mm"}, overrides={"R": "0.5 m"})["h"].magnitude
    1.0
    """
    if len(definitions) > _MOST:
        got = Words(f"{len(definitions)} parameters")
        raise ParameterError(str(list(definitions)[_MOST]), got=got, expected=f"at most {_MOST}")
    for name in definitions:
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            expected = "letters a-z, digits and underscores, with a letter first"
            raise ParameterError(str(name), got=Words("this name"), expected=expected)
        kinds = {
            "a unit": is_unit_word(name),
            "a function": name in RULES,
            "a constant": name in CONSTANTS,
        }
        for kind in (word for word, is_taken in kinds.items() if is_taken):
            got = Words(f"the name of {kind}")
            hint = f"write for instance {name}_0"
            raise ParameterError(name, got=got, expected="another name", hint=hint)
    values = _evaluate_all(definitions, mathematics)
    if not overrides:
        return values
    for name in overrides:
        if name not in definitions:
            got = Words("a value for a parameter that is not defined")
            hint = did_you_mean(str(name), definitions)
            raise ParameterError(str(name), got=got, expected=known_names(definitions), hint=hint)
    return _evaluate_all({**definitions, **overrides}, mathematics, overrides, values)


def _evaluate_all(
    definitions: Mapping[str, str | float],
    mathematics: Mathematics,
    overrides: Mapping[str, object] | None = None,
    original: Mapping[str, SIQuantity] | None = None,
) -> dict[str, SIQuantity]:
    """Every parameter, those first that others need; overridden ones keep their dimension."""
    expressions: dict[str, Expression | SIQuantity] = {}
    for name, value in definitions.items():
        with _within(name):
            is_text = isinstance(value, str)
            expressions[name] = parse(value) if is_text else _bare_number(value, mathematics)
    uses = {}
    for name, expression in expressions.items():
        uses[name] = expression.names if isinstance(expression, Expression) else ()
        for used in uses[name]:
            if used not in expressions:
                expected = f"a number, or {known_names(expressions)}"
                hint = did_you_mean(used, expressions)
                raise ParameterError(name, got=used, expected=expected, hint=hint)
    try:
        in_order = tuple(graphlib.TopologicalSorter(uses).static_order())
    except graphlib.CycleError as error:
        circle = list(reversed(error.args[1]))
        words = " -> ".join(circle)
        words = words if len(words) <= _LONGEST_SHOWN else words[: _LONGEST_SHOWN - 1] + "…"
        raise ParameterError(
            circle[0], got=Words(words), expected="parameters that do not depend on themselves"
        ) from None
    values: dict[str, SIQuantity] = {}
    for name in in_order:
        expression = expressions[name]
        if isinstance(expression, Expression):
            with _within(name):
                value = expression.evaluate(values, mathematics)
        else:
            value = expression
        if original is not None and overrides is not None and name in overrides:
            value = _like(original[name], value, name, overrides[name])
        values[name] = value
    return {name: values[name] for name in definitions}


@contextmanager
def _within(name: str) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise ParameterError(
            name, within=error.subject, got=error.got, expected=error.expected, hint=error.hint
        ) from None


def _bare_number(value: Any, mathematics: Mathematics) -> SIQuantity:
    if isinstance(value, SIQuantity):
        return value
    quantity = own_quantity(value)
    if quantity is not None and math.isfinite(quantity.magnitude):
        return make_quantity(mathematics.bare(quantity.magnitude), quantity.units)
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if math.isfinite(number):
            return make_quantity(mathematics.bare(number))
    raise InputError("value", got=value, expected="a finite number or an expression such as 2*R")


def _like(original: SIQuantity, value: SIQuantity, name: str, written: object) -> SIQuantity:
    """The overriding value, checked for the dimension of the replaced value."""
    if original.is_bare:
        return value
    if value.is_bare:
        meant = make_quantity(value.magnitude, original.units)
        sizes = [x.magnitude for x in (meant, original)]
        if all(isinstance(x, Real) and x != 0 for x in sizes):
            times = abs(float(sizes[0]) / float(sizes[1]))
            if max(times, 1 / times) >= _FAR:  # probably in the unit of the model file
                warn_of_slip(
                    f"parameter {name} = {written}: {meant}, in place of "
                    f"{original}; numbers without a unit are in SI units: write the unit"
                )
        return meant
    is_angle = original.units.powers[:3] == (0, 0, 0)
    if not original.units.is_like(value.units, rad=is_angle):
        raise ParameterError(name, got=written, expected=f"the same dimension as {original}")
    return value
