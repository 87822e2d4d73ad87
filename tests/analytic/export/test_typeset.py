"""LaTeX of derivations, set by pdflatex: it compiles, and nothing is wider than the page."""

import subprocess

import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import differentiate
from robostiff.analytic.export import derivation_latex
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


def test_derivations_by_hand_and_a_derivative_are_set(tmp_path):
    h = sp.Symbol("h", positive=True)
    fragments = [*map(derivation_latex, (*ALL.values(), differentiate(ALL["gough_stewart_b"], h)))]
    assert complaints_of_tex(tmp_path, fragments) == []
