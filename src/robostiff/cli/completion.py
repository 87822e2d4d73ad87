"""Completion of commands, options and robots in the shell."""

from __future__ import annotations

import os
from pathlib import Path

import click
from click.shell_completion import get_completion_class

from robostiff.cli.command import BAD_INPUT
from robostiff.cli.output import show

_VARIABLE = "_ROBOSTIFF_COMPLETE"
_FILES = {
    "bash": "~/.bashrc",
    "zsh": "~/.zshrc",
    "fish": "~/.config/fish/completions/robostiff.fish",
}
_LINES = {
    "bash": f'eval "$({_VARIABLE}=bash_source robostiff)"',
    "zsh": f'eval "$({_VARIABLE}=zsh_source robostiff)"',
    "fish": f"{_VARIABLE}=fish_source robostiff | source",
}


def show_completion() -> int:
    """Print the script of the shell."""
    from robostiff.cli.main import app

    shell = _shell()
    kind = None if shell is None else get_completion_class(shell)
    if kind is None:
        return _unknown()
    show(kind(app, {}, "robostiff", _VARIABLE).source())
    return 0


def install_completion() -> int:
    """Add one line to the file that the shell reads when it starts, unless it is there."""
    shell = _shell()
    if shell is None:
        return _unknown()
    file, line = Path(_FILES[shell]).expanduser(), _LINES[shell]
    text = file.read_text(encoding="utf-8") if file.exists() else ""
    if line not in text.splitlines():
        file.parent.mkdir(parents=True, exist_ok=True)
        gap = "" if not text or text.endswith("\n") else "\n"
        file.write_text(f"{text}{gap}{line}\n", encoding="utf-8")
    show(f"{line}\nis in {file}; a new shell completes robostiff.")
    return 0


def _shell() -> str | None:
    name = Path(os.environ.get("SHELL", "")).name
    return name if name in _FILES else None


def _unknown() -> int:
    got = os.environ.get("SHELL", "")
    click.echo(
        f"robostiff: error: $SHELL: got {got!r}, expected bash, zsh or fish; "
        "write SHELL=bash before the command",
        err=True,
    )
    return BAD_INPUT
