"""LaTeX of derivations, set by pdflatex: it compiles, and nothing is wider than the page."""

import subprocess

import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import differentiate
from robostiff.analytic.export import derivation_html, derivation_latex, derivation_text
from tests.analytic.export.derivations import ALL
from tests.other_programs import command

pytestmark = pytest.mark.needs("LaTeX")

# Arms, parallel blocks, numbers of twelve digits, vectors, steps, angles of joints, a leg.
ROBOTS = {
    "3-prs": {},
    "3-rpr-beams": {},
    "agile-eye": {"pose": rs.AtJoints()},
    "capaman": {},
    "delta": {},
    "gough-stewart-b-beams": {"leg": "leg1"},
    "h4": {},
    "hexa": {},
    "hexapod": {"pose": rs.AtSymbols()},
    "orthoglide": {},
    "scara": {},
    "six-joint-arm": {},
}


def complaints_of_tex(folder, fragments):
    body = "\n\\clearpage\n".join(fragments)
    (folder / "all.tex").write_text(
        "\\documentclass{article}\n\\usepackage[utf8]{inputenc}\n\\usepackage{amsmath}\n"
        f"\\begin{{document}}\n{body}\\end{{document}}\n",
        encoding="utf-8",
    )
    done = subprocess.run(
        [command("LaTeX"), "-interaction=nonstopmode", "-halt-on-error", "all.tex"],
        cwd=folder,
        capture_output=True,
        check=False,
        timeout=120,
    )
    log = (folder / "all.log").read_text(encoding="utf-8", errors="replace").splitlines()
    found = [line for line in log if line.startswith(("!", "Overfull", "LaTeX Warning: Ref"))]
    assert done.returncode == 0, found
    assert (folder / "all.pdf").stat().st_size > 10_000
    return found


def test_derivations_of_robots_are_set_without_a_complaint(tmp_path):
    derived = [rs.derive(name, **how) for name, how in ROBOTS.items()]
    assert complaints_of_tex(tmp_path, map(derivation_latex, derived)) == []


def test_names_in_sentences_are_formulas():
    derivation = rs.derive("gough-stewart-b")
    latex, html = derivation_latex(derivation), derivation_html(derivation)
    assert (
        r"eq. (25) with $K_{11}$ = $\frac{1}{c_{i}}$; $\mathbf{d}_{i}$ and $-\mathbf{b}_{i}$"
        in latex
    )
    assert "the wrenches $\\mathbf{w}$ that they transmit" in latex
    assert "K_11" not in html
    assert "compliance <math>" in html
    assert "with K_11 = 1/c_i; d_i and -b_i are u_i and v_i" in " ".join(
        derivation_text(derivation).split()
    )


def test_derivations_by_hand_and_a_derivative_are_set(tmp_path):
    h = sp.Symbol("h", positive=True)
    fragments = [*map(derivation_latex, (*ALL.values(), differentiate(ALL["gough_stewart_b"], h)))]
    assert complaints_of_tex(tmp_path, fragments) == []
