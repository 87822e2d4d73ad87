"""The benchmark of kernels runs, and all its ways give the same matrix."""

import subprocess
import sys

import pytest

from tests.project.shown_output import ROOT


@pytest.mark.slow
def test_all_ways_to_k_agree():
    run = subprocess.run(
        [sys.executable, ROOT / "benchmarks/kernels.py", "--quick"],
        capture_output=True,
        text=True,
        check=True,
    )
    for name in ("rs.compile", "direct form", "lean NumPy loop", "hexapod, legs U-P-U"):
        assert name in run.stdout
    assert "WRONG" not in run.stdout
