"""Calls that cannot be answered: exit status 2, one message, nothing written.

``refusals.txt`` has what is said of each; ``python -m tests.cli.test_refusals`` writes it anew.
Options are read in one place: all that can be wrong with one stands by one command, some of it by
the others.
"""

import shlex
import shutil
from contextlib import chdir
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.cli.running import Running
from tests.said import indented, now, on_file, write

PAGE, ROOT = Path(__file__).parent / "refusals.txt", Path(__file__).parents[2]
#: Files that are not shipped, in the folder in which the commands run.
FILES = (
    *("examples/portal.json", "examples/ur5.stiffness.yaml", "docs/star-platform.yaml"),
    "tests/cases/data/a01_cantilever_x.json",
)


def say(command: str, call: str) -> str:
    """The message with which a command refuses."""
    with TemporaryDirectory() as folder, chdir(folder):
        for file in FILES:
            shutil.copy(ROOT / file, folder)
        before = sorted(Path().iterdir())
        outcome = Running(command)(*shlex.split(call))
        assert isinstance(outcome.exception, SystemExit), repr(outcome.exception)
        assert outcome.exit_code == 2, outcome.output
        assert outcome.stdout == ""
        assert sorted(Path().iterdir()) == before
    assert "\x1b" not in outcome.stderr
    return indented(outcome.stderr.removesuffix("\n"))


@pytest.mark.parametrize("command", on_file(PAGE))
def test_what_is_said_of_a_call_is_what_is_on_file(command):
    told = {command: on_file(PAGE)[command]}
    assert now(told, say) == told


if __name__ == "__main__":
    write(PAGE, now(on_file(PAGE), say))
