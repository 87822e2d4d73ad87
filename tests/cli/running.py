"""Commands that run in the process of the tests."""

import json

from click.testing import CliRunner

from robostiff.cli.main import app


class Running:
    """A command by its name, or any command where none is given."""

    def __init__(self, *name: str) -> None:
        self.name = name

    def __call__(self, *arguments: str, stdin: str | None = None):
        return CliRunner().invoke(app, [*self.name, *arguments], input=stdin)

    def answer(self, *arguments: str, stdin: str | None = None, status: int = 0) -> dict:
        """What it prints as JSON."""
        outcome = self(*arguments, "--json", stdin=stdin)
        assert outcome.exit_code == status, outcome.output
        return json.loads(outcome.stdout)
