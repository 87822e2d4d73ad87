"""Derivations of whole robots in all languages."""

import ast
import json
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic.export import (
    c_function,
    derivation_data,
    derivation_html,
    derivation_latex,
    derivation_text,
    python_function,
)
from robostiff.io.expression import parse
from robostiff.io.units import make_quantity

FORMS = {
    "closed at home": ("gough-stewart-b", rs.AtHome(), rs.Closed()),
    "steps at a general pose": ("3-rrr", rs.AtSymbols(), rs.Steps()),
}


@pytest.fixture(scope="module", params=FORMS)
def derivation(request):
    name, pose, form = FORMS[request.param]
    return rs.derive(name, pose=pose, form=form)


def test_expressions_in_json_are_read_by_the_parser_of_model_files(derivation):
    data = json.loads(json.dumps(derivation_data(derivation), allow_nan=False))
    nominal = rs.load(derivation.name, symbols=rs.ALL_PARAMETERS).nominal
    given = {name: nominal.get(name, 0.01) for name in data["symbols"]}
    expected = np.array(derivation.substituted(given), dtype=float)
    values = {name: make_quantity(x) for name, x in given.items()}
    for d in data["definitions"]:
        values[d["symbol"]] = parse(d["expression"]).evaluate(values)
    K = np.array([[parse(x).evaluate(values).magnitude for x in row] for row in data["K"]])
    assert K == pytest.approx(expected, rel=1e-12, abs=1e-12 * np.abs(expected).max())
    assert [leg["joints"] for leg in data["legs"]] == [list(leg.joints) for leg in derivation.legs]


def test_meanings_from_elsewhere_do_no_harm():
    words = {"k": 'a" */ <b>\\end{document}\n$x$ %'}
    read = replace(rs.derive("gough-stewart-b"), meanings=words)
    assert "*/" not in c_function(read).split("*/", 1)[0]
    assert "int stiffness(" in c_function(read).split("*/", 1)[1]
    assert "\\end{document}" not in derivation_latex(read).split("Nomenclature")[1].split("\n\n")[0]
    assert "<b>" not in derivation_html(read)
    ast.parse(python_function(read))


def test_every_name_in_the_text_is_defined_before_it_is_used(derivation):
    """The names of the text alone, in order; the nomenclature has numbers of beams."""
    lines = derivation_text(derivation, width=10_000).splitlines()
    given = {str(symbol) for symbol in derivation.symbols}
    given |= {line.partition(": ")[0] for line in lines if "stiffness E " in line}
    known = {name: sp.Symbol(name) for name in given}
    for line in lines:
        name, equals, right = line.partition(" = ")
        if not equals or not name.isidentifier() or name == "K_C" or right.startswith(("(w", "[")):
            continue
        try:
            expression = sp.sympify(right, locals=known | {"pi": sp.pi})
        except (AttributeError, SyntaxError, TypeError, sp.SympifyError):
            known[name] = sp.Symbol(name)  # an equation of vectors
            continue
        used = {str(s) for s in getattr(expression, "free_symbols", ())}
        if not name.startswith("w_") and not any(u.startswith("w_") for u in used):
            assert used <= known.keys(), line
        known[name] = sp.Symbol(name)


def test_names_with_blanks_become_identifiers(tmp_path):
    file = tmp_path / "robot.yaml"
    source = rs.load("3-rpr").source  # any text will do
    assert source
    from robostiff.robots import robot_file

    file.write_text(robot_file("3-rpr").read_text(encoding="utf-8").replace("leg1", '"leg x"'))
    derivation = rs.derive(file, pose=rs.AtSymbols())
    names = [d.symbol.name for d in derivation.definitions]
    assert "B_leg_x_x" in names
    assert all(name.isidentifier() for name in names)


def test_a_pickled_derivation_keeps_formula_and_legs(derivation):
    import pickle

    again = pickle.loads(pickle.dumps(derivation))  # noqa: S301
    assert (again.K, again.definitions, again.where) == (
        derivation.K,
        derivation.definitions,
        derivation.where,
    )
    assert [leg.joints for leg in again.legs] == [leg.joints for leg in derivation.legs]


def test_long_conditions_are_in_words_and_never_multiplied_out():
    """A product of squares of five legs with 2,000 operations kept the printer busy for minutes."""
    derivation = rs.derive("hexapod-pus", pose=rs.AtSymbols())
    longest = max(int(c.expression.count_ops()) for c in derivation.conditions)
    assert longest > 1000
    text = " ".join(derivation_text(derivation).split())
    assert "It holds only where" in text
    assert "are independent" in text
