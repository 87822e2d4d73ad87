"""Which parameters of a model file stay symbols, and the robot with these symbols."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from enum import Enum

from robostiff.errors import InputError
from robostiff.io.expression import parse
from robostiff.io.suggest import did_you_mean, listing
from robostiff.io.units import Dimension, SIQuantity, make_quantity
from robostiff.markup import number
from robostiff.model import Robot, with_entries
from robostiff.model.entries import formulas
from robostiff.spatial import exact_number


class ParameterChoice(Enum):
    """Parameters that are chosen without naming them.

    ``ALL`` are those that are not computed from others: what is computed follows as a formula.
    With ``NONE`` the robot has no symbols, and exact dimensions where these are single roots: those
    of 120 deg, not of 20 deg.
    """

    ALL = "all parameters"
    NONE = "no parameter"


ALL_PARAMETERS = ParameterChoice.ALL
"""Keep every parameter of a model file that is not computed from others as a symbol."""

Symbols = Iterable[str] | Mapping[str, str] | ParameterChoice


def chosen_parameters(
    symbols: Symbols, definitions: Mapping[str, str | float], overrides: Mapping[str, str | float]
) -> dict[str, str]:
    """Parameters that stay symbols, and the names of these symbols.

    A mapping has such names, and means all parameters, the others under their own names.
    """
    if symbols is ParameterChoice.NONE:
        return {}
    shorter = dict(symbols) if isinstance(symbols, Mapping) else {}
    if symbols is ParameterChoice.ALL or shorter:
        values = {**definitions, **overrides}
        computed = {n for n, x in values.items() if isinstance(x, str) and parse(x).names}
        names = [name for name in definitions if name not in computed]
        _refuse_unknown(shorter, names)
        chosen = {name: str(shorter.get(name, name)) for name in names}
        for short in shorter.values():
            if not str(short).isidentifier() or [*chosen.values()].count(str(short)) > 1:
                expected = "letters, digits and underscores, not the name of another symbol"
                raise InputError("name of a symbol", got=short, expected=expected)
        return chosen
    if isinstance(symbols, str) or not isinstance(symbols, Iterable):
        raise InputError(
            "symbols",
            got=symbols,
            expected="names of parameters, or ALL_PARAMETERS",
            hint="write symbols=rs.ALL_PARAMETERS"
            if symbols == "all"
            else f"write symbols=({symbols!r},)"
            if isinstance(symbols, str)
            else None,
        )
    names = tuple(symbols)
    _refuse_unknown(names, definitions)
    return {name: name for name in names}


def _refuse_unknown(names: Iterable[str], definitions: Iterable[str]) -> None:
    for name in names:
        if name not in definitions:
            expected = "none, as the model has no parameters"
            if definitions:
                expected = f"one of the parameters {listing(list(definitions))}"
            raise InputError(
                "symbol", got=name, expected=expected, hint=did_you_mean(str(name), definitions)
            )


def symbolic_values(
    names: Mapping[str, str], values: Mapping[str, SIQuantity]
) -> tuple[dict[str, SIQuantity], dict[str, float]]:
    """A symbol for each parameter, in its unit, and the numbers that symbols stand for.

    A symbol is taken to be positive where its number is; one that is not, and an angle, which may
    be turned either way, are real.
    """
    import sympy as sp

    quantities, nominal = {}, {}
    for name, label in names.items():
        value = values[name]
        positive = value.magnitude > 0 and value.dimension is not Dimension.ANGLE
        symbol = sp.Symbol(label, positive=True) if positive else sp.Symbol(label, real=True)
        quantities[name] = make_quantity(symbol, value.units)
        nominal[label] = value.magnitude
    return quantities, nominal


def meaning_of(value: SIQuantity) -> str:
    """What a symbol stands for, and its value in the model file."""
    noun = f"{value.dimension.noun}, " if value.dimension else ""
    return f"{noun}{number(value.magnitude)} {unit_of(value)}".rstrip() + " in the model"


def unit_of(value: SIQuantity) -> str:
    """The SI unit of a quantity, such as ``N m/rad``; nothing of a plain number."""
    if value.dimension is None:
        return "" if value.is_bare else str(value.units)
    return value.dimension.si_unit


def complete(
    symbolic: Robot,
    numeric: Robot,
    nominal: Mapping[str, float],
    quantities: Mapping[str, SIQuantity],
) -> Robot:
    """The robot of formulas, all exact, with what was found out about the robot of numbers."""
    import sympy as sp

    robot = replace(
        symbolic,
        coordinates=numeric.coordinates,
        nominal=nominal,
        meanings={symbol: meaning_of(value) for symbol, value in quantities.items()},
        units={symbol: unit_of(value) for symbol, value in quantities.items()},
        laws=numeric.laws,
    )
    exact = with_entries(robot, exact_number)
    # Without symbols, sines and sums of roots are longer than decimals.
    is_long = not nominal and any(x.has(sp.sin, sp.cos, sp.Add) for x in formulas(exact))
    return numeric if is_long else exact
