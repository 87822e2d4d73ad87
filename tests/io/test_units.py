"""Units: what is read, what is refused, and the words of the refusals."""

import math
from collections import Counter

import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robostiff.errors import InputError
from robostiff.io.units import UNIT_WORDS, Dimension, make_quantity, parse_quantity, to_si

POSE = (Dimension.LENGTH,) * 3 + (Dimension.ANGLE,) * 3
POSE_NAMES = ("x", "y", "z", "rx", "ry", "rz")
WRENCH = (Dimension.FORCE,) * 3 + (Dimension.MOMENT,) * 3
WRENCH_NAMES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


def refusal(call, *args, **kwargs):
    with pytest.raises(InputError) as caught:
        call(*args, **kwargs)
    return str(caught.value)


@pytest.mark.parametrize("dimension", list(Dimension))
def test_bare_numbers_are_si_and_every_example_is_what_it_claims(dimension):
    for number in ("1.5", 1.5, make_quantity(1.5)):
        assert to_si(number, dimension) == 1.5
    assert to_si(0, dimension) == 0
    assert to_si(dimension.example, dimension) > 0
    if dimension.si_unit:
        assert to_si(f"7 {dimension.si_unit}", dimension) == 7
        alike = [other for other in Dimension if other.si_unit == dimension.si_unit]
        assert alike[0].with_article in str(parse_quantity(f"7 {dimension.si_unit}"))


@pytest.mark.parametrize("given", list(Dimension))
def test_every_other_dimension_is_refused(given):
    quantity = parse_quantity(f"7 {given.si_unit}")
    for wanted in Dimension:
        same = quantity.units.powers[:3] == parse_quantity(f"7 {wanted.si_unit}").units.powers[:3]
        if given is Dimension.NUMBER or given is wanted:
            assert to_si(quantity, wanted) == 7
        elif not same:
            with pytest.raises(InputError):
                to_si(quantity, wanted)


@pytest.mark.parametrize("given", [math.nan, 10**400, "1" * 1001])
def test_what_is_no_number_of_a_robot(given):
    with pytest.raises(InputError, match=r"a finite number|at most"):
        to_si(given, Dimension.LENGTH)


def test_quantity_that_was_computed_is_described():
    message = "beam length: got 0.5 rad (an angle), expected a length, such as 300 mm"
    quantity = parse_quantity("0.5 rad")
    assert refusal(to_si, quantity, Dimension.LENGTH, subject="beam length") == message
    message = "length: got '30 deg', expected a length, such as 300 mm"
    assert refusal(to_si, quantity, Dimension.LENGTH, got="30 deg") == message


@given(st.lists(st.sampled_from(UNIT_WORDS), min_size=1, max_size=4), st.data())
def test_unit_algebra_agrees_with_products_of_single_units(words, data):
    text, expected, powers = f"2 {words[0]}", to_base(words[0]), Counter(words[:1])
    for word in words[1:]:
        sign = data.draw(st.sampled_from((1, -1)))
        powers[word] += sign
        text += f"{'*' if sign == 1 else '/'}{word}"
        expected = [a + sign * b for a, b in zip(expected, to_base(word), strict=True)]
    if expected[4] > 0 and (+powers).total() > 1:  # N m deg
        with pytest.raises(InputError, match="an angle by itself"):
            parse_quantity(text)
        return
    quantity = parse_quantity(text)
    assert math.log(quantity.magnitude / 2) == pytest.approx(expected[0], abs=1e-9)
    assert list(quantity.units.powers) == expected[1:]


def to_base(word):
    quantity = parse_quantity(f"1 {word}")
    return [math.log(quantity.magnitude), *quantity.units.powers]


@pytest.mark.parametrize("text", ["3 kN/mm", "2 N m/rad", "5 deg", "7 rad/(N m)", "4 psi", "2 m/s"])
def test_quantities_are_those_of_pint(text):
    own = parse_quantity(text)
    theirs = pint.get_application_registry().parse_expression(text.replace(" m/rad", " * m / rad"))
    m, kg, s, rad = own.units.powers
    assert own.magnitude == pytest.approx(theirs.to_base_units().magnitude, rel=1e-15)
    powers = {"[length]": m, "[mass]": kg, "[time]": s}
    assert dict(theirs.dimensionality) == {name: power for name, power in powers.items() if power}
    assert rad == pytest.approx(text.count("rad") * (-1) ** text.count("/rad") + text.count("deg"))


def test_quantities_are_asked_for_in_si_units():
    force = parse_quantity("2 kN")
    assert force.to("N") is force
    assert parse_quantity("30 deg").to("dimensionless").magnitude == pytest.approx(math.pi / 6)
    for unit in ("m", "N m", "mm"):
        with pytest.raises(ValueError, match=f"is no {unit}"):
            force.to(unit)
