import re

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analytic.derivation import Derivation
from robostiff.analytic.export import derivation_latex, derivation_markdown
from robostiff.analytic.export.languages import LATEX, latex_words
from tests.analytic.export.derivations import ALL


def without_escapes(text):
    return re.sub(r"\\[\\{}#$%&_]", "", text)


def check_balance(text):
    """Braces close what they open; so do environments, in order; rows have equal lengths."""
    depth = 0
    for character in without_escapes(text):
        depth += (character == "{") - (character == "}")
        assert depth >= 0
    assert depth == 0
    open_environments = []
    for kind, name in re.findall(r"\\(begin|end)\{([a-z*]+)\}", text):
        if kind == "begin":
            open_environments.append(name)
        else:
            assert open_environments.pop() == name
    assert not open_environments
    for body in re.findall(r"\\begin\{bmatrix\}(.*?)\\end\{bmatrix\}", text, re.DOTALL):
        assert len({row.count("&") for row in body.split(r"\\")}) == 1
    assert text.count(r"\left") == text.count(r"\right")
    assert text.count(r"\bigl(") == text.count(r"\bigr)")


@pytest.mark.parametrize("name", ALL)
def test_latex_and_markdown_are_well_formed(name):
    text = derivation_latex(ALL[name])
    check_balance(text)
    assert text.count(r"\[") - text.count(r"\\[") == text.count(r"\]")
    assert without_escapes(text).count("$") % 2 == 0
    assert text.isascii() or name == "badly_named"
    text = derivation_markdown(ALL[name])
    check_balance(text)
    assert text.count("$$") % 2 == 0
    for formula in re.findall(r"\$\$\n(.*?)\n\$\$", text, re.DOTALL):
        # A blank line would end the formula.
        assert "\n\n" not in formula
        assert "align*" not in formula


def test_equation_4():
    text = derivation_latex(ALL["equation_4"])
    assert (
        r"""\[
\mathbf{K}_{C} = \frac{1}{K_{33}} \begin{bmatrix}
K_{11} K_{33} - K_{13}^{2} & K_{12} K_{33} - K_{13} K_{23} & 0 \\
K_{12} K_{33} - K_{13} K_{23} & K_{22} K_{33} - K_{23}^{2} & 0 \\
0 & 0 & 0
\end{bmatrix}
\]"""
        in text
    )
    assert r"\mathbf{u}_{1} = \begin{bmatrix}" in text
    assert r"\frac{\mathbf{u}_{1} \mathbf{u}_{1}^{\mathsf{T}}}{\mu_{1}}" in text


def test_robots_are_set_as_by_hand():
    """Brackets stretch, fractions do not meet, vectors are bold in tables, units are raised."""
    arm = derivation_latex(rs.derive("six-joint-arm"))
    assert r"\left(-\frac{\pi}{2}\right)" in arm
    assert r"$\mathbf{t}_{1}$ & $\frac{1}{k_{1}}$" in arm
    assert r"$\mathbf{Q}_{1}$ & $\mathbf{m}_{1}$" in arm
    assert r"\mathbf{D} &= \operatorname{diag}\left(\frac{L}{\mathrm{EA}}, \frac{L^{3}}{12" in arm
    assert r"\frac{a}{b} & 0 \\[4pt]" in LATEX.matrix([[r"\frac{a}{b}", "0"], ["0", "1"]])
    assert r"N m\textsuperscript{2}" in arm
    slides = derivation_latex(rs.derive("3-prs"))
    assert r"\sum_{i} \left(\frac{\mathbf{w}_{i,1}" in slides
    assert r"K_{C,11} &= \frac{3}{2} \left(" in slides
    assert "K_{C,24}" not in slides  # the negative of K_15, which is before it


def test_long_entries_are_broken_out_and_long_sums_broken():
    K = sp.ImmutableMatrix(
        sp.diag(sum(sp.Symbol(f"a_{i}") * sp.Symbol(f"b_{i}") for i in range(40)), 0, 0)
    )
    text = derivation_latex(Derivation("K_C", K, (), K))
    assert "K_{C,11} & 0 & 0" in text
    assert r"K_{C,11} &= a_{0} b_{0} + a_{1} b_{1}" in text
    assert text.count(r"&\quad + a_") >= 4


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("K_11", "K_{11}"), ("K11", "K_{11}"), ("mu_1", r"\mu_{1}"), ("u_1_3", "u_{1,3}"),
        ("phi_1", r"\phi_{1}"), ("k_tau", r"k_{\tau}"), ("d_a", "d_{a}"), ("Omega", r"\Omega"),
        ("α_12", r"\alpha_{12}"), ("L_tip", r"L_{\mathrm{tip}}"), ("a%b", r"\text{a\%b}"),
        ("omicron", "o"), ("K_C,1", "K_{C,1}"),
    ],
)  # fmt: skip
def test_names_of_symbols(name, written):
    assert LATEX.name(name) == written


@given(st.text(max_size=20))
def test_no_name_breaks_the_document(name):
    check_balance(LATEX.name(name or "x"))
    check_balance(latex_words(name))
    bare = without_escapes(latex_words(name))
    assert not re.search(r"[#$%&_]", bare)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("gough-stewart-b", {}),
        ("delta", {"pose": rs.AtSymbols()}),
        ("gough-stewart-b-beams", {"leg": "leg1"}),
        ("agile-eye", {"leg": "leg x"}),
    ],
)
def test_a_snippet_has_the_formula_alone_and_all_of_its_names(name, options):
    derivation = rs.derive(name, **options)
    snippet = derivation.latex()
    check_balance(snippet)
    assert "\\[" not in snippet.replace("\\\\[4pt]", "")
    assert not any(word in snippet for word in ("paragraph", "section", "item", "tabular"))
    named = getattr(derivation, "named", None) or derivation
    lefts = {line.split("=")[0].strip(" &") for line in snippet.splitlines() if "=" in line}
    right = "".join(line.partition("=")[2] or line for line in snippet.splitlines())
    for d in named.definitions:
        written = LATEX.name(d.symbol.name)
        if written in right and d.expression.free_symbols:
            assert written in lefts
    if name == "gough-stewart-b-beams":  # by its wrenches, and by the name of the leg
        assert r"\mathbf{K}_{\mathrm{leg1}} = \frac{\mathbf{w}_{i} \mathbf{w}_{i}^" in snippet
    if name == "agile-eye":  # in its own axes, without the steps of its inverse
        assert r"\mathbf{K}_{\mathrm{leg}} = \mathbf{W} (" in snippet
        assert snippet.count("=") < 25


def test_a_snippet_explains_numbers_of_the_model_in_comments():
    lines = rs.derive("hexapod").latex().splitlines()
    assert lines[0] == "% EA_1: axial stiffness E A of strut.beam1, 527787565.803 N"
    assert sum(line.startswith("%") for line in lines) == 2
