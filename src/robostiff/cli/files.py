"""Commands that write formulas, model files and other formats."""

from __future__ import annotations

import json
import re
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

import click

from robostiff.cli.command import print_answer
from robostiff.cli.options import (
    Answer,
    Command,
    Model,
    Posing,
    argument,
    group,
    option,
    output_option,
)
from robostiff.cli.output import FORMULA_FILES, new_file, output_beside, show, show_files, write_to
from robostiff.errors import InputError, NoAnswerError, Words, warn_of_slip

_OUTPUT = "The file to write; standard output when left out."
_YAML = (".yaml", ".yml")
_KERNELS = {"c": (".c",), "cuda": (".cu",)}
_FORMS = dict.fromkeys(("snapshot", "graph"), (".json", *_YAML)) | _KERNELS
_TEMPLATES = resources.files("robostiff.robots") / "templates"
_PLAIN_NAME = re.compile(r"[A-Za-z][A-Za-z0-9 ._-]*[A-Za-z0-9]")
_WORDS_OF_YAML = {"true", "false", "null", "yes", "no", "on", "off"}


class ListRobots(Command, name="robots"):
    """List the shipped robots; with --json their sources, too."""

    answer: Answer = group(Answer, "as_json")

    def run(self) -> int:
        """Print the shipped robots."""
        from robostiff.page.of_result import robots_page
        from robostiff.robots import describe, shipped_names

        return print_answer(robots_page(list(map(describe, sorted(shipped_names())))), self.answer)


class Derive(Command, name="derive"):
    """Write the stiffness matrix of a robot as a formula.

    It is text, LaTeX, PDF, Markdown, HTML, JSON, Python, C, Julia or MATLAB.

    $ derive gough-stewart-b
    $ derive gough-stewart-a --rank --free-motions
    $ derive 3-rpr --pose symbolic --steps -o stiffness.pdf
    $ derive hexapod --pose symbolic --angles ZXZ
    $ derive hexapod --symbols R,r --pose "z=0.85, gamma=10 deg" -o hexapod.py
    $ derive gough-stewart-b-beams --leg leg1
    $ derive delta --snippet

    Exit status: 0 for a formula, 2 for bad input or a formula beyond the limit, 130 when
    interrupted.
    """

    model: Model = group(Model, "source", "settings")
    pose: str = option(
        "--pose",
        metavar="POSE",
        default="home",
        help="home; symbolic, a general pose in symbols; joints, the joint coordinates of the legs "
        "in symbols; or coordinates with units, such as "
        "'x=100 mm, gamma=10 deg' (q1, q2 ... of a serial arm). Others stay at home.",
    )
    angles: str | None = option(
        "--angles",
        metavar="NAME",
        help="Coordinates of the rotation of --pose: rpy, quaternion, or Euler angles such as ZXZ "
        "(axes that move along) or xyz (axes that stay).",
    )
    symbols: str = option(
        "--symbols",
        metavar="NAMES",
        default="all",
        help="Parameters that are symbols, such as R,r,h; all; or none. The others are numbers. "
        "all,cylinder=c gives a symbol a shorter name.",
    )
    leg: str | None = option(
        "--leg",
        metavar="NAME",
        help="One leg alone: its stiffness without passive joints, then joint by joint.",
    )
    steps: bool = option(
        "--steps",
        help="Named steps of moderate size, entry by entry; away from home the default where "
        "the legs have no form in vectors.",
    )
    closed: bool = option("--closed", help="One expression for each entry; the default at home.")
    limit: int | None = option(
        "--limit",
        metavar="TERMS",
        type=click.IntRange(min=1),
        help="Most terms of an entry of a closed form, at least 1.",
    )
    budget: float = option(
        "--budget",
        metavar="SECONDS",
        type=float,
        default=20.0,
        help="Computing time of a closed form; named steps are the answer when it ends.",
    )
    derivative: str | None = option(
        "--derivative", metavar="SYMBOL", help="dK by a symbol in place of K."
    )
    rank: bool = option("--rank", help="Print the rank of K and where it drops, in place of K.")
    free_motions: bool = option("--free-motions", help="Print the free motions, in place of K.")
    format: str | None = option(
        "--format",
        metavar="NAME",
        help=", ".join(FORMULA_FILES.values())
        + "; that of the file's name, or text, when left out.",
    )
    output: str | None = output_option(_OUTPUT, None)
    snippet: bool = option(
        "--snippet", help="LaTeX of the matrix, or of one leg, with nothing around it: for a paper."
    )
    answer: Answer = group(Answer)

    def run(self) -> int:
        """Derive the stiffness of a robot and write it, or print its properties."""
        from robostiff.cli.commands_derive import print_formula

        return print_formula(self)

    @property
    def asks(self) -> bool:
        """Whether properties of the formula are printed in place of it."""
        return self.rank or self.free_motions


class PrintSchema(Command, name="schema"):
    """Print the JSON schema of a file format, by which editors complete and explain keys.

    $ schema model -o robostiff.schema.json

    Exit status: 0 for a schema, 2 for bad input.
    """

    form: str = argument("[model|snapshot|graph]", "The file format.", "model")
    output: str | None = output_option(_OUTPUT, None)
    answer: Answer = group(Answer)

    def run(self) -> int:
        """Print or write the JSON schema of a file format."""
        from robostiff.cli.arguments import choice
        from robostiff.io.model_file.schema import model_file_schema
        from robostiff.io.snapshot import network_schema, snapshot_schema

        form, answer = self.form, self.answer
        schemas = {"model": model_file_schema, "snapshot": snapshot_schema, "graph": network_schema}
        schema = choice("schema", form, schemas)()
        text = json.dumps(schema, indent=2)
        path = output_beside(self.output, answer)
        if path is None:
            show({"form": form, "json_schema": schema} if answer.as_json else text)
            return 0
        write_to(path, text + "\n")
        return show_files([path], answer, form=form)


class WriteNew(Command, name="new"):
    """Write a model file to begin with, which can be used as it is. Nothing is replaced.

    $ new my-arm --template arm
    $ new my-delta --template delta

    Exit status: 0 for a new file, 2 for bad input.
    """

    new_name: str = argument("NAME", "Of the robot, and of NAME.yaml.")
    template: str = option(
        "--template",
        metavar="NAME",
        default="parallel",
        help="arm (by a table of Denavit and Hartenberg), beams (an arm element by element), "
        "parallel, planar, cables, or a shipped robot to copy.",
    )
    answer: Answer = group(Answer, "as_json")

    def run(self) -> int:
        """Write a model file from a template or a shipped robot; nothing is replaced."""
        from robostiff.io.suggest import did_you_mean, listing, nearest_first
        from robostiff.robots import robot_file, shipped_cable_robots, shipped_robots

        name = self.new_name
        path = Path(name if Path(name).suffix.lower() in _YAML else f"{name}.yaml")
        if not path.name.removesuffix(".yaml").strip(". "):
            raise InputError("NAME", got=name, expected="a name, such as my-machine")
        shipped = (*shipped_robots(), *shipped_cable_robots())
        if self.template in templates():
            text = (_TEMPLATES / f"{self.template}.yaml").read_text(encoding="utf-8")
        elif self.template in shipped:
            text = robot_file(self.template).read_text(encoding="utf-8")
        else:
            allowed = (*templates(), *shipped)
            words = listing(nearest_first(self.template, allowed))
            expected = f"a template or a shipped robot: {words}"
            hint = did_you_mean(self.template, allowed)
            raise InputError("--template", got=self.template, expected=expected, hint=hint)
        if path.exists() or path.is_symlink():
            hint = "take another name"
            raise InputError("NAME", got=str(path), expected="a new file", hint=hint)
        new_file("NAME", path)
        plain = _PLAIN_NAME.fullmatch(path.stem) and path.stem.lower() not in _WORDS_OF_YAML
        line = f"name: {path.stem if plain else json.dumps(path.stem)}"
        text = re.sub(r"(?m)^name: .*$", lambda _: line, text, count=1)
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
        if path.stem in shipped:
            warn_of_slip(f"{path.stem} alone is the shipped robot: write {path} for this file")
        return show_files([path], self.answer, template=self.template)


def templates() -> tuple[str, ...]:
    """Names of the files to begin with."""
    names = (file.name for file in _TEMPLATES.iterdir() if file.name.endswith(".yaml"))
    return tuple(sorted(name.removesuffix(".yaml") for name in names))


class Convert(Command, name="convert"):
    """Write a robot at a pose as a file, or its stiffness at any pose as a program.

    $ convert hexapod --pose "0 0 0.85 0 0 0" --to graph -o hexapod.json
    $ convert hexapod --pose "0 0 0.85 0 0 0" --to opensees -o hexapod.tcl
    $ convert hexapod --to c -o hexapod.c

    Exit status: 0 for a file, 1 when the pose is out of reach, 2 for bad input.
    """

    model: Model = group(Model)
    form: str = option(
        "--to",
        metavar="snapshot|graph|opensees|calculix|c|cuda",
        default="snapshot",
        help="By legs, or as bodies and joints (.json or .yaml); a model of OpenSees (.tcl or .py) "
        "or CalculiX (.inp); or the kernel of its stiffness at any pose in C99 (.c) or CUDA (.cu).",
    )
    output: str | None = output_option(_OUTPUT, None)
    place: Posing = group(Posing, "pose", "joints", "near")
    answer: Answer = group(Answer)

    def run(self) -> int:
        """Write a robot at a pose in another form."""
        from robostiff.cli import arguments as written
        from robostiff.extras import WRITERS, entry_points_of, is_offered, load_extra

        form, answer = self.form, self.answer
        output = None if self.output == "-" else self.output
        writer = load_extra(WRITERS, form) if is_offered(WRITERS, form) else None
        forms = {
            **_FORMS,
            **{name: load_extra(WRITERS, name).endings for name in entry_points_of(WRITERS)},
        }
        suffixes = written.choice("--to", form, forms)
        if output is None and answer.as_json:
            raise InputError("--json", expected="a file beside it", hint="write -o FILE")
        path = output_beside(output, answer)
        if path is not None and path.suffix.lower() not in suffixes:
            others = [f"--to {x} for {' or '.join(y)}" for x, y in forms.items() if x != form]
            expected = f"a name that ends in {' or '.join(suffixes)}"
            hint = f"or write {', '.join(others)}"
            raise InputError("--output", got=str(path), expected=expected, hint=hint)
        ending = "" if path is None else path.suffix.lower()
        robot = written.load_machine(self.model, None if form in _KERNELS else self.place)
        frozen = partial(_frozen, self.model.source, robot, self.place, form)
        if form in _KERNELS:
            from robostiff.analysis.compiled_stiffness import compile_stiffness
            from robostiff.compiled import Backend, SourceLanguage

            if any(vars(self.place)[key] is not None for key in ("pose", "joints", "near")):
                raise InputError("--pose, --joints, --near", expected=f"none beside --to {form}")
            text = compile_stiffness(robot, backend=Backend.ARRAYS).source(SourceLanguage(form))
        elif writer is not None:
            text = writer.text(frozen(), ending)
        else:
            from robostiff.io.document.read import yaml_of
            from robostiff.io.snapshot import network_to_data, snapshot_to_data

            data = (snapshot_to_data if form == "snapshot" else network_to_data)(frozen())
            # rows of numbers and of names stand in a line each, as people write them
            text = json.dumps(data, indent=1, allow_nan=False) + "\n"
            text = re.sub(
                r"\[\n *([^][{}]+?)\n *\]",
                lambda row: "[" + re.sub(r"\n *", " ", row[1]) + "]",
                text,
            )
            text = yaml_of(data) if ending in _YAML else text
        if path is None:
            show(text.removesuffix("\n"))
            return 0
        write_to(path, text)
        return show_files([path], answer, form=form)


def _frozen(source: str, robot: Any, place: Posing, form: str) -> Any:
    """The robot at the pose: a snapshot of legs, or a network for the other forms."""
    from robostiff.cli import arguments as written
    from robostiff.kinematics import find_posture, with_masses
    from robostiff.linkage import network_at
    from robostiff.network import network_of_snapshot

    pose, near = written.pose(robot, place), written.near(robot, place)
    robot = network_at(robot, pose) if robot.kind == "linkage" else robot
    subject = f"{form} of {source!r}"
    if not robot.is_frozen:
        written.check_kind(robot, {"robot"}, subject, expected="a robot or a snapshot of legs")
        robot.check_has_no_springs(form)
        if form in ("snapshot", "graph") and robot.drives_with_laws:
            names = ", ".join(robot.drives_with_laws)
            warn_of_slip(
                f"{form} of {robot.name!r}: the file has the stiffness of {names} at this pose, "
                "and no law: under finite loads it answers otherwise than the robot"
            )
        posture = find_posture(robot, pose, near=near)
        if not posture.reached.all():
            raise NoAnswerError(f"no {form} of {source!r}: {'; '.join(posture.complaints)}")
        robot = with_masses(posture).one(0)
    if form != "snapshot":
        return network_of_snapshot(robot) if hasattr(robot, "legs") else robot
    expected, hint = "a robot or a snapshot of legs", "write --to graph"
    written.check_kind(robot, {"snapshot"}, subject, expected=expected, hint=hint)
    if robot.platform is not None:
        got = Words("a flexible platform")
        raise InputError(subject, got=got, expected="a rigid one", hint=hint)
    return robot
