import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
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
