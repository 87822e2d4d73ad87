"""Closed streams, full disks, letters that an encoding lacks, names that command a terminal."""

import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from robostiff.cli.main import app
from tests.interrupts import interrupts_heard

RUN = f"{shlex.quote(sys.executable)} -m robostiff.cli.main"
EVIL = """\
robostiff: 1
name: "x\\x1b]0;PWN\\x07\\x1b[2J\\nstatus: ok \\u202e"
title: "t\\x9b31m"
source: "s\\x1b[2J"
legs:
  - name: "a\\u2028b"
    chain:
      - {type: revolute, axis: z, name: "=1+1", role: actuated, stiffness: 1e4 N m/rad}
      - {type: beam, to: [1,0,0], material: steel, section: {circle: {diameter: 10 mm}}}
"""

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the shell of POSIX")


@pytest.fixture(autouse=True)
def _evil(in_a_folder):
    Path("evil.yaml").write_text(EVIL)


def shell(command: str, **settings: str):
    return subprocess.run(
        ["/bin/bash", "-c", command],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **settings},
    )


def test_closed_output():
    outcome = shell(f"{RUN} check hexapod --json >&-")
    assert outcome.returncode == 2
    assert outcome.stderr == "robostiff: error: standard output is closed\n"


def test_closed_input():
    outcome = shell(f"{RUN} check - <&-")
    assert outcome.returncode == 2
    assert outcome.stderr.startswith("robostiff: error: <stdin>")
    assert outcome.stderr.count("\n") == 1


def test_closed_input_and_error_are_not_needed():
    outcome = shell(f"{RUN} robots <&- 2>&-")
    assert outcome.returncode == 0
    assert "hexapod" in outcome.stdout
    assert shell(f"{RUN} check missing.yaml 2>&-").returncode == 2
    assert shell(f"{RUN} map 3-rpr --x '0 0.01 2' -o m.nc 2>&-").returncode == 0


def test_a_reader_who_leaves_hears_no_more():
    # 'sleep' makes sure that nobody reads when the command writes.
    outcome = shell(f"{RUN} stiffness hexapod --json | true; echo ${{PIPESTATUS[0]}}")
    assert outcome.stdout == "141\n"
    assert outcome.stderr == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
def test_full_output():
    outcome = shell(f"{RUN} stiffness hexapod > /dev/full")
    assert outcome.returncode == 2
    assert outcome.stderr.startswith("robostiff: error: could not read or write")
    assert "No space left" in outcome.stderr
    assert outcome.stderr.count("\n") == 1


def test_letters_that_the_output_does_not_have():
    text = Path("evil.yaml").read_text()
    Path("greek.yaml").write_text(text.replace("=1+1", "ωμος"), encoding="utf-8")
    latin = {"PYTHONIOENCODING": "latin-1"}
    outcome = shell(f"{RUN} check greek.yaml", **latin)
    assert outcome.returncode == 0, outcome.stderr
    assert r"\u03c9\u03bc\u03bf\u03c2 (actuated)" in outcome.stdout
    # What programs read is not changed: it is refused.
    refused = shell(f"{RUN} derive greek.yaml --format latex", **latin)
    assert refused.returncode == 2
    assert refused.stdout == ""
    assert "its encoding, latin-1, has no '\\u03c9" in refused.stderr
    assert "write to a file with -o, or set PYTHONIOENCODING=utf-8" in refused.stderr


def test_micrometres_where_there_is_no_micro():
    outcome = shell(f"{RUN} deflection hexapod --wrench 'Fx=1 N'", PYTHONIOENCODING="ascii")
    assert outcome.returncode == 0, outcome.stderr
    assert "0.055938 um" in outcome.stdout
    assert "urad" in outcome.stdout
    assert "\\x" not in outcome.stdout


def test_an_interruption_ends_with_a_message():
    out = err = ""
    for patience in (2, 10, 60):  # until it waits for a model: a busy machine takes its time
        with interrupts_heard():
            running = subprocess.Popen(
                [sys.executable, "-m", "robostiff.cli.main", "check", "-"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
        time.sleep(patience)
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=60)
        # Python may end itself by the signal, which a shell also calls 130.
        assert running.returncode in (130, -signal.SIGINT)
        if "Traceback" not in err:
            break
    assert (out, err) == ("", "robostiff: interrupted\n")


COMMANDS = [
    "check evil.yaml",
    "check evil.yaml --json",
    "stiffness evil.yaml",
    "deflection evil.yaml --wrench '1 0 0 0 0 0'",
    "indices evil.yaml",
    "verify evil.yaml",
    "derive evil.yaml",
    "derive evil.yaml --format latex",
    "derive evil.yaml --format html",
    "derive evil.yaml --format md",
    "derive evil.yaml --format json",
    "derive evil.yaml --format python",
    "derive evil.yaml --format c",
    "map evil.yaml --joint '=1+1 0 1 2' -o -",
    "report evil.yaml -o report.html",
    "map evil.yaml --x '0 1 2' -o -",
    "derive evil.yaml --pose wrong",
    "check 'hexapod\x1b[2J'",
]
EVIL_LETTERS = "\x1b\x07\x9b\x00\x7f\x85\u202e\u2028\u2029"


@pytest.mark.parametrize("command", COMMANDS)
def test_names_do_nothing(command):
    outcome = CliRunner().invoke(app, shlex.split(command))
    assert outcome.exit_code in (0, 2), outcome.stderr
    assert outcome.exception is None or isinstance(outcome.exception, SystemExit)
    shown = outcome.stdout + outcome.stderr
    for file in {*Path().iterdir()} - {Path("evil.yaml")}:
        # The program inside the page has letters of its own.
        page = file.read_text(encoding="utf-8").split("plotly.js v")
        shown += page[0] + page[-1] if len(page) == 1 else page[0]
    assert not set(EVIL_LETTERS) & set(shown)
    assert "\nstatus: ok \\u202e" not in outcome.stdout


def test_names_do_nothing_on_a_terminal():
    import pty

    leader, follower = pty.openpty()
    with os.fdopen(leader, "rb", closefd=True) as screen:
        for arguments in (["stiffness", "evil.yaml"], ["check", "evil.yaml"]):
            subprocess.run(
                [sys.executable, "-m", "robostiff.cli.main", *arguments],
                stdout=follower,
                check=False,
                env={**os.environ, "TERM": "dumb", "COLUMNS": "120", "NO_COLOR": "1"},
            )
            shown = os.read(screen.fileno(), 100_000).decode()
            assert "x\\x1b]0;PWN\\x07" in shown
            assert not set("\x07\x9b\u202e\u2028") & set(shown)
            assert "\x1b]0" not in shown
            assert "\x1b[2J" not in shown
    os.close(follower)


LIMITED = """\
import resource, signal, sys
sys.dont_write_bytecode = True  # it would write the first 1024 bytes
resource.setrlimit(resource.RLIMIT_FSIZE, (1024, 1024))
sys.argv[0] = "robostiff"
from robostiff.cli.main import main
main()
"""


@pytest.mark.parametrize(
    "command",
    [
        "map 3-rpr --x '0 0.01 500' --quantity stiffness -o out.nc",
        "map 3-rpr --x '0 0.01 5000' --quantity stiffness --batched -o out.zarr",
        "derive 3-rpr --pose symbolic --steps -o out.py",
        "report 3-rpr -o out.html",
        "convert 3-rpr --to snapshot -o out.json",
        "schema model -o out.json",
    ],
)
def test_a_disk_that_fills_up(command, tmp_path):
    output = Path(command.rpartition(" ")[2])
    is_store = output.suffix == ".zarr"
    if not is_store:
        output.write_text("from before")
        command += " --overwrite"
    outcome = shell(f"{shlex.quote(sys.executable)} -c {shlex.quote(LIMITED)} {command}")
    assert outcome.returncode == 2, outcome.stderr
    assert outcome.stderr.startswith("robostiff: error: could not read or write")
    assert "File too large" in outcome.stderr
    assert "Traceback" not in outcome.stderr
    left = {path.name for path in tmp_path.iterdir()} - {"evil.yaml"}
    if is_store:
        assert left <= {"out.zarr"}
    else:
        assert left == {output.name}
        assert output.read_text() == "from before"


def test_the_package_runs_as_a_module():
    command = [sys.executable, "-m", "robostiff", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("robostiff ")
