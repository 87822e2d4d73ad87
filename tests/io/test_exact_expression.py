"""Expressions in exact arithmetic: no float on the way, the same values, bounded work."""

import pytest
import sympy as sp

from robostiff.errors import InputError
from robostiff.io.expression import exact_mathematics, parameter_values, parse
from robostiff.io.units import UNIT_WORDS, exact_quantity, make_quantity, make_unit

ENVIRONMENT = {"R": make_quantity(sp.Symbol("R", positive=True), make_unit({"m": 1}))}


@pytest.mark.parametrize("word", UNIT_WORDS)
@pytest.mark.parametrize("power", [1, -2])
def test_exact_unit_is_the_unit(word, power):
    unit = make_unit({word: power})
    floats, exactly = make_quantity(1.0, unit), exact_quantity(sp.Integer(1), unit)
    assert float(exactly.magnitude) == pytest.approx(floats.magnitude, rel=4e-16)
    assert exactly.units.powers == floats.units.powers


def test_symbol_in_an_exponent_of_a_quantity_with_a_unit_is_refused():
    environment = {**ENVIRONMENT, "n": make_quantity(sp.Symbol("n", positive=True))}
    with pytest.raises(InputError, match="a known number as exponent"):
        parse("R^n").evaluate(environment, exact_mathematics())


def test_parameters_follow_symbols_exactly():
    definitions = {"h": "2*R + 1 mm", "R": "300 mm", "n": 0.1}
    values = parameter_values(definitions, ENVIRONMENT, exact_mathematics())
    assert values["h"].magnitude == 2 * ENVIRONMENT["R"].magnitude + sp.Rational(1, 1000)
    assert values["n"].magnitude == sp.Rational(1, 10)
