"""Commands of ``robostiff`` and of other distributions, each imported when it is used."""

from __future__ import annotations

import gc
import os
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from robostiff.cli.command import as_click, ready_streams, status_of
from robostiff.cli.options import Command
from robostiff.cli.output import show
from robostiff.errors import InputError
from robostiff.extras import COMMANDS, entry_points_of, is_offered, load_extra
from robostiff.version import __version__

_HOMES = {
    "robots": "files",
    **dict.fromkeys(("check", "stiffness", "deflection", "equilibrium", "modes"), "answers"),
    **dict.fromkeys(("response", "indices", "verify", "cables"), "answers"),
    **dict.fromkeys(("plot", "report", "map"), "pictures"),
    "derive": "files",
    **dict.fromkeys(("compensate", "identify", "plan"), "measurements"),
    **dict.fromkeys(("schema", "new", "convert"), "files"),
}


class _CommandsByName(click.Group):
    """All commands; the module of one is imported when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names, in the order of help; those of other distributions last."""
        return [*_HOMES, *entry_points_of(COMMANDS)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """A command by its name."""
        if cmd_name in _HOMES:
            import_module(f"robostiff.cli.{_HOMES[cmd_name]}")
            return as_click(cmd_name, Command.named[cmd_name])
        return (
            as_click(cmd_name, load_extra(COMMANDS, cmd_name))
            if cmd_name in entry_points_of(COMMANDS)
            else None
        )

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """The command that is meant; of an unknown one, its nearest name."""
        if not args[0].startswith("-") and self.get_command(ctx, args[0]) is None:
            if is_offered(COMMANDS, args[0]):
                ctx.exit(status_of(lambda: int(load_extra(COMMANDS, args[0]) is None)))
            from robostiff.io.suggest import did_you_mean

            hint = did_you_mean(args[0], self.list_commands(ctx))
            ctx.fail(f"no command {args[0]!r}; {hint or 'robostiff -h lists them'}")
        return super().resolve_command(ctx, args)


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


def _complete(install: bool) -> int:
    """Print the script that completes commands, or have the shell read it."""
    program = os.environ.get("SHELL", "")
    shell = Path(program).name
    if shell not in _FILES:
        hint = "write SHELL=bash before the command"
        raise InputError("$SHELL", got=program, expected="bash, zsh or fish", hint=hint)
    if not install:
        from click.shell_completion import get_completion_class

        kind: Any = get_completion_class(shell)
        show(kind(app, {}, "robostiff", _VARIABLE).source())
        return 0
    # one line in the file that the shell reads when it starts, unless it is there
    file, line = Path(_FILES[shell]).expanduser(), _LINES[shell]
    text = file.read_bytes() if file.exists() else b""
    if line.encode() not in text.splitlines():
        file.parent.mkdir(parents=True, exist_ok=True)
        gap = "" if not text or text.endswith(b"\n") else "\n"
        with file.open("ab") as end:  # what is there stays, whatever its encoding
            end.write(f"{gap}{line}\n".encode())
    show(f"{line}\nis in {file}; a new shell completes robostiff.")
    return 0


def _answer_shell(ctx: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    if wanted:
        ctx.exit(status_of(lambda: _complete(parameter.name == "install_completion")))


app: click.Group = _CommandsByName(
    "robostiff",
    help="Cartesian stiffness of robots with elastic links, elastic actuators and passive joints.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    params=[
        click.Option(
            [f"--{word}-completion"],
            is_flag=True,
            is_eager=True,
            expose_value=False,
            callback=_answer_shell,
            help=f"{words} shell, by $SHELL: bash, zsh or fish.",
        )
        for word, words in (
            ("install", "Install the completion of commands, options and robots for your"),
            ("show", "Print the completion for your"),
        )
    ],
)
click.version_option(__version__, message="%(prog)s %(version)s", help="Print the version.")(app)


def main() -> None:
    """Run the command line."""
    # What a process that ends soon does not need: modules are never garbage, and validation would
    # look for plugins among the entry points of all installed packages.
    gc.set_threshold(100_000)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    ready_streams()
    try:
        app(prog_name="robostiff")
    finally:
        gc.freeze()  # the interpreter would look through all modules for garbage before it ends


if __name__ == "__main__":
    main()
