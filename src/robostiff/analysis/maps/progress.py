"""How far a map is."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from robostiff.analysis.maps.summary import MapSummary


@dataclass(frozen=True)
class Progress:
    """How far a map is.

    Attributes
    ----------
    done, total : int
        Poses.
    resumed : int
        Poses among those done that were there before.
    seconds : float
        Since the start.
    guarded : int
        Poses given to the batched numeric form so far.
    """

    done: int
    total: int
    resumed: int
    seconds: float
    guarded: int

    @property
    def rate(self) -> float:
        """Poses a second.

        Examples
        --------
        >>> Progress(done=300, total=1000, resumed=100, seconds=2.0, guarded=0).rate
        100.0
        """
        return (self.done - self.resumed) / self.seconds if self.seconds > 0 else 0.0


def followed(
    blocks: Iterable[tuple[int, MapSummary]],
    before: MapSummary,
    total: int,
    progress: Callable[[Progress], None] | None,
) -> MapSummary:
    """Run all blocks, tell of each, and sum up.

    Parameters
    ----------
    blocks : iterable of (int, MapSummary)
        Each is computed when it is asked for.
    before : MapSummary
        What an earlier run has done.
    total : int
        Poses.
    progress : callable or None
    """
    started = time.monotonic()
    summary = before
    for _, own in blocks:
        summary = MapSummary.total((summary, own))
        if progress is not None:
            seconds = time.monotonic() - started
            progress(Progress(summary.poses, total, before.poses, seconds, summary.guarded))
    return summary
