"""Units and expressions in files: Python's arithmetic, dimensions, and nothing else."""

import math
from collections import Counter

import pint
import pytest
import sympy as sp
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from robostiff.errors import InputError
from robostiff.io.expression import exact_mathematics, parameter_values, parse
from robostiff.io.units import (
    UNIT_WORDS,
    Dimension,
    exact_quantity,
    make_quantity,
    make_unit,
    parse_quantity,
    to_si,
)

ENVIRONMENT = {
    name: parse_quantity(text)
    for name, text in {
        "R": "300 mm",
        "r": "100 mm",
        "phi": "30 deg",
        "k": "1e8 N/m",
        "E": "70 GPa",
        "n": "3",
    }.items()
}


def value(text):
    return parse(text).evaluate(ENVIRONMENT).magnitude


def refusal(text):
    with pytest.raises(InputError) as caught:
        parse(text).evaluate(ENVIRONMENT)
    return str(caught.value)


# --- arithmetic, beside what readings.txt has of it -----------------------------------------------


def test_names_in_order_of_appearance():
    assert parse("R*cos(phi) + R/n + pi").names == ("R", "phi", "n")


def leaves():
    number = st.floats(0.001, 1000).map(lambda x: (repr(x), x))
    return number | st.just(("pi", math.pi)) | st.just(("x", 1.75))


def branches(children):
    def infix(parts):
        (left, a), operator, (right, b) = parts
        try:
            result = {"+": a + b, "-": a - b, "*": a * b}.get(operator)
            result = a / b if operator == "/" else result
        except (ZeroDivisionError, OverflowError):
            result = math.nan
        return f"({left}) {operator} ({right})", result

    def call(parts):
        function, (text, a) = parts
        try:
            return f"{function}({text})", getattr(math, function)(a)
        except (ValueError, OverflowError):
            return f"{function}({text})", math.nan

    sign = children.map(lambda c: (f"-({c[0]})", -c[1]))
    power = st.tuples(children, st.integers(-3, 3)).map(raised)
    functions = st.sampled_from(["sin", "cos", "tan", "sqrt"])
    return (
        st.tuples(children, st.sampled_from("+-*/"), children).map(infix)
        | st.tuples(functions, children).map(call)
        | sign
        | power
    )


def raised(parts):
    (text, base), exponent = parts
    try:
        return f"({text})^{exponent}", math.pow(base, exponent)
    except (ValueError, OverflowError):
        return f"({text})^{exponent}", math.nan


@settings(max_examples=100)
@given(st.recursive(leaves(), branches, max_leaves=12))
def test_random_trees_agree_with_python(tree):
    text, expected = tree
    assume(len(text) <= 1000)
    environment = {"x": make_quantity(1.75)}
    if math.isfinite(expected):
        try:
            got = parse(text).evaluate(environment).magnitude
        except InputError as error:
            # an intermediate result was not finite, which Python lets pass
            assert "finite" in str(error) or "nesting" in str(error)  # noqa: PT017
        else:
            assert got == expected
    else:
        with pytest.raises(InputError):
            parse(text).evaluate(environment)


@settings(deadline=None)
@given(st.lists(st.tuples(st.sampled_from("+-*/"), st.integers(1, 9)), max_size=30))
def test_precedence_without_brackets(steps):
    text, terms, product, sign = "5", [], 5.0, 1
    for operator, number in steps:
        text += f" {operator} {number}"
        if operator in "+-":
            terms.append(sign * product)
            product, sign = float(number), 1 if operator == "+" else -1
        else:
            product = product * number if operator == "*" else product / number
    terms.append(sign * product)
    assert value(text) == pytest.approx(sum(terms), rel=1e-12, abs=1e-12)


@given(st.sampled_from(UNIT_WORDS), st.sampled_from(UNIT_WORDS), st.integers(-4, 4), st.booleans())
def test_unit_algebra(first, second, power, invert):
    environment = {"a": parse_quantity(f"2 {first}"), "b": parse_quantity(f"3 {second}")}
    operator = "/" if invert else "*"
    got = parse(f"a^{power} {operator} b").evaluate(environment).units.powers
    sign = -1 if invert else 1
    pairs = zip(environment["a"].units.powers, environment["b"].units.powers, strict=True)
    assert got == tuple(power * a + sign * b for a, b in pairs)


# --- refusals -------------------------------------------------------------------------------------


HOSTILE = r"""
__import__('os')  __import__  R.__class__  R.real  R . real  (R).units  lambda: 0  lambda  f'{R}'
1 if R else 2  f"{R}"  'a'  R[0]  [1]  {1}  R; R  R = 1  R == R  R := 1  R and R  not R  \x41  # R
R # comment  R @ R  R % 2  R // 2  R << 2  ~R  1j  1_000  0x10  0b1  1e  1.2.3  nan  inf  -inf  True
None  ...  print(1)  eval(1)  pow(2, 3)  sin (sin)  *R  **R  sin(*R)  min(x=1)
"""
#: Digits and letters that only look like those of ASCII, marks that are not seen, and bytes.
LOOK_ALIKES = "\uff11  \u0663  \u2160  \uff32  \u0395  \u0440hi  s\u0131n(1)  1\u00a0+ 1  R\u200b"
LOOK_ALIKES += "  1 \u2215 2  \u202eR  \ud800  R\\\nR  R\0  \0"


@pytest.mark.parametrize(
    "text",
    [text for line in (*HOSTILE.split("\n")[1:-1], LOOK_ALIKES) for text in line.split("  ")],
)
def test_nothing_but_arithmetic(text):
    message = refusal(text)
    assert message.startswith("expression ")
    assert "\n" not in message
    message.encode()


@pytest.mark.parametrize(
    "text",
    [
        "(" * 900,
        "-" * 900,
        "2^" * 450 + "2",
        "(" * 400 + "1" + ")" * 400,
        "sin(" * 240,
        "1 N/(m/(" * 100,
        "1 N/(" * 150,
    ],
)
def test_deep_nesting_is_refused(text):
    refusal(text)


def test_bounds():
    assert value("+".join(["1"] * 500)) == 500
    message = "expression: got 1001 characters, expected at most 1000; "
    assert refusal("1" * 1001) == message + "split it over several parameters"
    assert value("(" * 49 + "1" + ")" * 49) == 1
    assert "more than 50 levels of nesting, expected at most 50" in refusal(
        "(" * 50 + "1" + ")" * 50
    )


def test_long_expression_is_shown_around_the_column():
    message = refusal("1 + " * 50 + "Q" + " + 1" * 50)
    assert "column 201: got 'Q'" in message
    assert message.startswith("expression '…")
    assert len(message) < 220


@settings(max_examples=100)
@given(st.text(alphabet="0123.eE+-*/^(), Rmkphisqrtnda\u00b0", max_size=40))
def test_noise_is_computed_or_refused(text):
    try:
        result = parse(text).evaluate(ENVIRONMENT)
    except InputError:
        return
    assert math.isfinite(result.magnitude)


# --- parameters -----------------------------------------------------------------------------------


def test_long_chains_of_parameters():
    definitions = {f"p{i}": f"p{i - 1} + 1" for i in range(3000, 0, -1)} | {"p0": "0"}
    assert parameter_values(definitions)["p3000"].magnitude == 3000


IN_SYMBOLS = {
    "R": make_quantity(sp.Symbol("R", positive=True), make_unit({"m": 1})),
    "n": make_quantity(sp.Symbol("n", positive=True)),
}


@pytest.mark.parametrize("word", UNIT_WORDS)
@pytest.mark.parametrize("power", [1, -2])
def test_exact_unit_is_the_unit(word, power):
    unit = make_unit({word: power})
    floats, exactly = make_quantity(1.0, unit), exact_quantity(sp.Integer(1), unit)
    assert float(exactly.magnitude) == pytest.approx(floats.magnitude, rel=4e-16)
    assert exactly.units.powers == floats.units.powers


def test_parameters_follow_symbols_exactly():
    definitions = {"h": "2*R + 1 mm", "R": "300 mm", "n": 0.1}
    values = parameter_values(definitions, {"R": IN_SYMBOLS["R"]}, exact_mathematics())
    assert values["h"].magnitude == 2 * IN_SYMBOLS["R"].magnitude + sp.Rational(1, 1000)
    assert values["n"].magnitude == sp.Rational(1, 10)


POSE = (Dimension.LENGTH,) * 3 + (Dimension.ANGLE,) * 3
POSE_NAMES = ("x", "y", "z", "rx", "ry", "rz")
WRENCH = (Dimension.FORCE,) * 3 + (Dimension.MOMENT,) * 3
WRENCH_NAMES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


def refused_quantity(call, *args, **kwargs):
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


def test_quantity_that_was_computed_is_described():
    message = "beam length: got 0.5 rad (an angle), expected a length, such as 300 mm"
    quantity = parse_quantity("0.5 rad")
    assert refused_quantity(to_si, quantity, Dimension.LENGTH, subject="beam length") == message
    message = "length: got '30 deg', expected a length, such as 300 mm"
    assert refused_quantity(to_si, quantity, Dimension.LENGTH, got="30 deg") == message


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
