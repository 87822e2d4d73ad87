"""The benchmark of derivations runs, and all its routes give the same matrix."""

import runpy
import subprocess
import sys

import pytest

from tests.project.shown_output import ROOT


def test_all_routes_agree_on_one_joint():
    script = ROOT / "benchmarks/derivations.py"
    run = subprocess.run(
        [sys.executable, script, "--quick", "--joints", "1", "--limit", "60"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "robostiff.analytic" in run.stdout
    assert run.stdout.count("canonical") >= 9
    assert "WRONG" not in run.stdout
    assert "no answer" not in run.stdout


@pytest.mark.parametrize("problems", [["gsb", "3-rrr", "planar"], ["platform", "3-p", "hexapod"]])
def test_the_expert_derives_the_same_matrix(problems, monkeypatch, capsys):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    monkeypatch.setattr(sys, "argv", ["expert.py", "--compare", *problems])
    runpy.run_path(str(ROOT / "benchmarks/expert.py"), run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) >= len(problems)
    assert max(float(line.rpartition(":")[2]) for line in lines) < 1e-12
