"""Names from strangers' files in exported formulas: shown, and never run."""

import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser

import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff.analytic import export
from robostiff.cli.main import app
from tests.io.test_names_in_programs import HOSTILE, MODEL, model_of


class _Elements(HTMLParser):
    """Names and attributes of elements."""

    def __init__(self):
        super().__init__()
        self.found: set[str] = set()

    def handle_starttag(self, tag, attrs):
        self.found |= {tag, *(key for key, _ in attrs if key.startswith("on"))}


def _run(command, folder):
    return subprocess.run(
        command, check=False, cwd=folder, capture_output=True, text=True, timeout=60
    )


WRITERS = {
    **{"py": export.python_function, "c": export.c_function, "jl": export.julia_function},
    **{"m": export.matlab_function, "tex": export.derivation_latex, "html": export.derivation_page},
}


def test_names_in_exported_formulas_are_not_run(tmp_path):
    """Each is written; Python imports all of them at once, and a compiler reads them."""
    text = MODEL.replace("legs:\n", "parameters:\n  k: 1e4  # {0}\nlegs:\n")
    text = text.replace("1e4}}", "k}}")
    for i, name in enumerate(HOSTILE):
        derivation = rs.derive(rs.load(model_of(tmp_path, name, text), symbols=("k",)))
        written = {ending: write(derivation) for ending, write in WRITERS.items()}
        for ending, source in written.items():
            (tmp_path / f"formula_{i}.{ending}").write_text(source, encoding="utf-8")
        assert not re.search(r"\\(?:input|immediate|write|openout|catcode)", written["tex"])
        for ending in ("c", "jl", "m"):
            assert written[ending].isascii()
        lines = written["m"].split("\n")
        assert all(re.match(r"^ *%|^[\w \[\](){}=,.:;'~&<>|+*/^-]*$", x) for x in lines)
        start = '"""A stiffness matrix as a function of its symbols."""\n\n'
        assert written["py"].startswith(start)
        reader = _Elements()
        reader.feed(written["html"])
        assert not {"script", "img", "iframe", "a", "link"} & reader.found
        assert not any(key.startswith("on") for key in reader.found)
    names = [f"formula_{i}" for i in range(len(HOSTILE))]
    done = _run([sys.executable, "-c", f"import {', '.join(names)}"], tmp_path)
    assert done.returncode == 0, done.stderr
    if gcc := shutil.which("gcc"):
        files = [f"{name}.c" for name in names]
        done = _run([gcc, "-fsyntax-only", "-Werror", *files], tmp_path)
        assert done.returncode == 0, done.stderr
    assert not (tmp_path / "PWNED").exists()


@pytest.mark.skipif(not shutil.which("octave"), reason="Octave is not installed")
@pytest.mark.parametrize("name", [HOSTILE[6], HOSTILE[7]])
def test_octave_runs_no_names(name, tmp_path):
    file = model_of(tmp_path, name)
    output = tmp_path / "stiffness.m"
    CliRunner().invoke(app, ["derive", str(file), "-o", str(output)], catch_exceptions=False)
    done = _run(["octave", "--no-gui", "--norc", "--eval", "nargin('stiffness')"], tmp_path)
    assert done.returncode == 0, done.stderr
    assert not (tmp_path / "PWNED").exists()


@pytest.mark.parametrize("name", [HOSTILE[3], HOSTILE[4], HOSTILE[8]])
def test_typst_runs_no_names(name, tmp_path):
    pytest.importorskip("typst")
    output = tmp_path / "formula.pdf"
    arguments = ["derive", str(model_of(tmp_path, name)), "-o", str(output)]
    found = CliRunner().invoke(app, arguments)
    assert found.exit_code == 0, found.output
    assert output.read_bytes().startswith(b"%PDF")
