"""Names from strangers' files in what is written for other programs: shown, and never run."""

import re
import shutil
import subprocess
import sys

import pytest
from click.testing import CliRunner

import robostiff as rs
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
