"""What ``robostiff derive`` does, once the command line is understood."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sympy as sp
import typer

from robostiff.analytic import (
    Closed,
    Derivative,
    FormulaTooLargeError,
    RobotDerivation,
    Steps,
    derive_robot,
    differentiate,
)
from robostiff.analytic.export import (
    c_function,
    derivation_data,
    derivation_latex,
    derivation_markdown,
    derivation_page,
    derivation_pdf,
    derivation_text,
    python_function,
)
from robostiff.cli.derive_options import FORMATS
from robostiff.cli.derive_pose import pose_from
from robostiff.cli.derive_questions import Questions
from robostiff.cli.output import new_file
from robostiff.cli.written_arguments import parameters_from
from robostiff.errors import InputError
from robostiff.io.model_file import ALL_PARAMETERS
from robostiff.io.suggest import did_you_mean
from robostiff.io.whole_file import whole_file
from robostiff.model import Robot
from robostiff.robots import load

INTERRUPTED = 130

_Found = RobotDerivation | Derivative
_WRITERS: dict[str, Callable[[Any], str]] = {
    "text": derivation_text,
    "latex": derivation_latex,
    "md": derivation_markdown,
    "html": derivation_page,
    "json": lambda derivation: json.dumps(derivation_data(derivation), indent=1) + "\n",
    "python": python_function,
    "c": c_function,
}
_SUFFIXES = {
    ".txt": "text",
    ".tex": "latex",
    ".pdf": "pdf",
    ".md": "md",
    ".html": "html",
    ".json": "json",
    ".py": "python",
    ".c": "c",
}


@dataclass(frozen=True)
class Formula:
    """Which formula, as written on the command line."""

    pose: str
    symbols: str
    steps: bool
    closed: bool
    limit: int | None
    derivative: str | None


@dataclass(frozen=True)
class Sheet:
    """In which language a formula is written, and where to."""

    format: str | None
    output: str | None
    overwrite: bool = False


def print_formula(
    source: str, asked: Formula, sheet: Sheet, questions: Questions, settings: Sequence[str]
) -> int:
    """Derive the stiffness of a robot and write it, or answer questions about it."""
    language, output = _language(sheet)
    form = _form(asked)
    if questions.any and (asked.derivative is not None or language != "text"):
        raise InputError(
            "questions about a formula",
            got="--derivative" if asked.derivative is not None else f"--format {language}",
            expected="--rank, --free-motions and --eigenvalues alone, answered in text",
        )
    try:
        derivation = derive_robot(*_robot_and_pose(source, asked, settings), form)
        found: _Found = derivation
        if asked.derivative is not None:
            found = differentiate(derivation, _symbol(derivation, asked.derivative))
        if language == "pdf" and output is not None:
            with whole_file(output) as begun:
                derivation_pdf(found, begun)
            return 0
        written = questions.answered(derivation) if questions.any else _WRITERS[language](found)
    except FormulaTooLargeError as error:
        raise InputError(
            error.subject,
            got=error.got,
            expected=error.expected,
            hint="ask for named steps with --steps, fewer --symbols, or a larger --limit",
        ) from None
    except KeyboardInterrupt:
        typer.echo("robostiff: interrupted; named steps, --steps, are quick", err=True)
        return INTERRUPTED
    if output is None:
        typer.echo(written, nl=False)
    else:
        with whole_file(output) as begun:
            begun.write_text(written, encoding="utf-8")
    return 0


def _robot_and_pose(source: str, asked: Formula, settings: Sequence[str]) -> tuple[Robot, Any]:
    names = [name.strip() for name in asked.symbols.split(",") if name.strip()]
    symbols = {"all": ALL_PARAMETERS, "none": ()}.get(asked.symbols.strip(), tuple(names))
    parameters = parameters_from(settings)
    robot = load(source, parameters, symbols=symbols)
    if not isinstance(robot, Robot):
        raise InputError(
            "robot of a formula",
            got=source,
            expected="a model, whose parameters can be symbols",
            hint="a snapshot holds the numbers of one pose",
        )
    return robot, pose_from(asked.pose, robot)


def _form(asked: Formula) -> Closed | Steps | None:
    if asked.steps and (asked.closed or asked.limit is not None):
        other = "--closed" if asked.closed else "--limit"
        raise InputError(f"--steps and {other}", expected="one of them")
    if asked.steps:
        return Steps()
    if asked.limit is not None:
        return Closed(asked.limit)
    return Closed() if asked.closed else None


def _language(sheet: Sheet) -> tuple[str, Path | None]:
    """The format, and where to write; None for standard output."""
    output = None if sheet.output in (None, "-") else Path(sheet.output)
    name = sheet.format
    if name is None:
        name = "text" if output is None else _SUFFIXES.get(output.suffix)
    if name is None:
        raise InputError(
            "--output",
            got=sheet.output,
            expected=f"a name that ends in {', '.join(_SUFFIXES)}, or --format beside it",
        )
    if name not in FORMATS:
        raise InputError(
            "--format", got=name, expected=", ".join(FORMATS), hint=did_you_mean(name, FORMATS)
        )
    if name == "pdf" and output is None:
        raise InputError("--format", got="pdf", expected="a file", hint="write -o FILE.pdf")
    if output is not None:
        new_file("--output", output, sheet.overwrite)
    return name, output


def _symbol(derivation: RobotDerivation, name: str) -> sp.Symbol:
    for symbol in derivation.symbols:
        if symbol.name == name:
            return symbol
    names = [symbol.name for symbol in derivation.symbols]
    raise InputError(
        "--derivative",
        got=name,
        expected=f"a symbol of the formula: {', '.join(names) or 'it has none'}",
        hint=did_you_mean(name, names),
    )
