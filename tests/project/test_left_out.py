"""Tests that need a program that is not there are left out, and that is said once."""

import os
import re
import subprocess
import sys
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests import conftest
from tests.other_programs import PEERS, command, is_there
from tests.project.shown_output import ROOT


def test_what_is_left_out_is_said_once(tmp_path):
    words = ("-q", "-p", "no:cacheprovider", "-p", "no:xdist", "tests/peers/test_calculix.py")
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


def test_two_workers_say_what_one_has_left_out():
    """Each tells it when it ends; both have left out the same."""
    worker: Any = SimpleNamespace(stash=pytest.Stash(), workeroutput={})
    worker.stash[conftest._LEFT_OUT] = {"CalculiX": 5}
    conftest.pytest_sessionfinish(cast(Any, SimpleNamespace(config=worker)))
    main: Any = SimpleNamespace(stash=pytest.Stash())
    for _ in range(2):
        conftest.pytest_testnodedown(SimpleNamespace(config=main, **vars(worker)))
    lines: list[str] = []
    conftest.pytest_terminal_summary(SimpleNamespace(write_line=lines.append), main)
    assert lines == ["tests left out, as this is not installed: 5 that need CalculiX"]


def test_a_program_that_is_not_in_the_list_is_an_error():
    assert is_there("no such program") is False
    with pytest.raises(KeyError):
        command("no such program")


def test_peers_are_no_packages_of_make_test():
    """They are marked, and come with the extra `peers`."""
    assert {"llvmlite", "pinocchio", "OpenSees", "Playwright"} <= PEERS
