"""Commands that run in the process of the tests."""

import json

from click.testing import CliRunner

from robostiff.cli.main import app


class Running:
    """A command by its name, or any command where none is given."""

    def __init__(self, *name: str) -> None:
        self.name = name

    def __call__(self, *arguments: object, stdin: str | None = None):
        return CliRunner().invoke(app, [*self.name, *map(str, arguments)], input=stdin)

    def done(self, *arguments: object, stdin: str | None = None, status: int = 0):
        """The same, which ends with this status."""
        outcome = self(*arguments, stdin=stdin)
        assert outcome.exit_code == status, outcome.output
        return outcome

    def answer(self, *arguments: object, stdin: str | None = None, status: int = 0) -> dict:
        """What it prints as JSON."""
        return json.loads(self.done(*arguments, "--json", stdin=stdin, status=status).stdout)
