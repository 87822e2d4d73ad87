"""The command ``derive``, after parsing, as a long computation in a child process.

Python reacts to Ctrl-C between two of its steps, and a call into a library for polynomials is one
step that may take minutes. The child goes on as the program; its parent waits, shows progress, ends
it on Ctrl-C, and ends with its exit status.
"""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

import click
import sympy as sp

from robostiff.analytic import (
    AtCoordinates,
    AtHome,
    AtJoints,
    AtSymbols,
    CableFormula,
    Closed,
    Derivation,
    FormulaDerivative,
    FormulaTooLargeError,
    LegElimination,
    RobotDerivation,
    Steps,
    UnitQuaternion,
    differentiate,
    fixed_point_formula,
    free_motion_formulas,
    rank_formula,
)
from robostiff.analytic.budget import OutOfTimeError, checked_budget
from robostiff.analytic.export import (
    c_function,
    derivation_data,
    derivation_latex,
    derivation_markdown,
    derivation_page,
    derivation_pdf,
    derivation_text,
    julia_function,
    latex_snippet,
    matlab_function,
    python_function,
)
from robostiff.analytic.placement.robot_pose import (
    ABOUT_WORLD_AXES,
    PoseFormula,
    coordinate_names,
    rotation_by_name,
)
from robostiff.cli.arguments import choice
from robostiff.cli.command import INTERRUPTED
from robostiff.cli.output import FORMULA_FILES, new_file, write_to
from robostiff.errors import InputError, Words
from robostiff.io.model_file import ParameterChoice
from robostiff.io.suggest import did_you_mean
from robostiff.io.units import Dimension, parse_quantities
from robostiff.markup import Bullets, Page, page_text
from robostiff.model import Robot
from robostiff.robots import robot_of_formula
from robostiff.robots.derivation import derive
from robostiff.spatial import Space
from robostiff.whole_file import whole_file

_INTERVAL = 0.05
_PATIENCE = 0.4  # seconds that the child has to end by itself
_FIRST = 1.0  # seconds before anything is shown
_DEATH_OF_PARENT = 1  # PR_SET_PDEATHSIG: the child ends when its parent is killed


def go_on_in_child(progress: Callable[[float], str]) -> None:
    """Return in a child process; this one waits for it and ends with its exit status.

    `progress` gives a line about the seconds that have passed, shown on standard error where that
    is a terminal. Without processes that fork, or where standard output is none of the program's
    own, as in a test, nothing happens and the computation goes on here.
    """
    try:
        own_streams = sys.stdout.fileno() == 1 and sys.stderr.fileno() == 2
    except (OSError, ValueError, AttributeError):
        return
    if not (hasattr(os, "fork") and own_streams):
        return
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads that wait
        child = os.fork()
    if child == 0:
        if sys.platform == "linux":
            import ctypes

            with suppress(OSError, AttributeError):
                ctypes.CDLL(None).prctl(_DEATH_OF_PARENT, signal.SIGKILL)
        return
    before = signal.signal(signal.SIGTERM, lambda *_: os.kill(child, signal.SIGTERM))
    try:
        code = _exit_status(_waited_for(child, progress))
    except KeyboardInterrupt:
        code = _status_of_interrupted(child)
    finally:
        signal.signal(signal.SIGTERM, before)
    raise click.exceptions.Exit(code)


def _waited_for(child: int, progress: Callable[[float], str]) -> int:
    """The status of a child when it ends; on a terminal a line, written over itself each second."""
    started, width = time.monotonic(), 0
    due = _FIRST if sys.stderr.isatty() else math.inf
    try:
        while True:
            pid, status = os.waitpid(child, os.WNOHANG)
            if pid:
                return status
            passed = time.monotonic() - started
            if passed >= due:
                line, due = progress(passed), passed + 1.0
                width = max(width, len(line))
                click.echo(f"\r{line:{width}}", err=True, nl=False)
            # A short computation is not held up, and a long one is looked at now and then.
            time.sleep(min(_INTERVAL, 0.002 + passed / 50))
    finally:
        if width:  # an empty line for what follows
            click.echo(f"\r{'':{width}}\r", err=True, nl=False)


def _status_of_interrupted(child: int) -> int:
    """The status of an interrupted child; one that does not end by itself is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for is_told in (False, True):  # a terminal has sent the signal to the child as well
        if is_told:
            with suppress(ProcessLookupError):
                os.kill(child, signal.SIGINT)
        until = time.monotonic() + _PATIENCE
        while time.monotonic() < until:
            pid, status = os.waitpid(child, os.WNOHANG)
            if pid:
                return _exit_status(status)
            time.sleep(_INTERVAL)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    click.echo("robostiff: interrupted", err=True)
    return INTERRUPTED


def _exit_status(status: int) -> int:
    code = os.waitstatus_to_exitcode(status)
    if code >= 0:
        return code
    if -code == signal.SIGINT:
        click.echo("robostiff: interrupted", err=True)
    return 128 - code


def pose_from(text: str, robot: Robot, angles: str | None = None) -> PoseFormula:
    """Read ``home``, ``symbolic``, ``joints``, or coordinates such as ``x=100 mm, gamma=10 deg``.

    The coordinates of the rotation are those of `rotation_by_name`, where it is given.

    Raises InputError when it is none of them, or a name is no coordinate of the robot.
    """
    word = text.strip()
    rotation = ABOUT_WORLD_AXES if angles is None else rotation_by_name(angles)
    if word in ("home", "joints"):
        if angles is not None:
            got = f"{angles} beside --pose {word}"
            raise InputError("--angles", got=got, expected="--pose symbolic, or coordinates")
        return AtHome() if word == "home" else AtJoints()
    if word == "symbolic":
        return AtSymbols(rotation)
    names = coordinate_names(robot, rotation)
    values: dict[str, float] = {}
    for part in word.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not (name and equals and value):
            expected = "home, symbolic, joints, or coordinates NAME=VALUE, with commas between"
            hint = f'write --pose "{names[0]}=0.1"' if names else None
            raise InputError("--pose", got=text, expected=expected, hint=hint)
        if name not in names:
            raise InputError(
                f"--pose, coordinate of {robot.name!r}", got=name, expected=", ".join(names)
            )
        if name in values:
            raise InputError("--pose", got=text, expected=f"one value for {name}")
        dimension = Dimension.LENGTH if name in ("x", "y", "z") else Dimension.ANGLE
        if name in UnitQuaternion().names:
            dimension = Dimension.NUMBER
        elif robot.is_posed_by_joints:
            turns = robot.legs[0].chain.freedoms[int(name[1:]) - 1].turns
            dimension = Dimension.ANGLE if turns else Dimension.LENGTH
        (values[name],) = parse_quantities(value, [dimension], [name], f"--pose {name}")
    return AtCoordinates(values, rotation)


def _properties(command: Any, derivation: RobotDerivation) -> Page:
    """Rank and free motions, as far as they are asked for."""
    lines = []
    if command.rank:
        result = rank_formula(derivation, command.budget)
        line, zeros = f"rank {result.rank} of {derivation.K.rows}", []
        for factor in result.exceptions:
            written, names = sp.sstr(factor), ", ".join(sorted(map(str, factor.free_symbols)))
            is_long = len(written) > _LONGEST_FACTOR
            zeros.append(f"a sum of {len(factor.args)} terms in {names}" if is_long else written)
        line += f"; lower where one of these is zero: {', '.join(zeros)}" if zeros else ""
        lines.append(line + (f"; {result.remark}" if result.remark else ""))
    if command.free_motions:
        motions = free_motion_formulas(derivation)
        names = ", ".join(Space.of_size(derivation.K.rows).twist_order)
        twists = (", ".join(map(sp.sstr, twist.flat())) for twist in motions)
        lines += [f"free motion ({names}) = ({text})" for text in twists] or ["no free motion"]
        point = fixed_point_formula(derivation) if motions else None
        if point is not None:
            at = ", ".join(map(sp.sstr, point.flat()))
            lines.append(f"all of them leave one point at rest, from the reference point: ({at})")
    return Page(derivation.name, f", {derivation.where}", blocks=[Bullets(tuple(lines))])


_LONGEST_FACTOR = 1000  # letters
_Formula = Derivation | CableFormula | FormulaDerivative
_WRITERS: dict[str, Callable[[Any], str]] = {
    "text": derivation_text,
    "latex": derivation_latex,
    "md": derivation_markdown,
    "html": derivation_page,
    "json": lambda derivation: json.dumps(derivation_data(derivation), indent=1) + "\n",
    "python": python_function,
    "c": c_function,
    "julia": julia_function,
    "matlab": matlab_function,
}
# What the library advises in Python, as options of this command or another.
_AS_OPTIONS = {
    "write derive(robot), which": "leave out --leg: the formula of the whole robot",
    "form=Steps()": "--steps",
    "form=Closed()": "--closed",
    "pose=AtJoints()": "--pose joints",
    "at pose=AtSymbols()": "with --pose symbolic",
    "pose=AtSymbols()": "--pose symbolic",
    "AtSymbols()": "--pose symbolic",
    "rs.stiffness(robot, pose)": "robostiff stiffness",
}


def print_formula(command: Any) -> int:
    """Derive the stiffness of a robot and write it, or print its properties: `cli.files.Derive`."""
    language, output = _language(command)
    form = _form(command, language)
    if command.snippet and (command.asks or language not in ("text", "latex")):
        got = "a question" if command.asks else f"--format {language}"
        raise InputError("--snippet", got=got, expected="the formula alone, in LaTeX")
    steps = form is None and command.pose.strip() == "home"
    then = f"; named steps after {command.budget:g} s" if steps else ""
    head = f"robostiff: deriving {command.model.source} for"
    go_on_in_child(lambda passed: f"{head} {passed:.0f} s{then}; Ctrl-C ends it")
    try:
        derivation = _formula_of(command, form)
        if isinstance(derivation, RobotDerivation) and derivation.remark:
            click.echo(f"robostiff: {derivation.remark} K is in named steps.", err=True)
        formula: _Formula = derivation
        if command.derivative is not None:
            name, known = command.derivative, {symbol.name: symbol for symbol in derivation.symbols}
            if name not in known:
                expected = f"a symbol of the formula: {', '.join(known) or 'it has none'}"
                hint = did_you_mean(name, known)
                raise InputError("--derivative", got=name, expected=expected, hint=hint)
            formula = differentiate(cast("Derivation", formula), known[name])
        if language == "pdf" and output is not None:
            with whole_file(output) as draft:
                derivation_pdf(cast("Any", formula), draft)
            return 0
        written = (
            page_text(_properties(command, derivation)) + "\n"
            if command.asks and isinstance(derivation, RobotDerivation)
            else latex_snippet(formula)
            if command.snippet
            else _WRITERS[language](formula)
        )
    except FormulaTooLargeError as error:
        raise InputError(
            error.subject,
            got=error.got,
            expected=error.expected,
            hint="write --steps for named steps, fewer --symbols, or a larger "
            + ("--budget" if isinstance(error, OutOfTimeError) else "--limit"),
        ) from None
    except InputError as error:
        hint = error.hint or ""
        for words, option in _AS_OPTIONS.items():
            hint = hint.replace(words, option)
        if hint == (error.hint or ""):
            raise
        raise InputError(error.subject, got=error.got, expected=error.expected, hint=hint) from None
    except KeyboardInterrupt:
        hint = "" if command.steps else "; named steps, --steps, are quick"
        click.echo(f"robostiff: interrupted{hint}", err=True)
        return INTERRUPTED
    if output is None:
        click.echo(written, nl=False)
    else:
        write_to(output, written)
    return 0


def _form(command: Any, language: str) -> Closed | Steps | None:
    """The form that is asked for, of options that go together."""
    if command.steps and (command.closed or command.limit is not None):
        option = "--closed" if command.closed else "--limit"
        raise InputError(f"--steps and {option}", expected="one of them")
    checked_budget(command.budget)
    wrong = "--derivative" if command.derivative is not None else f"--format {language}"
    if command.asks and (command.derivative is not None or language != "text"):
        expected = "--rank and --free-motions alone, answered in text"
        raise InputError("questions about a formula", got=wrong, expected=expected)
    if command.asks and command.leg is not None:
        expected = "the whole robot: --rank and --free-motions without --leg"
        raise InputError(
            "questions about a formula", got=Words(f"--leg {command.leg}"), expected=expected
        )
    if command.limit is not None:
        return Closed(command.limit)
    return Steps() if command.steps else Closed() if command.closed else None


def _formula_of(
    command: Any, form: Closed | Steps | None
) -> RobotDerivation | LegElimination | CableFormula:
    """The formula of the robot, or of one of its legs."""
    names = [name.strip() for name in command.symbols.split(",") if name.strip()]
    shorter = dict(name.split("=", 1) for name in names if "=" in name)
    if shorter and {*names} - {"all"} != {f"{x}={short}" for x, short in shorter.items()}:
        hint = "write --symbols all,cylinder=c: others keep their names"
        raise InputError("--symbols", got=command.symbols, expected="all, or names", hint=hint)
    choices = {"all": ParameterChoice.ALL, "none": ParameterChoice.NONE}
    model = command.model
    whole = model.load(symbols=shorter or choices.get(command.symbols.strip(), tuple(names)))
    robot: Any = robot_of_formula(whole, model.source)
    pose = pose_from(command.pose, robot, command.angles)
    found = derive(robot, pose=pose, form=form, budget=command.budget, leg=command.leg)
    if command.asks and isinstance(found, CableFormula):
        raise InputError(
            "questions about a formula",
            got=Words("a cable robot"),
            expected="a robot of legs: the rank of cables depends on which are taut",
            hint="robostiff stiffness prints rank and free motions at a pose",
        )
    return found


def _language(command: Any) -> tuple[str, Path | None]:
    """The format, and the file to write; None for standard output."""
    output = None if command.output in (None, "-") else Path(command.output)
    name = command.format
    if command.answer.as_json:
        if name not in (None, "json"):
            raise InputError("--json and --format", got=name, expected="one of them")
        if output is not None and FORMULA_FILES.get(output.suffix, "json") != "json":
            expected = "a name that ends in .json"
            raise InputError("--output beside --json", got=command.output, expected=expected)
        name = "json"
    if name is None:
        name = "text" if output is None else FORMULA_FILES.get(output.suffix)
    if name is None:
        expected = f"a name that ends in {', '.join(FORMULA_FILES)}, or --format beside it"
        raise InputError("--output", got=command.output, expected=expected)
    choice("--format", name, dict.fromkeys(FORMULA_FILES.values()))
    if name == "pdf" and output is None:
        raise InputError("--format", got=Words("pdf"), expected="a file", hint="write -o FILE.pdf")
    if output is not None:
        new_file("--output", output, command.answer.overwrite)
    return name, output
