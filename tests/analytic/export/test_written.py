"""Formulas as they are written in every language, and what is refused: in ``written.txt``.

A line there is an expression of Python, below it what it gives. ``python -m
tests.analytic.export.test_written`` writes the page anew.
"""

from pathlib import Path
from typing import Any

import pytest
import sympy as sp

import robostiff as rs
from robostiff import analytic
from robostiff.analytic import export
from robostiff.analytic.export import language, languages
from robostiff.analytic.export.entries import in_decimals, readable
from robostiff.analytic.export.program import program
from tests.analytic import formulas
from tests.analytic.export.derivations import ALL, of_signed_symbols
from tests.analytic.test_closed_limits import FULL, general
from tests.said import indented, now, on_file, write

PAGE = Path(__file__).parent / "written.txt"
DATA = Path(__file__).parents[1] / "data"
LONG = sp.sympify("L*(x + y)*(y + z)/(x*y*z)")


class Plain:
    """A language without marks."""

    write, opening, closing, slash, power = str, "(", ")", "/", "**{}"


def of(*rows: Any, definitions: Any = ()) -> Any:
    """A derivation of nothing but its matrix."""
    K = sp.ImmutableMatrix(rows[0] if len(rows) == 1 else sp.diag(*rows))
    return analytic.Derivation("K_C", K, (), K, definitions)


def named(*rows: Any, **options: Any) -> list[str]:
    """The names that recur in a matrix, and what they stand for."""
    K = sp.Matrix(rows[0] if len(rows) == 1 else sp.diag(*rows))
    found = analytic.name_combinations(K, **options)
    return [f"{d.symbol} = {d.expression}" for d in found.definitions]


def among(text: str, *parts: str) -> str:
    """The lines of a text in which one of some parts stands."""
    return "\n".join(line for line in text.splitlines() if any(part in line for part in parts))


KNOWN: dict[str, Any] = {}


def derived(name: str, **how: Any) -> Any:
    file, key = DATA / f"{name}.yaml", f"{name} {how}"
    if key not in KNOWN:
        KNOWN[key] = rs.derive(file if file.exists() else name, **how)
    return KNOWN[key]


NAMES: dict[str, Any] = {
    **{name: getattr(own, name) for own in (sp, analytic, formulas) for name in dir(own)
       if not name.startswith("_")},
    **{str(own): own for own in sp.symbols("x y z phi L k d_a mu_1 k_1 k_2 a b l top", real=True)},
    **{str(own): own for own in sp.symbols("R r h", positive=True)},
    **ALL.functions,
    **{"text": export.derivation_text, "latex": export.derivation_latex},
    **{"markdown": export.derivation_markdown, "typst": export.derivation_typst},
    **{"python": export.python_function, "c": export.c_function},
    **{"julia": export.julia_function, "matlab": export.matlab_function},
    **{"LATEX": languages.LATEX, "TYPST": languages.TYPST, "MATHML": languages.MATHML},
    **{"TEXT": languages.TEXT, "broken": language.broken_lines, "PLAIN": Plain, "LONG": LONG},
    **{"readable": readable, "in_decimals": in_decimals, "program": program, "rs": rs, "sp": sp},
    **{"general": general, "FULL": FULL},
    **{"of": of, "named": named, "among": among, "derived": derived, "signed": of_signed_symbols},
}  # fmt: skip


def say(_: str, expression: str) -> str:
    try:
        written: Any = eval(expression, dict(NAMES))  # noqa: S307
    except (rs.RobostiffError, ValueError) as error:
        written = f"error: {error}"
    if isinstance(written, analytic.RankFormula):
        told = {"rank": written.rank, "where it drops": written.exceptions}
        told |= {"which is allowed": written.allowed, "shared": written.common_minor}
        written = [
            f"{word}: {value}" for word, value in (told | {"remark": written.remark}).items()
        ]
    lines = written if isinstance(written, list | tuple) else str(written).splitlines()
    lines = lines or ["(nothing)"]
    return indented("\n".join(str(line).rstrip() for line in lines if str(line).strip()))


@pytest.mark.parametrize("subject", on_file(PAGE))
def test_what_is_written_is_what_is_on_file(subject):
    told = {subject: on_file(PAGE)[subject]}
    assert now(told, say) == told


if __name__ == "__main__":
    write(PAGE, now(on_file(PAGE), say))
