"""``robostiff derive`` as a user types it."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from tests.cli.running import Running
from tests.interrupts import interrupts_heard

pytestmark = pytest.mark.usefixtures("in_a_folder")
run = Running("derive")


def test_format_follows_the_name_of_the_file():
    for name, start in {
        "a.tex": "% needs",
        "a.md": "# Cartesian",
        "a.c": "/*",
        "a.py": '"""',
        "a.jl": '"""',
        "a.m": "function K = stiffness(",
        "a.txt": "Cartesian",
    }.items():
        outcome = run.done("3-rpr", "--symbols", "none", "-o", name)
        assert outcome.stdout == ""
        assert Path(name).read_text(encoding="utf-8").lstrip().startswith(start)


def test_json_has_the_entries_as_text():
    outcome = run.done("3-rpr", "--pose", "symbolic", "--format", "json")
    found = json.loads(outcome.stdout)
    K = rs.derive("3-rpr", pose=rs.AtSymbols()).K
    assert found["K"] == [[sp.sstr(x) for x in row] for row in K.tolist()]


def test_pdf_is_written():
    pytest.importorskip("typst")
    run.done("gough-stewart-b", "-o", "b.pdf")
    assert Path("b.pdf").read_bytes().startswith(b"%PDF")


def test_symbols_set_and_pose_with_units():
    run.done(
        "gough-stewart-b",
        *("--symbols", "k", "--set", "h=750 mm", "--pose", "x=100 mm, gamma=10 deg"),
        *("-o", "k.py"),
    )
    space: dict = {}
    exec(Path("k.py").read_text(encoding="utf-8"), space)  # noqa: S102
    robot = rs.load("gough-stewart-b", {"h": "750 mm"})
    expected = rs.stiffness(robot, [0.1, 0, 0.75, 0, 0, np.radians(10)]).K
    np.testing.assert_allclose(space["stiffness"](k=1e8), expected, atol=1e-10 * expected.max())


def test_the_answer_says_that_time_has_ended():
    outcome = run.done("hexapod-pus", "--budget", "0.03")
    assert "did not end within 0.03 s of computing. K is in named steps." in outcome.stderr
    assert "A closed form did not end within 0.03 s of computing." in outcome.stdout


IN_A_LONG_CALL = """
import sys, time, flint
from robostiff.cli.command import as_click
from robostiff.cli.options import Command
from robostiff.cli.commands_derive import go_on_in_child

class Long(Command, name="long"):
    "A long call."

    def run(self):
        go_on_in_child(lambda passed: f"for {passed:.0f} s")
        print("begun", flush=True)
        n = flint.fmpz(10) ** 119 + 33
        (n * (flint.fmpz(10) ** 121 + 13)).factor()
        return 0

as_click("long", Long)()
"""


def test_an_interrupt_ends_a_call_that_cannot_be_interrupted_and_showed_no_progress():
    with interrupts_heard():
        process = subprocess.Popen(
            [sys.executable, "-c", IN_A_LONG_CALL],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    time.sleep(1.5)  # a terminal would show a line of progress by now
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (130, "robostiff: interrupted\n")


def test_a_child_passes_its_exit_status_and_its_messages_on():
    command = [shutil.which("robostiff", path=str(Path(sys.executable).parent)), "derive"]
    found = subprocess.run([*command, "3-rpp"], capture_output=True, text=True, check=False)
    assert found.returncode == 2
    assert found.stderr.count("did you mean") == 1
    found = subprocess.run([*command, "planar-link"], capture_output=True, text=True, check=False)
    assert (found.returncode, found.stderr) == (0, "")
    assert found.stdout.count("Cartesian stiffness matrix of planar-link") == 1


def test_progress_is_shown_on_a_terminal():
    pty = pytest.importorskip("pty")
    code = IN_A_LONG_CALL.replace("(n * (flint.fmpz(10) ** 121 + 13)).factor()", "time.sleep(1.5)")
    main, end = pty.openpty()
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.DEVNULL, stderr=end)
    os.close(end)
    assert process.wait(timeout=60) == 0
    assert b"\rfor 1 s" in os.read(main, 1000)
    os.close(main)


def test_json_is_a_short_word_for_the_format():
    command = ("3-rpr", "--symbols", "none", "--steps")
    assert run(*command, "--json").stdout == run(*command, "--format", "json").stdout
    assert json.loads(run(*command, "--json").stdout)["schema"] == "robostiff derive 2"


def test_a_snippet_is_the_formula_alone():
    found = run.done("planar-link", "--snippet")
    assert found.stdout == rs.derive("planar-link").latex()


def test_what_is_quicker_is_said_where_it_is_not_what_was_asked_for(monkeypatch):
    def interrupted(_: object) -> str:
        raise KeyboardInterrupt

    monkeypatch.setattr("robostiff.cli.commands_derive.latex_snippet", interrupted)
    hint = "; named steps, --steps, are quick"
    for options, words in (((), hint), (("--steps",), "")):
        outcome = run("planar-link", "--snippet", *options)
        assert outcome.exit_code == 130
        assert outcome.stderr == f"robostiff: interrupted{words}\n"
