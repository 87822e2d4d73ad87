import re

import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import Derivation, Steps, compliance_steps, derive_chain, differentiate
from robostiff.analytic.export import derivation_text
from robostiff.analytic.export.blocks import (
    EquationRows,
    FormulaTable,
    MatrixEquation,
    Nomenclature,
)
from robostiff.analytic.export.outline import outline_of
from robostiff.errors import InputError
from tests.analytic.export.derivations import ALL


def section(text, title):
    """Lines under a heading."""
    lines = text.splitlines()
    start = lines.index(title) + 2
    stop = next((i - 1 for i in range(start, len(lines)) if set(lines[i]) == {"-"}), len(lines))
    return [line for line in lines[start:stop] if line]


def test_equation_4():
    text = derivation_text(ALL["equation_4"])
    assert section(text, "Start: stiffness without passive joints") == [
        "      [ K_11  K_12  K_13 ]",
        "K_0 = [ K_12  K_22  K_23 ]",
        "      [ K_13  K_23  K_33 ]",
    ]
    assert section(text, "Joint 1: tip") == [
        "Recursion (15).",
        "J_1 = (0, 0, 1)",
        "u_1 = (K_13, K_23, K_33)",
        "mu_1 = K_33",
        "K_1 = K_0 - u_1 u_1^T / mu_1",
        "K_1 = K_C",
    ]
    assert section(text, "Result") == [
        "               [ K_11*K_33 - K_13**2    K_12*K_33 - K_13*K_23  0 ]",
        "K_C = 1/K_33 * [ K_12*K_33 - K_13*K_23  K_22*K_33 - K_23**2    0 ]",
        "               [ 0                      0                      0 ]",
    ]


def test_steps_show_their_definitions():
    lines = section(derivation_text(ALL["in_steps"]), "Joint 1: rear")
    assert "mu_1 = L*u_1_2 + u_1_6" in lines
    assert "K_1_11 = K_11 - u_1_1**2/mu_1" in lines
    assert "u_1 = (u_1_1, u_1_2, u_1_3, u_1_4, u_1_5, u_1_6)" in lines


def test_entries_without_room_get_a_name():
    long = sum(sp.Symbol(f"a_{i}") * sp.Symbol(f"b_{i}") for i in range(9))
    K = sp.ImmutableMatrix(sp.diag(long, 2, 0))
    lines = section(derivation_text(Derivation("K_C", K, (), K), width=60), "Result")
    assert lines[0] == "      [ K_C_11  0  0 ]"
    assert lines[3].startswith("K_C_11 = a_0*b_0 + a_1*b_1")


@pytest.mark.parametrize("name", ALL)
def test_no_line_is_wider_than_allowed(name):
    for width in (60, 200):
        lines = derivation_text(ALL[name], width=width).splitlines()
        assert max(map(len, lines)) <= width
        assert not any(line != line.rstrip() for line in lines)
    with pytest.raises(InputError, match="width"):
        derivation_text(ALL[name], width=30)


def test_names_do_not_clash_with_given_symbols():
    K_0, K_C, u_1, mu_1 = sp.symbols("K_0 K_C u_1 mu_1")
    K = sp.Matrix([[K_0, 0, u_1], [0, K_C, 0], [u_1, 0, mu_1]])
    lines = derivation_text(derive_chain(K, {"tip": [0, 0, 1]})).splitlines()
    assert "mu'_1 = mu_1" in lines
    assert "u'_1 = (u_1, 0, mu_1)" in lines
    assert "K'_1 = K'_0 - u'_1 u'_1^T / mu'_1" in lines
    assert any(line.lstrip().startswith("K'_C = ") for line in lines)


def test_long_stages_are_not_written_out():
    x = sp.Symbol("x")
    long = sum(sp.Symbol(f"c{i}") * x**i for i in range(2, 400))
    K = sp.ImmutableMatrix(sp.diag(x, x + long, x * long + 1))
    first = ALL["equation_4"].stages[0]
    result = sp.ImmutableMatrix(sp.diag(x, 0, 0))
    stages = (
        type(first)("one", first.J, "recursion (15)", first.u, first.mu, K),
        type(first)("two", first.J, "recursion (15)", first.u, first.mu, result),
    )
    text = derivation_text(Derivation("K_C", K, stages, result))
    assert "operations and is not written out." in text
    assert len(text) < 4000


@pytest.mark.parametrize(
    ("name", "how"),
    [
        ("3-rrr", {}),
        ("delta", {"pose": rs.AtSymbols()}),
        ("agile-eye", {"pose": rs.AtSymbols()}),
        ("orthoglide", {"pose": rs.AtSymbols()}),
        ("six-joint-arm", {}),
        ("3-rrr", {"form": Steps()}),
        ("gough-stewart-b-beams", {"leg": "leg1"}),
        ("gough-stewart-b", {"pose": rs.AtSymbols()}),
        ("hexaglide", {}),
    ],
)
def test_every_name_that_is_printed_has_a_meaning(name, how):
    check_names(outline_of(rs.derive(name, **how)))


def test_every_name_of_what_follows_from_a_formula_has_a_meaning():
    derivation = rs.derive("hexapod")
    check_names(outline_of(compliance_steps(derivation)))
    check_names(outline_of(differentiate(derivation, "R")))
    check_names(outline_of(rs.derive("3-prs").named))


def check_names(outline):
    *blocks, nomenclature = outline
    assert isinstance(nomenclature, Nomenclature)
    rows = [[getattr(x, "name", x) for x in names] for names, _ in nomenclature.rows]
    listed = {x for row in rows for x in row}
    # w stands for w_1, w_2, ...; a row "p_1, ..., p_5" for those between its ends.
    letters = {x for x in listed if "_" not in x}
    letters |= {re.match(r"[A-Za-z]*", row[0])[0] for row in rows if "..." in row}
    lefts = [b.name for b in blocks if isinstance(b, MatrixEquation)]
    lefts += [e.name for b in blocks if isinstance(b, EquationRows) for e in b.rows]
    tables = [b for b in blocks if isinstance(b, FormulaTable)]
    heads = [getattr(x, "name", x) for b in tables for x in b.head]
    # A column t has t_1, t_2, ... in it.
    lefts += [x for x in heads if not any(y.startswith(f"{x}_") for y in listed)]
    unsaid = {x for x in lefts if x not in listed and re.match(r"[A-Za-z]*", x)[0] not in letters}
    assert unsaid <= {"0"}  # where the legs close


def test_a_common_factor_that_is_long_has_a_name():
    text = derivation_text(rs.derive("3-rrr", leg="leg1"))
    lines = section(text, "Compliance without passive joints")
    first = next(i for i, line in enumerate(lines) if "K_0 = K_0_f * [" in line)
    assert lines[first - 1].lstrip().startswith("[ C_22*C_33 - C_23**2 ")
    assert lines[first + 2].startswith("K_0_f = 1/(C_11*C_22*C_33")
    assert text.count("C_11*C_22*C_33") == 1
