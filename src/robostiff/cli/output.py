"""Output of commands: text for people, JSON for programs, new files and pictures."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from robostiff.errors import InputError, printable

if TYPE_CHECKING:
    from robostiff.cli.options import Answer
    from robostiff.plot.picture import Picture

JSON_VERSION = 1
"""Of what ``--json`` prints: a key that changes its meaning or is gone makes another version."""

#: Formats of formulas, by the endings of their files.
FORMULA_FILES: dict[str, str] = {
    **{".txt": "text", ".tex": "latex", ".pdf": "pdf", ".md": "md", ".html": "html"},
    **{".json": "json", ".py": "python", ".c": "c", ".jl": "julia", ".m": "matlab"},
}

running: ContextVar[str] = ContextVar("running")
"""The command that is running."""


# How lines of an answer begin, and what a terminal makes of them.
_STYLES: dict[str, dict[str, Any]] = {
    "status: ok\n": {"fg": "green"},
    "status:": {"bold": True},
    "advice:": {"fg": "yellow"},
    "method:": {"dim": True},
    "decided by:": {"dim": True},
}


def show(answer: str | Mapping[str, Any]) -> None:
    """Print lines of text, in colours on a terminal, or plain data as one JSON object in ASCII.

    The object has the name and version of its form. In text control characters are escaped, and
    what the encoding of the terminal does not have.
    """
    if isinstance(answer, str):
        encoding, lines = getattr(sys.stdout, "encoding", None) or "utf-8", []
        safe = printable(answer, kept="\n")
        if (shown := safe.encode(encoding, "backslashreplace").decode(encoding)) != safe:
            safe = shown.replace("\\xb5", "u")  # micro
        for line in safe.split("\n"):
            styles = (look for start, look in _STYLES.items() if f"{line}\n".startswith(start))
            style = next(styles, None)
            lines.append(line if style is None else click.style(line, **style))
        click.echo("\n".join(lines))
        return
    form = {"schema": f"robostiff {running.get()} {JSON_VERSION}"}
    click.echo(json.dumps({**form, **answer}, indent=1, allow_nan=False))


def new_file(option: str, path: str | Path, overwrite: bool = False) -> Path:
    """A file to be written: one that is not there yet, unless it may be replaced.

    Raises InputError when it is there, is a folder, lies in no folder or one that cannot be
    written, or is a file that the command reads; before anything is computed.
    """
    wanted = Path(path)
    try:
        is_there, is_file = wanted.exists() or wanted.is_symlink(), wanted.is_file()
        in_folder = (folder := wanted.absolute().parent).is_dir()
    except (OSError, ValueError) as error:  # a name too long, or with a zero in it
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(option, got=str(path), expected=f"the name of a file ({reason})") from None
    if not in_folder:
        raise InputError(option, got=str(path), expected="a file in an existing folder")
    if not os.access(folder, os.W_OK):
        raise InputError(option, got=str(path), expected="a file in a folder that can be written")
    if is_there and not (is_file and overwrite):
        hint = "take another name, or write --overwrite to replace it"
        if not is_file:
            hint = "this is no regular file and is not replaced: take another name"
        raise InputError(option, got=str(path), expected="a new file", hint=hint)
    context = click.get_current_context(silent=True)
    named = [] if context is None else context.params.values()
    files = [text for text in named if isinstance(text, str) and text and Path(text).is_file()]
    if is_there and sum(wanted.samefile(file) for file in files) > 1:
        raise InputError(option, got=str(path), expected="another file than those that are read")
    return wanted


def output_beside(path: str | None, answer: Answer) -> Path | None:
    """The file of ``--output``, if one is named; see `new_file`."""
    return None if path is None else new_file("--output", path, answer.overwrite)


def write_to(path: Path, text: str) -> None:
    """Write a text, whole or not at all."""
    from robostiff.whole_file import whole_file

    with whole_file(path) as draft:
        draft.write_text(text, encoding="utf-8")


def show_files(files: Sequence[Path], answer: Answer, **facts: str) -> int:
    """Print the names of files that were written; 0."""
    names = list(map(str, files))
    show({"files": names, **facts} if answer.as_json else "\n".join(names))
    return 0


ON_PAPER = (".png", ".svg", ".pdf")


def picture_beside(
    name: str | None, answer: Answer, *, is_scene: bool = True, option: str = "--plot"
) -> Path | None:
    """A picture that is wanted, checked before anything is computed; a scene may be a page.

    Raises InputError as `new_file`, and for another ending.
    """
    if name is None:
        return None
    path = new_file(option, name, answer.overwrite)
    endings = (*ON_PAPER, ".html") if is_scene else ON_PAPER
    if path.suffix.lower() not in endings:
        expected = f"a name that ends in {', '.join(endings)}"
        hint = "only robots are drawn on pages, to be turned" if path.suffix == ".html" else None
        raise InputError(option, got=name, expected=expected, hint=hint)
    return path


def draw(picture: Picture, path: Path, other: Picture | None = None) -> None:
    """Into a file; on a page, moving to another picture and back."""
    from robostiff import plot
    from robostiff.whole_file import whole_file

    with whole_file(path) as draft:
        if path.suffix.lower() != ".html":
            figure: Any = plot.Matplotlib().draw(picture).figure
            figure.savefig(draft, format=path.suffix.lower()[1:], dpi=200, bbox_inches="tight")
        else:
            from robostiff.plot.backend import swinging_page

            pages = [plot.Plotly().draw(end) for end in (picture, other) if end is not None]
            draft.write_text(
                pages[0].to_html() if other is None else swinging_page(*pages), "utf-8"
            )
