"""The benchmark of derivations runs, and all its routes give the same matrix."""

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
def test_the_expert_derives_the_same_matrix(problems: list[str]):
    run = subprocess.run(
        [sys.executable, ROOT / "benchmarks/expert.py", "--compare", *problems],
        capture_output=True,
        text=True,
        check=True,
    )
    found = [float(line.rpartition(":")[2]) for line in run.stdout.splitlines()]
    assert len(found) >= len(problems)
    assert max(found) < 1e-12
