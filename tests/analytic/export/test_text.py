import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import Derivation, Steps, compliance_steps, differentiate
from robostiff.analytic.export import derivation_text
from robostiff.analytic.export.blocks import (
    EquationRows,
    FormulaTable,
    MatrixEquation,
    Nomenclature,
)
from robostiff.analytic.export.outline import outline_of
from tests.analytic.export.derivations import ALL


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
