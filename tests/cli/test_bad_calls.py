"""Every command with what it cannot use: exit status 2, one message, nothing written."""

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


WRENCHED = ("report -o new.html", "map --quantity deflection --x 0,1,2 -o n.nc")
POSES = ("1 2", "1 2 3 4 5 6 7", "1 kg 0 0 0 0 0", "", "a b c d e f", "nan 0 0 0 0 0", "x=1")
POSES += ("inf 0 0 0 0 0", "1e400 0 0 0 0 0", "0 0 0.8 1 m 0 0")
WRENCHES = ("", "1 2 3", "1 m 0 0 0 0 0", "0 0 0 1 N 0 0", "inf 0 0 0 0 0")
# Options are read in one place: all that is wrong by one command, one of it by the others.
BAD = [
    *[("stiffness", "hexapod", "--pose", pose) for pose in POSES],
    *[
        (own, "hexapod", "--pose", "1 2")
        for own in ("derive", "indices", "verify", "report -o n.html")
    ],
    *[("stiffness", "hexapod", "--at", at) for at in ("", "1 2 3 4", "1 N 0 0")],
    *[(own, "hexapod", "--at", "") for own in ("indices", "deflection --wrench 1,0,0,0,0,0")],
    *[("deflection", "hexapod", "--wrench", wrench) for wrench in WRENCHES],
    *[(command, "hexapod", "--wrench", "1 2 3") for command in WRENCHED],
    *[("check", "hexapod", "--set", given) for given in ("R", "no-such=1", "R=1 kg")],
    *[(own, "hexapod", "--set", "R") for own in ("stiffness", "verify", "derive", "indices")],
    *[("stiffness", "hexapod", "--set", given) for given in ("", "R=", "=1", "R=one", "R=nan")],
    *[("stiffness", "two-link-arm", "--joints", given) for given in ("", "1", "1 2 3", "1 m 0")],
    ("stiffness", "hexapod", "--joints", "1 2 3 4 5"),
    ("stiffness", "two-link-arm", "--joints", "1 2", "--pose", "0 0 0 0 0 0"),
    ("stiffness", "hexapod", "--method", ""),
    ("stiffness", "hexapod", "--side", "missing.yaml"),
    *[("indices", "hexapod", "--length", given) for given in ("", "0", "-1", "1 kg", "1 2", "nan")],
    *[("cables", "cable-8", "--wrench", given) for given in ("", "1 2", "1 kg 0 0 0 0 0")],
    *[("cables", "cable-8", "--tensions", given) for given in ("", "1 2", "1 m 2 3 4 5 6 7 8")],
    ("cables", "cable-8", "--rule", ""),
    ("cables", "cable-8", "--rule", "nearest", "--level", "2"),
    ("cables", "hexapod"),
    ("report", "hexapod", "-o", "new.txt"),
    ("report", "hexapod", "-o", "no/such/new.html"),
    ("report", "hexapod", "-o", "."),
    ("report", "hexapod", "-o", "new.html", "--map", "missing.nc"),
    ("report", "hexapod", "-o", "new.html", "--map", "."),
    *[("map", "hexapod", "--x", given, "-o", "n.nc") for given in ("", "1", "0 1 0", "0 1 -3")],
    *[("map", "hexapod", "--x", given, "-o", "n.nc") for given in ("0 0 3", "0 1 1", "1 2 nan")],
    *[("map", "hexapod", "--x", given, "-o", "n.nc") for given in ("0 1 1e14", "0 1 1e300")],
    *[("map", "hexapod", "--poses", given, "-o", "n.nc") for given in ("missing.csv", ".", "")],
    ("map", "hexapod", "--x", "0 1 9999999", "--y", "0 1 9999999", "-o", "n.zarr"),
    ("map", "hexapod", "--random", "0", "--x", "0 1", "-o", "n.nc"),
    ("map", "hexapod", "--random", "-1", "--x", "0 1", "-o", "n.nc"),
    ("map", "hexapod", "--random", "5", "--seed", "-1", "--x", "0 1", "-o", "n.nc"),
    ("map", "hexapod", "--x", "0 1 2", "--threads", "-1", "-o", "n.nc"),
    ("map", "hexapod", "--x", "0 1 2", "--workers", "0", "-o", "n.zarr"),
    ("map", "hexapod", "--x", "0 1 2", "--scheduler", "nowhere", "-o", "n.zarr"),
    ("map", "hexapod", "--x", "0 1 2", "--length", "0", "-o", "n.nc"),
    ("map", "hexapod", "--x", "0 1 2", "-o", ""),
    ("map", "hexapod", "--x", "0 1 2", "-o", "x" * 300 + ".nc"),
    ("derive", "hexapod", "-o", "x" * 300 + ".tex"),
    ("derive", "hexapod", "-o", "."),
    ("derive", "hexapod", "--symbols", "no_such"),
    ("derive", "hexapod", "--derivative", ""),
    ("derive", "hexapod", "--format", ""),
    ("derive", "cable-8"),
    ("check", ""),
    ("check", "hexapod\x1b[2J"),
]


@pytest.mark.parametrize("arguments", BAD, ids=lambda words: " ".join(words)[:60])
def test_calls_that_mean_nothing(arguments):
    command, *rest = arguments
    name, *options = command.split(" ")
    options = [option.replace(",", " ") for option in options]
    message = refused(name, rest[0], *options, *rest[1:])
    assert "\x1b" not in message


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
