"""Units: what is read, what is refused, and the words of the refusals."""

import math
from collections import Counter

import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robostiff.errors import InputError
from robostiff.io.units import (
    UNIT_WORDS,
    Dimension,
    make_quantity,
    parse_quantities,
    parse_quantity,
    to_si,
)

POSE = (Dimension.LENGTH,) * 3 + (Dimension.ANGLE,) * 3
POSE_NAMES = ("x", "y", "z", "rx", "ry", "rz")
WRENCH = (Dimension.FORCE,) * 3 + (Dimension.MOMENT,) * 3
WRENCH_NAMES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
ALL = ", ".join(UNIT_WORDS)


def refusal(call, *args, **kwargs):
    with pytest.raises(InputError) as caught:
        call(*args, **kwargs)
    return str(caught.value)


READ = {
    Dimension.LENGTH: {
        "300 mm": 0.3, "300mm": 0.3, "29 mm": 0.029, "1.1 um": 1.1e-6, "3 µm": 3e-6, "3 μm": 3e-6,
        "2 cm": 0.02, "2 km": 2000, "10 in": 0.254, "10 ft": 3.048, "-.5e-1 m": -0.05,
    },
    Dimension.AREA: {"1 mm^2": 1e-6, "1 mm²": 1e-6, "1 mm * mm": 1e-6},
    Dimension.SECOND_MOMENT: {"5 mm**4": 5e-12, "5 mm ^ 4": 5e-12, "5 cm⁴": 5e-8},
    Dimension.ANGLE: {
        "180 deg": math.pi, "180°": math.pi, "60 arcmin": math.pi / 180,
        "3600 arcsec": math.pi / 180, "2 mrad": 2e-3, "2 urad": 2e-6,
    },
    Dimension.MASS: {"500 g": 0.5},
    Dimension.FORCE: {
        "2 kN": 2000, "2 mN": 2e-3, "2 MN": 2e6, "1 lbf": 4.4482216152605, "3 kg*m/s^2": 3,
    },
    Dimension.MOMENT: {"3 J": 3, "3 N m": 3, "3 N*m": 3, "3 N·m": 3, "3 Nm": 3, "3 kNm": 3000},
    Dimension.MODULUS: {
        "70 GPa": 70e9, "70 kPa": 70e3, "7 N/mm^2": 7e6, "1 psi": 6894.757293168361,
        "1 ksi": 6894757.293168361,
    },
    Dimension.TRANSLATIONAL_STIFFNESS: {"10 N/um": 1e7, "1 kN/mm": 1e6},
    Dimension.ROTATIONAL_STIFFNESS: {
        "1e5 N m/rad": 1e5, "1e5 N*m/rad": 1e5, "1e5 N·m/rad": 1e5, "1 N m/mrad": 1e3,
        "1e5 N m": 1e5,
    },
    Dimension.TRANSLATIONAL_COMPLIANCE: {"2 m/N": 2, "2 um/N": 2e-6},
    Dimension.ROTATIONAL_COMPLIANCE: {"2 rad/(N m)": 2, "2 rad/N/m": 2, "2 N^-1 m^-1": 2},
    Dimension.COUPLING_STIFFNESS: {"2 N/rad": 2},
    Dimension.COUPLING_COMPLIANCE: {"2 /N": 2},
    Dimension.NUMBER: {"2 mm/m": 2e-3, "0.3": 0.3},
}  # fmt: skip


@pytest.mark.parametrize("dimension", READ)
def test_read(dimension):
    for text, value in READ[dimension].items():
        assert to_si(text, dimension) == pytest.approx(value, rel=1e-15), text


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


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("10 mm 0 0.5 0 0 10 deg", [0.01, 0, 0.5, 0, 0, math.radians(10)]),
        ("10 mm, 0, 0.5, 0, 0, 10 deg", [0.01, 0, 0.5, 0, 0, math.radians(10)]),
        ("10mm,0,.5,0,0,10deg", [0.01, 0, 0.5, 0, 0, math.radians(10)]),
        (" 1 2 3 4 5 6 ", [1, 2, 3, 4, 5, 6]),
        ("-1 +2 -3 -4e0 5 6 mrad", [-1, 2, -3, -4, 5, 6e-3]),
        ("0 m -5 mm 0 0 0 -1", [0, -0.005, 0, 0, 0, -1]),
    ],
)
def test_poses(text, values):
    got = parse_quantities(text, POSE, POSE_NAMES, "pose")
    assert got == pytest.approx(values, rel=1e-15)


def test_units_of_several_words_run_on_until_the_next_number():
    got = parse_quantities("200 N 0 -500 0 10 N m 0", WRENCH, WRENCH_NAMES, "wrench")
    assert got == [200, 0, -500, 0, 10, 0]
    got = parse_quantities("1 kN 2 N 3 1 N*m 2 N·m 3 kN mm", WRENCH, WRENCH_NAMES, "wrench")
    assert got == [1000, 2, 3, 1, 2, 3]


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


def test_quantities_of_other_kinds_are_described_by_their_units():
    assert str(parse_quantity("2 kg^2 m/s^3")) == "2 kg^2*m/s^3"
    assert str(parse_quantity("2 /s")) == "2 1/s"


def test_quantities_are_asked_for_in_si_units():
    force = parse_quantity("2 kN")
    assert force.to("N") is force
    assert parse_quantity("30 deg").to("dimensionless").magnitude == pytest.approx(math.pi / 6)
    for unit in ("m", "N m", "mm"):
        with pytest.raises(ValueError, match=f"is no {unit}"):
            force.to(unit)
