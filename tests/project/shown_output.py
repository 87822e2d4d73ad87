"""Output that the documents show: found, produced anew, compared, and on demand written again.

Three kinds of fenced blocks are looked at:

* ``console``: lines that begin with ``$ robostiff`` or ``$ python`` and what they print;
* ``python`` followed at once by ``text``: a script and what it prints;
* ``pycon``: doctests (see test_documents_in_step.py).

    python -m tests.project.shown_output        writes all shown output again
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from runpy import run_path
from unittest.mock import patch

import numpy as np
from click.testing import CliRunner

from robostiff.cli.main import app

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = (
    *sorted(ROOT.glob("*.md")),
    *sorted(p for p in (ROOT / "docs").rglob("*.md") if "_build" not in p.parts),
)

_CONSOLE = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_SCRIPT = re.compile(
    r"^```python\n(?P<script>(?:(?!^```).)*?)^```\n+```text\n(?P<output>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
_PLAIN = {"COLUMNS": "100", "NO_COLOR": "1"}
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class Shown:
    """Something to run, and the output that a document shows for it.

    `place` is where the output stands in the document's text.
    """

    document: Path
    command: tuple[str, ...]
    title: str
    output: str
    place: slice

    def __str__(self) -> str:
        return f"{self.document.name}: {self.title}"


def shown_outputs(document: Path) -> Iterator[Shown]:
    """Every command and script of a document whose output it shows."""
    text = document.read_text(encoding="utf-8")
    for block in _CONSOLE.finditer(text):
        start = block.start(1)
        for part in re.split(r"(?m)^(?=\$ )", block[1]):
            line, _, output = part.partition("\n")
            words = tuple(shlex.split(line.removeprefix("$ "))) if line.startswith("$ ") else ()
            begin = start + len(line) + 1
            start += len(part)
            if words and words[0] in {"robostiff", "python"}:
                yield Shown(document, words, line, output, slice(begin, start))
    for block in _SCRIPT.finditer(text):
        command = ("python", "-c", block["script"])
        place = slice(block.start("output"), block.end("output"))
        yield Shown(document, command, block["script"].splitlines()[0], block["output"], place)


def produced_output(shown: Shown) -> str:
    """What it prints now, to standard output and standard error."""
    program, *arguments = shown.command
    # Documents have dozens of commands, and each process would import all again.
    if program == "python":
        printed = _of_script(arguments)
    elif "--help" not in arguments:
        with chdir(ROOT):
            printed = CliRunner().invoke(app, arguments, prog_name=program, env=_PLAIN).output
    else:
        printed = subprocess.run(
            [str(Path(sys.executable).with_name(program)), *arguments],
            cwd=ROOT,
            env={**os.environ, **_PLAIN},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        ).stdout
    return "".join(f"{line.rstrip()}\n" for line in printed.splitlines())


def _of_script(arguments: list[str]) -> str:
    """What `python -c SCRIPT` or `python FILE` prints, run in this process as if it were new."""
    printed, before = StringIO(), sys.argv
    with (
        chdir(ROOT),
        patch.dict(os.environ, _PLAIN),
        redirect_stdout(printed),
        redirect_stderr(printed),
        np.printoptions(),
    ):
        try:
            if arguments[0] == "-c":
                sys.argv = ["-c", *arguments[2:]]
                exec(arguments[1], {"__name__": "__main__"})  # noqa: S102
            else:
                sys.argv = list(arguments)
                run_path(arguments[0], run_name="__main__")
        finally:
            sys.argv = before
    return printed.getvalue()


def first_difference(shown: str, produced: str) -> str | None:
    """The first line that differs by more than the last digits of its numbers; None without one.

    The order of lines is free: rounding decides which of two equal parts is listed first.
    """
    old, new = (sorted(text.splitlines(), key=_masked) for text in (shown, produced))
    for i in range(max(len(old), len(new))):
        a = old[i] if i < len(old) else "(nothing)"
        b = new[i] if i < len(new) else "(nothing)"
        if not _alike(a, b):
            return f"shown:    {a}\nproduced: {b}"
    return None


def _alike(a: str, b: str) -> bool:
    if _masked(a) != _masked(b):
        return False
    pairs = zip(_NUMBER.findall(a), _NUMBER.findall(b), strict=True)
    return all(_close(float(x), float(y)) for x, y in pairs)


def _masked(line: str) -> str:
    return " ".join(_NUMBER.sub("#", line).split())


def _close(a: float, b: float) -> bool:
    # Zero may be printed as 1e-17 on another machine.
    return abs(a - b) <= max(2e-3 * abs(b), 1e-6)


def write_again() -> None:
    """Replace all shown output by what is produced now."""
    for document in DOCUMENTS:
        text = document.read_text(encoding="utf-8")
        for shown in sorted(shown_outputs(document), key=lambda s: -s.place.start):
            text = text[: shown.place.start] + produced_output(shown) + text[shown.place.stop :]
        document.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_again()
