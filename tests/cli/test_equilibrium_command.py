"""Pictures and reports of ``robostiff equilibrium`` and of its relatives."""

import pytest

from tests.cli.running import Running

run = Running("equilibrium")


def test_plot_of_the_curve(tmp_path):
    path = tmp_path / "curve.svg"
    asked = ("3-rpr", "--wrench", "0 -0.3 0", "--plot", str(path))
    outcome = run(*asked, "--factors", "0 1 3")
    assert outcome.exit_code == 0, outcome.stderr
    assert "stable" in path.read_text(encoding="utf-8")
    again = run(*asked, "--factors", "0 1 3")
    assert again.exit_code == 2
    assert "--overwrite" in again.stderr


@pytest.mark.parametrize("robot", ["3-puu", "cable-8"])
def test_plot_of_the_loaded_shape(tmp_path, robot: str):
    path = tmp_path / "shape.svg"
    outcome = run(robot, "--wrench", "0 0 -200 0 0 0", "--plot", str(path))
    assert outcome.exit_code == 0, outcome.stderr
    assert "under load" in path.read_text(encoding="utf-8")


def test_plot_of_a_mode_moves(tmp_path):
    path = tmp_path / "mode.html"
    words = ("3-rrr", "--mass", "platform=5 kg", "--plot", str(path), "--mode", "2")
    outcome = Running("modes")(*words)
    assert outcome.exit_code == 0, outcome.stderr
    page = path.read_text(encoding="utf-8")
    assert "mode 2" in page
    assert "swing(document.getElementById(" in page


def test_report_on_finite_loads(tmp_path):
    """What it says stands in tests/report/pages.txt."""
    path = tmp_path / "report.html"
    words = ("3-rpr", "--wrench", "0 -1e-3 0", "--finite-load", "-o", str(path))
    outcome = Running("report")(*words)
    assert outcome.exit_code == 0, outcome.stderr
    page = path.read_text(encoding="utf-8")
    for words in ("Under finite load", "Critical load: 725", "K under load", "plot-load-curve"):
        assert words in page
