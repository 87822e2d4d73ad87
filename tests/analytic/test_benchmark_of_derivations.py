"""The benchmark of derivations runs, and all its routes give the same matrix."""

import subprocess
import sys
from pathlib import Path

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


def test_robots_are_compared_with_numbers(tmp_path: Path):
    script = ROOT / "benchmarks/derivations.py"
    model = ROOT / "tests/analytic/data/gsb-drive.yaml"
    page, before = tmp_path / "page.md", (ROOT / "docs/derivations.md").read_text(encoding="utf-8")
    page.write_text(before, encoding="utf-8")
    run = subprocess.run(
        [sys.executable, script, "--robots", model, "3-rpr", "--sets", "5", "--table", page],
        capture_output=True,
        text=True,
        check=True,
    )
    lines = [line.split() for line in run.stdout.splitlines()]
    rows = {(line[0], line[1]): line[2:] for line in lines if len(line) > 2}
    home = rows["gsb-drive", "home"]
    assert home[0] == "springs"
    assert rows["3-rpr", "home"][0] == "closed"
    assert rows["gsb-drive", "symbolic"][0] == rows["3-rpr", "symbolic"][0] == "vectors"
    assert int(home[2]) <= 60
    assert int(home[3]) <= 10
    assert float(home[-1]) < 1e-12
    assert "  c_a = 1/k + L_a/EA_1" in run.stdout
    assert "K15 = -K24" in run.stdout
    # Rows of these robots are written, all others stay.
    old, new = (text.splitlines() for text in (before, page.read_text(encoding="utf-8")))
    assert sum(line.startswith("| gsb-drive | ") for line in new) == 2
    named = "| gsb-drive ", "| 3-rpr ", "Processor: "
    own, others = ([x for x in lines if not x.startswith(named)] for lines in (new, old))
    assert own == others


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
