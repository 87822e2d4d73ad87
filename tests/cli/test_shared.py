"""What all commands have in common: help, completion, warnings, JSON."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click import Context, Option
from click.testing import CliRunner

from robostiff.cli.main import app
from robostiff.cli.options import Command
from tests.files import FILES

COMMANDS = tuple(app.list_commands(Context(app)))
ROOT = Path(__file__).resolve().parents[2]
WITH_JSON = {
    "robots": ((),),
    "check": (
        ("planar-link", "--parts", "--plot", "parts.png"),
        ("hexapod", "--set", "k_joint=250"),
        (str(FILES / "sprung.yaml"),),
        ("cable-4-planar",),
        ("double-pantograph",),
        (str(ROOT / "docs" / "star-platform.yaml"),),
    ),
    "stiffness": (("planar-link",), ("cable-4-planar",)),
    "deflection": (("planar-link", "--wrench", "0 1 0"),),
    "equilibrium": (("planar-link", "--wrench", "0 1 0", "--critical", "--factors", "0 1 2"),),
    "modes": (("planar-link",),),
    "response": ((str(ROOT / "examples" / "portal.json"), "--load", "top=1 0 0"),),
    "indices": (("planar-link",),),
    "verify": (("3-rpr",),),
    "cables": (("cable-4-planar",), ("cable-4-planar", "--wrench", "0 -1 0")),
    "map": (("3-rpr", "--x", "0 10mm 2", "-o", "map.nc"),),
    "derive": (("planar-link",),),
    "plot": (("planar-link", "-o", "link.png"),),
    "report": (("3-rpr", "-o", "page.html"),),
    "schema": (("graph",), ("graph", "-o", "page.json")),
    "new": (("page", "--template", "planar"),),
    "convert": (("planar-link", "-o", "link.json"),),
}


def run(*arguments: str):
    return CliRunner().invoke(app, list(arguments), env={"COLUMNS": "80"})


def declared(command: str) -> type[Command]:
    assert app.get_command(Context(app), command) is not None
    return Command.named[command]


def test_commands_are_those_that_are_declared():
    listed = {declared(command) for command in COMMANDS}
    known = {own for own in Command.named.values() if own.__module__.startswith("robostiff")}
    assert listed == known


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_runs_and_names_each_option_once(command):
    assert "run" in vars(declared(command))
    names = [own.name for own in declared(command).parameters()]
    assert len(names) == len(set(names))


def test_an_option_has_the_same_words_in_every_command():
    """But those that say what a load, a file or a picture is for, or what was measured."""
    said: dict[str, set[str]] = {}
    for command in COMMANDS:
        for own in declared(command).parameters():
            if isinstance(own, Option):
                said.setdefault(max(own.opts, key=len), set()).add(str(own.help))
    several = {name for name, words in said.items() if len(words) > 1}
    loads = {"--pose", "--wrench", "--load", "--gravity"}
    compensation, measured = {"--angles", "--method"}, {"--hook", "--sigma"}
    others = loads | compensation | measured
    assert several <= others | {"--output", "--plot", "--mode", "--quantity"}


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_installed_once(shell, tmp_path):
    home = {"SHELL": f"/bin/{shell}", "HOME": str(tmp_path)}
    script = CliRunner().invoke(app, ["--show-completion"], env=home)
    assert script.exit_code == 0, script.output
    assert "_ROBOSTIFF_COMPLETE" in script.stdout
    for _ in range(2):
        outcome = CliRunner().invoke(app, ["--install-completion"], env=home)
        assert outcome.exit_code == 0, outcome.output
    (file,) = (path for path in tmp_path.rglob("*") if path.is_file())
    assert file.read_text().count("robostiff") == 1


def test_completion_leaves_the_file_of_the_shell_as_it_is(tmp_path):
    """It was read as UTF-8 and written anew: other encodings raised, ends of lines changed."""
    before = "# r\u00e9glages\r\nexport A=1".encode("latin-1")
    (tmp_path / ".bashrc").write_bytes(before)
    home = {"SHELL": "/bin/bash", "HOME": str(tmp_path)}
    outcome = CliRunner().invoke(app, ["--install-completion"], env=home)
    assert outcome.exit_code == 0, outcome.output
    after = (tmp_path / ".bashrc").read_bytes()
    assert after.startswith(before + b"\n")
    assert after.count(b"\n") == 3


def test_an_unknown_shell_is_refused(tmp_path):
    home = {"SHELL": "/bin/tcsh", "HOME": str(tmp_path)}
    outcome = CliRunner().invoke(app, ["--install-completion"], env=home)
    assert outcome.exit_code == 2
    assert "expected bash, zsh or fish" in outcome.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_every_command(command):
    short, long = run(command, "-h"), run(command, "--help")
    assert short.exit_code == 0
    assert short.output == long.output
    assert "--quiet" in short.output
    assert "--verbose" in short.output
    assert "\b" not in short.output
    assert "Examples -----" not in short.output


def test_examples_stay_in_one_line():
    lines = run("map", "--help").output.splitlines()
    place = lines.index("  Examples:")
    examples = lines[place + 1 : place + 4]
    assert all(line.startswith("    robostiff map hexapod --") for line in examples)
    assert examples[1].endswith('--wrench "0 0 -500 N 0 0 0" -o deflections.nc')


@pytest.mark.parametrize("command", WITH_JSON)
def test_json_has_the_keys_that_the_documents_list(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = set()
    for words in WITH_JSON[command]:
        outcome = run(command, *words, "--json")
        assert outcome.exit_code in (0, 1), outcome.stderr
        answer = json.loads(outcome.stdout, parse_constant=pytest.fail)
        version = 2 if command == "derive" else 1
        assert next(iter(answer.items())) == ("schema", f"robostiff {command} {version}")
        if {"pose", "modes", "parts", "displacements"} & set(answer):
            assert "units" in answer or command in ("indices", "verify")
        assert all(Path(own).is_file() for own in answer.get("files", ()))
        found |= set(answer)
    common = {"schema", "robostiff", "robot", "status", "advice", "order", "units"}
    assert found - common == _documented(command) - common


def _documented(command: str) -> set[str]:
    """Keys of a command that the page on JSON lists."""
    page = (ROOT / "docs" / "json.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `([a-z]+(?: --wrench)?)` \| (.*) \|$", page, re.MULTILINE))
    also = {"stiffness": ("cables",), "cables": ("cables --wrench",)}.get(command, ())
    return {key for name in (command, *also) for key in re.findall(r"`(\w+)`", rows[name])}


def test_json_of_a_schema_has_it_inside():
    inside = json.loads(run("schema", "graph", "--json").stdout)["json_schema"]
    assert inside == json.loads(run("schema", "graph").stdout)


BENT = "robostiff: 1\nname: arm\nsource: an example\nlegs:\n  - name: arm\n    chain:\n"
BENT += "      - {type: beam, to: [300, 0, 0], material: steel, section: {circle: {diameter: 1}}}\n"


def test_quiet_leaves_out_warnings_and_nothing_else(tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text(BENT)
    loud, quiet = run("stiffness", str(file)), run("stiffness", str(file), "--quiet")
    assert "robostiff: warning: " in loud.stderr
    assert quiet.stderr == ""
    assert quiet.stdout == loud.stdout
    assert "error: robot: got 'x'" in run("stiffness", "x", "--quiet").stderr


def test_verbose_adds_versions_times_and_places_of_errors_on_standard_error():
    plain, verbose = (
        run("stiffness", "planar-link", "--json", *more) for more in ((), ["--verbose"])
    )
    assert verbose.stdout == plain.stdout
    assert plain.stderr == ""
    assert f"numpy {np.__version__}" in verbose.stderr
    assert re.search(r"\d+\.\d\d s, processor \d+\.\d\d s", verbose.stderr)
    failed = run("stiffness", "x", "--verbose")
    assert failed.exit_code == 2
    assert "Traceback" in failed.stderr
    assert "robostiff: error: robot: got 'x'" in failed.stderr


def test_nearest_command_and_option_are_named():
    command, option = run("stifness", "hexapod"), run("stiffness", "hexapod", "--pos", "x")
    assert (command.exit_code, option.exit_code) == (2, 2)
    assert "did you mean stiffness?" in command.stderr
    assert "Did you mean '--pose'?" in option.stderr
    assert "robostiff -h lists them" in run("qqq").stderr


def test_all_mistakes_of_a_file_are_shown(tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text(BENT.replace("material", "matter").replace("name: arm\n    ", "nam: 3\n    "))
    outcome = run("check", str(file))
    assert outcome.exit_code == 2
    lines = outcome.stderr.splitlines()
    assert len(lines) == 2
    assert "legs[0].chain[0].matter: unknown key" in lines[0]
    assert "legs[0].nam: unknown key" in lines[1]


@pytest.mark.parametrize(
    ("words", "expected"),
    [("robostiff stif", ["stiffness"]), ("robostiff check gough", ["gough-stewart-a"])],
)
def test_completion_in_bash(words, expected):
    environment = {
        **os.environ,
        "_ROBOSTIFF_COMPLETE": "bash_complete",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split()) - 1),
    }
    script = "import sys; sys.argv[0] = 'robostiff'; from robostiff.cli.main import main; main()"
    found = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False
    ).stdout.split()
    found = [item.removeprefix("plain,") for item in found if item != "file,"]
    assert set(expected) <= set(found)
    assert all(word.startswith(words.split()[-1]) for word in found)
