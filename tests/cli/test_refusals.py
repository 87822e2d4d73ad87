"""Calls that cannot be answered: exit status 2, one message, nothing written.

``refusals.txt`` has what is said of each; ``python -m tests.cli.test_refusals`` writes it anew.
Options are read in one place: all that can be wrong with one stands by one command, some of it by
the others.
"""

import re
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

#: Files that are none of what their names say, and folders that have such names.
ANY, PICTURE = bytes(range(256)) * 4, b"\x89PNG\r\n\x1a\n" + bytes(100)
CONTENTS = {
    **{"empty.yaml": b"", "empty.urdf": b"", "empty.xml": b"", "blank.json": b" \n\n"},
    **{"binary.yaml": ANY, "binary.urdf": ANY, "binary.json": PICTURE, "text.txt": b"hello\n"},
    **{"latin.yaml": "robostiff: 1\nname: Größe\n".encode("latin-1"), "list.yaml": b"- 1\n- 2\n"},
    **{"empty.csv": b"", "binary.csv": ANY, "mark.csv": b"\xff\xfe", "letters.csv": b"x\n" * 3},
    **{"short.csv": b"x,y\n1\n", "empty.nc": b"", "binary.nc": ANY, "empty.zarr": b""},
    **{"torn.nc": b"\x89HDF\r\n\x1a\n" + bytes(500), "binary.zarr": ANY},
}
FOLDERS = ("folder.yaml", "folder.html", "folder.nc", "folder.zarr")


def say(command: str, call: str) -> str:
    """The message with which a command refuses."""
    with TemporaryDirectory() as folder, chdir(folder):
        for file in FILES:
            shutil.copy(ROOT / file, folder)
        for name, content in CONTENTS.items():
            Path(name).write_bytes(content)
        for name in FOLDERS:
            Path(name).mkdir()
        before = sorted(Path().iterdir())
        outcome = Running(command)(*shlex.split(call))
        assert isinstance(outcome.exception, SystemExit), repr(outcome.exception)
        assert outcome.exit_code == 2, outcome.output
        assert outcome.stdout == ""
        assert sorted(Path().iterdir()) == before
    assert "\x1b" not in outcome.stderr
    # What HDF5 says is another text in each version of it.
    message = re.sub(r"(?<=HDF5 cannot read )\(.*\)", "(...)", outcome.stderr)
    return indented(message.removesuffix("\n"))


@pytest.mark.parametrize("command", on_file(PAGE))
def test_what_is_said_of_a_call_is_what_is_on_file(command):
    told = {command: on_file(PAGE)[command]}
    assert now(told, say) == told


if __name__ == "__main__":
    write(PAGE, now(on_file(PAGE), say))
