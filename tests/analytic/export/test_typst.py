import builtins
import re

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.export import derivation_pdf, derivation_typst
from robostiff.errors import InputError
from tests.analytic.export.derivations import ALL
from tests.analytic.export.expressions import expressions


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
    find = builtins.__import__

    def without_typst(name, *others):
        if name == "typst":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return find(name, *others)

    monkeypatch.setattr(builtins, "__import__", without_typst)
    with pytest.raises(InputError, match=r"pip install 'robostiff\[pdf\]'"):
        derivation_pdf(ALL["equation_4"], tmp_path / "x.pdf")
