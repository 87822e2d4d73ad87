"""The command ``robots``: it reads the heads of files alone, and imports nothing that computes."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Mapping

from robostiff.cli.options import Answer
from robostiff.cli.output import show, shown
from robostiff.robots import (
    RobotInfo,
    describe,
    shipped_cable_robots,
    shipped_linkages,
    shipped_robots,
)

_WIDTH = 78  # of a terminal, for a table


def list_robots(answer: Answer) -> int:
    """Print the shipped robots."""
    names = (*shipped_robots(), *shipped_cable_robots(), *shipped_linkages())
    listed = {name: describe(name) for name in sorted(names)}
    if answer.as_json:
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
