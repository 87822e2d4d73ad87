"""The commands ``robots``, ``schema``, ``new`` and ``convert``: only the last one computes."""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from robostiff.cli.options import Posing
from robostiff.cli.options_of_answers import ListRobots
from robostiff.cli.options_of_files import Convert, PrintSchema, WriteNew
from robostiff.cli.output import new_file, show, shown
from robostiff.errors import InputError, NoAnswerError, Words, warn_of_slip
from robostiff.extras import WRITERS, added, is_offered, loaded
from robostiff.io.suggest import did_you_mean, listing, nearest_first
from robostiff.robots import (
    RobotInfo,
    describe,
    robot_file,
    shipped_cable_robots,
    shipped_names,
    shipped_robots,
)
from robostiff.whole_file import whole_file

_YAML = (".yaml", ".yml")
_FORMS = dict.fromkeys(("snapshot", "graph"), (".json", *_YAML))
_PLAIN_NAME = re.compile(r"[A-Za-z][A-Za-z0-9 ._-]*[A-Za-z0-9]")
_WORDS_OF_YAML = {"true", "false", "null", "yes", "no", "on", "off"}
_WIDTH = 78  # of a terminal, for a table


def list_robots(asked: ListRobots) -> int:
    """Print the shipped robots."""
    listed = {name: describe(name) for name in sorted(shipped_names())}
    if asked.answer.as_json:
        robots = [
            {"name": name, "title": d.title, "source": d.source} for name, d in listed.items()
        ]
        show({"robots": robots})
    elif sys.stdout.isatty() and shutil.get_terminal_size().columns >= _WIDTH:
        _print_table(listed)
    else:
        for name, description in listed.items():
            sys.stdout.write(f"{name}\t{description.title}\n")
    return 0


def _print_table(listed: Mapping[str, RobotInfo]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False)
    table.add_column("robot", style="bold", no_wrap=True)
    table.add_column("what it is")
    table.add_column("source", style="dim")
    for name, description in listed.items():
        table.add_row(name, Text(shown(description.title)), Text(shown(description.source)))
    Console().print(table)


def print_schema(asked: PrintSchema) -> int:
    """Print or write the JSON schema of a file format."""
    from robostiff.cli.written_arguments import chosen
    from robostiff.io.model_file.schema import model_file_schema
    from robostiff.io.snapshot import network_schema, snapshot_schema

    form, answer = asked.form, asked.answer
    schemas = {"model": model_file_schema, "snapshot": snapshot_schema, "graph": network_schema}
    schema = chosen("schema", form, schemas)()
    text = json.dumps(schema, indent=2)
    if asked.output is None:
        show({"form": form, "json_schema": schema} if answer.as_json else text)
        return 0
    path = new_file("--output", asked.output, answer.overwrite)
    with whole_file(path) as begun:
        begun.write_text(text + "\n", encoding="utf-8")
    show({"files": [str(path)], "form": form} if answer.as_json else str(path))
    return 0


def templates() -> tuple[str, ...]:
    """Names of the files to begin with."""
    folder = resources.files("robostiff.robots") / "templates"
    names = (file.name for file in folder.iterdir() if file.name.endswith(".yaml"))
    return tuple(sorted(name.removesuffix(".yaml") for name in names))


def write_new(asked: WriteNew) -> int:
    """Write a model file from a template or a shipped robot; nothing is replaced."""
    name, template = asked.new_name, asked.template
    path = Path(name if Path(name).suffix.lower() in _YAML else f"{name}.yaml")
    text = _text_of(template)
    if path.exists() or path.is_symlink():
        raise InputError("NAME", got=str(path), expected="a new file", hint="take another name")
    new_file("NAME", path)
    plain = _PLAIN_NAME.fullmatch(path.stem) and path.stem.lower() not in _WORDS_OF_YAML
    line = f"name: {path.stem if plain else json.dumps(path.stem)}"
    text = re.sub(r"(?m)^name: .*$", lambda _: line, text, count=1)
    with path.open("x", encoding="utf-8") as file:
        file.write(text)
    show({"files": [str(path)], "template": template} if asked.answer.as_json else str(path))
    return 0


def _text_of(template: str) -> str:
    if template in templates():
        folder = resources.files("robostiff.robots") / "templates"
        return (folder / f"{template}.yaml").read_text(encoding="utf-8")
    shipped = (*shipped_robots(), *shipped_cable_robots())
    if template in shipped:
        return robot_file(template).read_text(encoding="utf-8")
    allowed = (*templates(), *shipped)
    expected = f"a template or a shipped robot: {listing(nearest_first(template, allowed))}"
    hint = did_you_mean(template, allowed)
    raise InputError("--template", got=template, expected=expected, hint=hint)


def convert(asked: Convert) -> int:
    """Write a robot at a pose in another form."""
    from robostiff.cli.written_arguments import chosen

    form, source, answer = asked.form, asked.model.source, asked.answer
    output = None if asked.output == "-" else asked.output
    writer = loaded(WRITERS, form) if is_offered(WRITERS, form) else None
    forms = {**_FORMS, **{name: loaded(WRITERS, name).endings for name in added(WRITERS)}}
    suffixes = chosen("--to", form, forms)
    if output is None and answer.as_json:
        raise InputError("--json", expected="a file beside it", hint="write -o FILE")
    path = None if output is None else new_file("--output", output, answer.overwrite)
    if path is not None and path.suffix.lower() not in suffixes:
        others = [f"--to {x} for {' or '.join(y)}" for x, y in forms.items() if x != form]
        raise InputError(
            "--output",
            got=str(path),
            expected=f"a name that ends in {' or '.join(suffixes)}",
            hint=f"or write {', '.join(others)}",
        )
    frozen = _frozen(source, asked.model.load(), asked.place, form)
    if writer is None:
        text = _text_of_frozen(frozen, path)
    else:
        text = writer.text(frozen, "" if path is None else path.suffix.lower())
    if path is None:
        show(text.removesuffix("\n"))
        return 0
    with whole_file(path) as begun:
        begun.write_text(text, encoding="utf-8")
    show({"files": [str(path)], "form": form} if answer.as_json else str(path))
    return 0


def _frozen(source: str, robot: Any, place: Posing, form: str) -> Any:
    """The robot at the pose: a snapshot of legs, or a network for the other forms."""
    from robostiff.cli.written_arguments import near_from, pose_from
    from robostiff.kinematics import find_posture, with_masses
    from robostiff.model import Robot, Snapshot
    from robostiff.network import Network
    from robostiff.network.network import network_of_snapshot

    pose = pose_from(robot, place)
    if isinstance(robot, Robot):
        robot.check_has_no_springs(form)
        if form in ("snapshot", "graph") and robot.drives_with_laws:
            names = ", ".join(robot.drives_with_laws)
            warn_of_slip(
                f"{form} of {robot.name!r}: the file has the stiffness of {names} at this pose, "
                "and no law: under finite loads it answers otherwise than the robot"
            )
        found = find_posture(robot, pose, near=near_from(robot, place))
        if not found.reached.all():
            raise NoAnswerError(f"no {form} of {source!r}: {'; '.join(found.complaints)}")
        robot = with_masses(found).one(0)
    if isinstance(robot, Snapshot):
        if form == "snapshot" and robot.platform is not None:
            raise InputError(
                f"snapshot of {source!r}",
                got=Words("a flexible platform"),
                expected="a rigid one",
                hint="write --to graph",
            )
        return robot if form == "snapshot" else network_of_snapshot(robot)
    if isinstance(robot, Network) and form != "snapshot":
        return robot
    raise InputError(
        f"{form} of {source!r}",
        got=Words(f"a {robot.kind}"),
        expected="a robot or a snapshot of legs",
        hint="write --to graph" if isinstance(robot, Network) else None,
    )


def _text_of_frozen(frozen: Any, path: Path | None) -> str:
    """A snapshot or a graph as YAML for a file with its ending, otherwise as JSON."""
    from robostiff.io.document.read import yaml_of
    from robostiff.io.snapshot import network_to_data, snapshot_to_data
    from robostiff.network import Network

    is_network = isinstance(frozen, Network)
    data = network_to_data(frozen) if is_network else snapshot_to_data(frozen)
    if path is not None and path.suffix.lower() in _YAML:
        return yaml_of(data)
    text = json.dumps(data, indent=1, allow_nan=False) + "\n"
    # rows of numbers and of names stand in a line each, as people write them
    return re.sub(r"\[\n *[^][{}]+?\n *\]", _in_a_line, text)


def _in_a_line(row: re.Match[str]) -> str:
    return re.sub(r"\n *", " ", row[0]).replace("[ ", "[", 1).removesuffix(" ]") + "]"
