"""Names from strangers' files in what is written for other programs: shown, and never run."""

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

HOSTILE = (
    "coding: utf_7 +AAo-import os; os.system('touch PWNED')+AAo-#",
    '"""\nopen("PWNED", "w")\n"""',
    "*/\n#include </etc/passwd>\nint main(void) { return 1; } /*",
    "\\input{/etc/passwd} \\immediate\\write18{touch PWNED}",
    '#eval("1") #read("/etc/passwd") $ x $',
    "[exec touch PWNED] ; } {$x \\",
    "%{\nsystem('touch PWNED');\n%}",
    "'; system('touch PWNED'); x = '",
    "<script>alert(1)</script>&lt;&#x27;",
    "`touch PWNED`$(touch PWNED)\r\u2028exec touch PWNED",
    "\u202ereversed \x1b[2J",
    "=cmd|'/c calc'!A1",
    "n" * 3000,
)

MODEL = """robostiff: 1
name: {0}
title: {0}
source: {0}
notes: {0}
legs:
  - name: {0}
    chain:
      - {{type: revolute, name: {0}, axis: z, role: actuated, stiffness: 1e4}}
      - {{type: beam, name: {1}, to: [0.5, 0, 0], material: steel,
         section: {{circle: {{diameter: 20 mm}}}}}}
"""


def quoted(name):
    """A name in YAML."""
    return '"' + "".join(f"\\u{ord(c):04x}" for c in name) + '"'


def model_of(folder, name, text=MODEL):
    """A model file in which all has a hostile name."""
    file = folder / "m.yaml"
    file.write_text(text.format(quoted(name), quoted(f"2{name}")), encoding="utf-8")
    assert rs.load(file).name == name
    return file


def _run(command, folder):
    return subprocess.run(
        command, check=False, cwd=folder, capture_output=True, text=True, timeout=60
    )


@pytest.mark.parametrize("name", HOSTILE)
def test_names_in_scripts_of_other_programs_are_not_run(name, tmp_path):
    file = model_of(tmp_path, name)
    for script, form in (("x.py", "opensees"), ("x.tcl", "opensees"), ("x.inp", "calculix")):
        arguments = ["convert", str(file), "--to", form, "-o", str(tmp_path / script)]
        found = CliRunner().invoke(app, arguments)
        assert found.exit_code == 0, found.output
        text = (tmp_path / script).read_bytes()
        assert text.isascii()
        assert max(map(len, text.splitlines())) < 500
        assert not re.search(rb"coding[=:]", b"\n".join(text.splitlines()[:2]))
    stub = tmp_path / "openseespy"
    stub.mkdir()
    (stub / "opensees.py").write_text("def __getattr__(name):\n    return lambda *args: 0\n")
    (stub / "__init__.py").write_text("")
    done = _run([sys.executable, "-c", "import x"], tmp_path)
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.split()) == {"0"}
    if tcl := shutil.which("tclsh"):
        (tmp_path / "all.tcl").write_text("proc unknown args {return 0}\nsource x.tcl\n")
        done = _run([tcl, "all.tcl"], tmp_path)
        assert done.returncode == 0, done.stderr
    lines = (tmp_path / "x.inp").read_text().splitlines()
    assert [line.startswith("** Network ") for line in lines].count(True) == 1
    assert all(re.fullmatch(r"[-+*A-Z, =a-z0-9.()]*", own) for own in lines[3:])
    assert not (tmp_path / "PWNED").exists()


# Names from strangers' files in exported formulas: shown, and never run.


class _Elements(HTMLParser):
    """Names and attributes of elements."""

    def __init__(self):
        super().__init__()
        self.found: set[str] = set()

    def handle_starttag(self, tag, attrs):
        self.found |= {tag, *(key for key, _ in attrs if key.startswith("on"))}


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
