"""The progress of a map on a terminal."""

from __future__ import annotations

import sys
from types import TracebackType

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)

from robostiff.analysis.maps import Progress as Done


class MapBar:
    """A bar with rate and remaining time on standard error, where a person looks at it."""

    def __init__(self) -> None:
        self.rate = 0.0
        self._bar = Progress(
            BarColumn(),
            TaskProgressColumn(),
            MofNCompleteColumn(),
            TextColumn("poses, {task.fields[rate]}"),
            TimeRemainingColumn(compact=True),
            console=Console(file=sys.stderr),
            disable=not sys.stderr.isatty(),
            transient=True,
        )
        self._task = self._bar.add_task("map", total=None, rate="")

    def show(self, done: Done) -> None:
        """Tell how far the map is."""
        self.rate = done.rate
        self._bar.update(
            self._task, total=done.total, completed=done.done, rate=f"{done.rate:.3g} a second"
        )

    def __enter__(self) -> MapBar:
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.stop()
