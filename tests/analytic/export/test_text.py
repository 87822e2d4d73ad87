"""Formulas as text, LaTeX and Typst: width, names, and documents that compile."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analytic import Derivation, Steps, compliance_steps, differentiate
from robostiff.analytic.export import (
    derivation_latex,
    derivation_markdown,
    derivation_pdf,
    derivation_text,
    derivation_typst,
)
from robostiff.analytic.export.languages import LATEX, latex_words
from robostiff.analytic.export.notation import (
    EquationRows,
    FormulaTable,
    MatrixEquation,
    Nomenclature,
)
from robostiff.analytic.export.outline import outline_of
from robostiff.errors import InputError
from tests.analytic.export.derivations import ALL
from tests.analytic.export.expressions import expressions


@pytest.mark.parametrize("name", ALL)
def test_no_line_is_wider_than_allowed(name):
    for width in (60, 200):
        lines = derivation_text(ALL[name], width=width).splitlines()
        assert max(map(len, lines)) <= width
        assert not any(line != line.rstrip() for line in lines)


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


PROGRAM = """
import hashlib, json
from robostiff.analytic import export
from tests.analytic.export.derivations import ALL

writers = [export.derivation_text, export.derivation_latex, export.derivation_markdown,
           export.derivation_typst, export.python_function, export.c_function,
           export.julia_function, export.matlab_function,
           lambda derivation: json.dumps(export.derivation_data(derivation))]
for derivation in ALL.values():
    for writer in writers:
        print(hashlib.sha256(writer(derivation).encode()).hexdigest())
"""


@pytest.mark.slow
def test_output_does_not_depend_on_the_hash_seed():
    root = Path(__file__).parents[3]
    outputs = set()
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM],
            cwd=root,
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        outputs.add(done.stdout)
    assert len(outputs) == 1


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


@pytest.mark.parametrize("name", ALL)
def test_every_displayed_formula_is_fitted_to_the_page_of_a_pdf(name, tmp_path):
    body = derivation_typst(ALL[name]).split("\n= ", 1)[1]
    displayed = re.findall(r"^(.*)\$ [^$]* \$", body, re.MULTILINE)
    assert displayed
    assert set(displayed) <= {"#fit(", "  "}
    pytest.importorskip("typst")
    path = tmp_path / "derivation.pdf"
    derivation_pdf(ALL[name], path)
    first = path.read_bytes()
    assert first.startswith(b"%PDF-")
    if name == "oblique":  # the same each time
        derivation_pdf(ALL[name], path)
        assert path.read_bytes() == first


@given(st.lists(expressions, min_size=3, max_size=3), st.text(min_size=1, max_size=12))
def test_any_expression_and_any_name_compile(entries, name):
    typst = pytest.importorskip("typst")
    K = sp.ImmutableMatrix(sp.diag(*entries[:2], entries[2] + sp.Symbol(name)))
    source = derivation_typst(Derivation(name, K, (), K))
    typst.compile(source.encode(), format="svg", ignore_system_fonts=True)


def test_a_matrix_that_cannot_be_narrowed_takes_no_second_page():
    typst = pytest.importorskip("typst")
    # Names are not broken out, however long: the matrix is made smaller.
    K = sp.ImmutableMatrix(
        6, 6, lambda i, j: sp.Symbol("a_" + f"long{min(i, j)}{max(i, j)}name" * 4)
    )
    source = derivation_typst(Derivation("K_C", K, (), K))
    pages = typst.compile(source.encode(), format="png", ppi=40)
    assert isinstance(pages, bytes)


def test_missing_package_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "typst", None)
    with pytest.raises(InputError, match=r"pip install 'robostiff\[pdf\]'"):
        derivation_pdf(ALL["equation_4"], tmp_path / "x.pdf")
