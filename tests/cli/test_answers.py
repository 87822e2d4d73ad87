"""What commands print, word for word, is on file in ``answers.txt``.

``python -m tests.cli.test_answers`` writes it anew. Numbers may differ in their last digits, and so
may the order of lines, as in the documents.
"""

import json
import shlex
from contextlib import chdir
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.cli.running import Running
from tests.project.shown_output import ROOT, first_difference
from tests.said import indented, now, on_file, write

PAGE = Path(__file__).parent / "answers.txt"
#: What is another at each run, or in each version.
OTHERS = {"robostiff", "seconds", "poses_a_second"}


def say(command: str, call: str) -> str:
    """Standard output and standard error, and an exit status that is not 0."""
    with TemporaryDirectory() as folder, chdir(ROOT):
        outcome = Running(command)(*shlex.split(call.replace("OUT", folder)))
        assert outcome.exception is None or isinstance(outcome.exception, SystemExit)
    status = [f"exit status {outcome.exit_code}"] * (outcome.exit_code != 0)
    lines = outcome.output.splitlines()
    if "--json" in call:  # a key a line
        found = json.loads(outcome.stdout)
        lines = [f"{key}: {json.dumps(own)}" for key, own in found.items() if key not in OTHERS]
        lines += outcome.stderr.splitlines()
    printed = [
        line.replace(folder, "OUT").rstrip()
        for line in lines
        if line.strip() and "poses/s" not in line
    ]
    return indented("\n".join([*printed, *status]))


@pytest.mark.parametrize("command", on_file(PAGE))
def test_what_is_printed_is_what_is_on_file(command):
    told = on_file(PAGE)[command]
    produced = now({command: told}, say)[command]
    found = {call: first_difference(text, produced[call]) for call, text in told.items()}
    assert {call: own for call, own in found.items() if own} == {}


if __name__ == "__main__":
    write(PAGE, now(on_file(PAGE), say))
