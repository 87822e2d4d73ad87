"""Expressions: arithmetic agrees with Python's, dimensions are checked, nothing else gets in."""

import math
from itertools import pairwise

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from robostiff.errors import InputError
from robostiff.io.expression import ParameterError, parameter_values, parse
from robostiff.io.units import UNIT_WORDS, Dimension, make_quantity, parse_quantity, to_si

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


# --- arithmetic -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2^3^2", 512), ("2**3**2", 512), ("-2^2", -4), ("(-2)^2", 4), ("2^-1", 0.5),
        ("2^-1^2", 0.5), ("--3", 3), ("+-3", -3), ("2*-3", -6), (".5e1 + 1.", 6), ("pi", math.pi),
        ("2*pi*n", 6 * math.pi), ("sqrt(16)", 4), ("abs(-3)", 3), ("min(3, 1, 2)", 1),
        ("max(3, 1, 2)", 3), ("min(3)", 3), ("hypot(3, 4)", 5), ("atan2(1, -1)", 3 * math.pi / 4),
        ("asin(0.5)", math.pi / 6), ("acos(0.5)", math.pi / 3), ("atan(1)", math.pi / 4),
        ("tan(45 deg)", 1), ("sin(30 deg)", 0.5), ("cos(60 deg)", 0.5), (" \t1\n+\r\n1 ", 2),
    ],
)  # fmt: skip
def test_arithmetic(text, expected):
    assert value(text) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "expected", "dimension"),
    [
        ("2 * 300 mm", 0.6, Dimension.LENGTH),
        ("R + 10 mm", 0.31, Dimension.LENGTH),
        ("R*cos(2*phi)", 0.15, Dimension.LENGTH),
        ("k/2", 5e7, Dimension.TRANSLATIONAL_STIFFNESS),
        ("10 N/m", 10, Dimension.TRANSLATIONAL_STIFFNESS),
        ("2.5 kN m/rad", 2500, Dimension.ROTATIONAL_STIFFNESS),
        ("1/rad * 5 N m", 5, Dimension.ROTATIONAL_STIFFNESS),
        ("10 N/R", 100 / 3, Dimension.TRANSLATIONAL_STIFFNESS),
        ("10 N m/R", 100 / 3, Dimension.FORCE),
        ("k/10 N/m", 1e7, Dimension.NUMBER),
        ("300 mm^2", 3e-4, Dimension.AREA),
        ("(300 mm)^2", 0.09, Dimension.AREA),
        ("pi/4*(R^2 - r^2)", math.pi * 0.02, Dimension.AREA),
        ("pi/64*(R^4 - r^4)", math.pi / 64 * 0.008, Dimension.SECOND_MOMENT),
        ("sqrt(R^2 - r^2)", math.sqrt(0.08), Dimension.LENGTH),
        ("hypot(R, r)", math.hypot(0.3, 0.1), Dimension.LENGTH),
        ("atan2(r, R)", math.atan2(1, 3), Dimension.ANGLE),
        ("asin(r/R)", math.asin(1 / 3), Dimension.ANGLE),
        ("phi + 0.1", math.pi / 6 + 0.1, Dimension.ANGLE),
        ("max(0, R - 1 m)", 0, Dimension.LENGTH),
        ("0 + R", 0.3, Dimension.LENGTH),
        ("-R", -0.3, Dimension.LENGTH),
        ("R^0", 1, Dimension.NUMBER),
        ("R*2/m", 0.6, Dimension.NUMBER),
        ("abs(-10 deg)", math.pi / 18, Dimension.ANGLE),
    ],
)
def test_units(text, expected, dimension):
    quantity = parse(text).evaluate(ENVIRONMENT)
    assert to_si(quantity, dimension) == pytest.approx(expected, rel=1e-14)
    si = parse_quantity(f"1 {dimension.si_unit}")
    assert quantity.units.is_like(si.units)


def test_values_must_be_quantities():
    environment = {"a": parse_quantity("1000 mm"), "b": parse_quantity("1 m")}
    assert parse("a + b").evaluate(environment).magnitude == 2
    message = "expression 'c', column 1: got 'c = 1.0', expected a quantity for it"
    with pytest.raises(InputError) as caught:
        parse("c").evaluate({"c": 1.0})  # type: ignore[dict-item]
    assert str(caught.value) == message


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


OPERAND = "a number, a parameter, a function or ("
ANYWHERE = "numbers with units, parameters, + - * / ^, functions and brackets"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", f"1: got the end, expected {OPERAND}"),
        ("1 +", f"4: got the end, expected {OPERAND}"),
        ("* 2", f"1: got '*', expected {OPERAND}"),
        ("(1 + 2", "7: got the end, expected an operator or )"),
        ("1 + 2)", "6: got ')', expected an operator or the end"),
        ("()", f"2: got ')', expected {OPERAND}"),
        ("1 2", "3: got '2', expected an operator or the end"),
        ("2 R", "3: got 'R', expected a unit or an operator; for a product write 2*R"),
        ("300 mmm",
         "5: got 'mmm', expected a unit or an operator; did you mean the unit mm? for a product "
         "write 300*mmm"),
        ("R n", "3: got 'n', expected an operator or the end; for a product write R*n"),
        ("R*mm", "3: got 'mm', expected a number before a unit; write 1 mm"),
        ("2^2/m", "5: got 'm', expected a number before a unit; write 1 m"),
        ("300 mm^R",
         "4: got '^R', expected one whole number, as in mm^2; for the power of a quantity write "
         "(300 mm)^2"),
        ("Q + 1", "1: got 'Q', expected one of the parameters R, r, phi, k, E, n"),
        ("ph + 1",
         "1: got 'ph', expected one of the parameters R, r, phi, k, E, n; did you mean phi?"),
        ("sine(1)",
         "1: got 'sine', expected one of the functions sin, cos, tan, asin, acos, atan, atan2, "
         "sqrt, abs, min, max, hypot; did you mean sin?"),
        ("R(1)",
         "1: got 'R', expected one of the functions sin, cos, tan, asin, acos, atan, atan2, sqrt, "
         "abs, min, max, hypot; write * for a product with brackets"),
        ("sin", "1: got 'sin', expected brackets after the name of a function; write sin(...)"),
        ("sin()", "1: got 0 arguments of sin, expected 1 argument"),
        ("sin(1, 2)", "1: got 2 arguments of sin, expected 1 argument"),
        ("atan2(1)", "1: got 1 argument of atan2, expected 2 arguments"),
        ("min(1,)", f"7: got ')', expected {OPERAND}"),
        ("R + phi",
         "3: got 0.3 m (a length) and 0.523599 rad (an angle), expected quantities of one "
         "dimension to add"),
        ("1 + R",
         "3: got the plain number 1 and 0.3 m (a length), expected quantities of one dimension to "
         "add; write the plain number with its unit"),
        ("k - E",
         "3: got 1e+08 N/m (a translational stiffness) and 7e+10 Pa (an elastic modulus), expected "
         "quantities of one dimension to subtract"),
        ("max(R, phi)",
         "1: got 0.3 m (a length) and 0.523599 rad (an angle), expected quantities of one "
         "dimension in max"),
        ("sin(R)", "1: got sin of 0.3 m (a length), expected an angle, such as 10 deg"),
        ("asin(phi)", "1: got asin of 0.523599 rad (an angle), expected a plain number"),
        ("2^R", "2: got the exponent 0.3 m (a length), expected a plain number as exponent"),
        ("2^65", "2: got the exponent 65, expected an exponent from -64 to 64"),
        ("1/0", "2: got the plain number 1 / the plain number 0, expected a finite real result"),
        ("sqrt(-1)", "1: got sqrt of the plain number -1, expected a finite real result"),
        ("(-8)^(1/3)",
         "5: got the plain number -8 to the power the plain number 0.333333, expected a finite "
         "real result"),
        ("1e300*1e300",
         "6: got the plain number 1e+300 * the plain number 1e+300, expected a finite real result"),
        ("1e999", "1: got '1e999', expected a finite number"),
        ("2·R", f"2: got '·', expected {ANYWHERE}; write *"),
        ("2 − R", f"3: got '−', expected {ANYWHERE}; write -"),
    ],
)  # fmt: skip
def test_refusals(text, message):
    assert refusal(text) == f"expression {text!r}, column {message}"


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


@pytest.mark.parametrize("value", [None, 5, b"1", ["1"]])
def test_expression_must_be_text(value):
    with pytest.raises(InputError, match="expression: "):
        parse(value)


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


def parameter_refusal(definitions, overrides=None):
    with pytest.raises(ParameterError) as caught:
        parameter_values(definitions, overrides or {})
    return caught.value.name, str(caught.value)


def test_parameters_in_any_order():
    parameters = parameter_values(
        {"L": "2*h", "h": "R*sqrt(3)/2", "R": "300 mm", "n": 3, "nu": 0.3}
    )
    assert list(parameters) == ["L", "h", "R", "n", "nu"]
    assert parameters["L"].magnitude == pytest.approx(0.3 * math.sqrt(3))
    assert parse("L/h").evaluate(parameters).magnitude == pytest.approx(2)
    assert parse("n*R").evaluate(parameters).magnitude == pytest.approx(0.9)


def test_long_chains_of_parameters():
    definitions = {f"p{i}": f"p{i - 1} + 1" for i in range(3000, 0, -1)} | {"p0": "0"}
    assert parameter_values(definitions)["p3000"].magnitude == 3000


def test_overrides_reach_what_depends_on_them():
    definitions = {"h": "2*R", "R": "300 mm", "phi": "10 deg", "n": 3}
    assert parameter_values(definitions, {"R": "0.5 m"})["h"].magnitude == 1
    assert parameter_values(definitions, {"R": 0.5})["h"].magnitude == 1
    assert (
        parse("R + 10 mm").evaluate(parameter_values(definitions, {"R": "0.5"})).magnitude == 0.51
    )
    assert parameter_values(definitions, {"h": "3*R"})["h"].magnitude == pytest.approx(0.9)
    assert (
        parse("phi").evaluate(parameter_values(definitions, {"phi": "0.1"})).units
        == parse("1 rad").evaluate({}).units
    )
    assert parameter_values(definitions, {"n": "2 m"})["n"].magnitude == 2


@pytest.mark.parametrize(
    ("definitions", "overrides", "name", "message"),
    [
        ({"a": "a"}, {}, "a", "parameter a: got a -> a, expected parameters that do not depend "
         "on themselves"),
        ({"R": "1 m", "h": "2*S"}, {}, "h", "parameter h: got 'S', expected one of the "
         "parameters R, h"),
        ({"R": "1 m", "length": "1 m", "h": "2*lenght"}, {}, "h", "parameter h: got 'lenght', "
         "expected one of the parameters R, length, h; did you mean length?"),
        ({"R": "1 mm +"}, {}, "R", "parameter R: expression '1 mm +', column 7: got the end, "
         f"expected {OPERAND}"),
        ({"R": "1 m", "h": "R + 10 deg"}, {}, "h", "parameter h: expression 'R + 10 deg', "
         "column 3: got 1 m (a length) and 0.174533 rad (an angle), "
         "expected quantities of one dimension to add"),
        ({"mm": "1"}, {}, "mm", "parameter mm: got the name of a unit, expected another name; "
         "write for instance mm_0"),
        ({"sin": "1"}, {}, "sin", "parameter sin: got the name of a function, expected another "
         "name; write for instance sin_0"),
        ({"pi": "1"}, {}, "pi", "parameter pi: got the name of a constant, expected another "
         "name; write for instance pi_0"),
        ({"__x__": "1"}, {}, "__x__", "parameter __x__: got this name, expected letters a-z, "
         "digits and underscores, with a letter first"),
        ({"φ": "1"}, {}, "φ", "parameter φ: got this name, expected letters a-z, digits and "
         "underscores, with a letter first"),
        ({"R": None}, {}, "R", "parameter R: value: expected a finite number or an expression "
         "such as 2*R"),
        ({"R": math.nan}, {}, "R", "parameter R: value: got nan, expected a finite number or an "
         "expression such as 2*R"),
        ({"length": "1 m"}, {"lenght": "2 m"}, "lenght", "parameter lenght: got a value for "
         "a parameter that is not defined, expected one of the parameters length; did you mean "
         "length?"),
        ({}, {"R": "2 m"}, "R", "parameter R: got a value for a parameter that is not defined, "
         "expected no parameter, as none is defined"),
        ({"R": "300 mm"}, {"R": "10 deg"}, "R", "parameter R: got '10 deg', expected the same "
         "dimension as 0.3 m (a length)"),
        ({"R": "300 mm"}, {"R": "400 mmm"}, "R", "parameter R: expression '400 mmm', column 5: "
         "got 'mmm', expected a unit or an operator; did you mean the unit mm? for a product "
         "write 400*mmm"),
    ],
)  # fmt: skip
def test_refused_parameters(definitions, overrides, name, message):
    got_name, got = parameter_refusal(definitions, overrides)
    assert (got_name, got) == (name, message)


def test_cycle_names_its_path():
    name, message = parameter_refusal({"a": "b + 1", "b": "c", "c": "2*a"})
    assert name in "abc"
    path = message.split("got ")[1].split(",")[0].split(" -> ")
    assert path[0] == path[-1]
    uses = {"a": "b", "b": "c", "c": "a"}
    assert all(uses[x] == y for x, y in pairwise(path))
    assert len(path) == 4
