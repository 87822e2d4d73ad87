"""Every command with files that it cannot use: exit status 2, one message, nothing written."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from robostiff.cli.main import app

# What a command needs besides its robot.
COMMANDS = {
    "check": (),
    "stiffness": (),
    "deflection": ("--wrench", "1 0 0 0 0 0"),
    "indices": (),
    "verify": (),
    "report": ("-o", "new.html"),
    "map": ("--x", "0 0.1 3", "-o", "new.nc"),
    "derive": (),
    "cables": (),
}
FILES = {
    "missing.yaml": None,
    "folder.yaml": "folder",
    "empty.yaml": b"",
    "blank.json": b" \n\n",
    "binary.yaml": bytes(range(256)) * 4,
    "binary.json": b"\x89PNG\r\n\x1a\n" + bytes(100),
    "empty.urdf": b"",
    "binary.urdf": bytes(range(256)) * 4,
    "empty.xml": b"",
    "latin.yaml": "robostiff: 1\nname: Größe\n".encode("latin-1"),
    "list.yaml": b"- 1\n- 2\n",
    "text.txt": b"hello\n",
    "x" * 300 + ".yaml": None,
}


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def refused(*arguments: str) -> str:
    """The message with which a command refuses."""
    before = sorted(Path().iterdir())
    outcome = CliRunner().invoke(app, list(arguments))
    assert isinstance(outcome.exception, SystemExit), repr(outcome.exception)
    assert outcome.exit_code == 2, outcome.output
    assert outcome.stdout == ""
    assert outcome.stderr.startswith("robostiff: error: ")
    assert outcome.stderr.count("\n") == 1
    assert sorted(Path().iterdir()) == before
    return outcome.stderr


# All commands load robots in one place: every file by one command, some by every command.
CALLS = [("check", name) for name in FILES] + [
    (command, name) for command in COMMANDS for name in ("folder.yaml", "binary.yaml")
]


@pytest.mark.parametrize(("command", "name"), CALLS, ids=lambda name: name[-12:])
def test_files_that_are_no_robots(command, name):
    content = FILES[name]
    if content == "folder":
        Path(name).mkdir()
    elif content is not None:
        Path(name).write_bytes(content)
    assert name[:50] in refused(command, name, *COMMANDS[command])


def test_a_name_that_commands_a_terminal():
    assert "\x1b" not in refused("check", "hexapod\x1b[2J")


@pytest.mark.parametrize("name", ["poses.csv"])
@pytest.mark.parametrize("content", [b"", bytes(range(256)), b"\xff\xfe", b"x\n" * 3, b"x,y\n1\n"])
def test_files_that_are_no_poses(name, content):
    Path(name).write_bytes(content)
    assert name in refused("map", "hexapod", "--poses", name, "-o", "new.nc")


@pytest.mark.parametrize("name", ["map.nc", "map.zarr"])
@pytest.mark.parametrize(
    "content", [None, b"", bytes(range(256)), b"\x89HDF\r\n\x1a\n" + bytes(500)]
)
def test_files_that_are_no_maps(name, content):
    if content is None:
        Path(name).mkdir()
    else:
        Path(name).write_bytes(content)
    assert name in refused("report", "hexapod", "-o", "new.html", "--map", name)
