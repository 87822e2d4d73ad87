"""Tests that need a program that is not there are left out, and that is said once."""

import os
import re
import subprocess
import sys

import pytest

from tests.other_programs import PEERS, command, is_there
from tests.project.shown_output import ROOT


def test_what_is_left_out_is_said_once(tmp_path):
    """Though two workers leave it out."""
    words = ("-q", "-p", "no:cacheprovider", "-n", "2", "tests/peers/test_calculix.py")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *words],
        cwd=ROOT,
        env={**os.environ, "PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    said = re.findall(r"^tests left out, as this is not installed: (.*)$", done.stdout, re.M)
    assert said == ["5 that need CalculiX"]
    assert "SKIPPED" not in done.stdout
    assert re.search(r"^1 passed", done.stdout.splitlines()[-1])


def test_a_program_that_is_not_in_the_list_is_an_error():
    assert is_there("no such program") is False
    with pytest.raises(KeyError):
        command("no such program")


def test_peers_are_no_packages_of_make_test():
    """They are marked, and come with the extra `peers`."""
    assert {"llvmlite", "pinocchio", "OpenSees", "Playwright"} <= PEERS
