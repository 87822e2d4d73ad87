"""Running the blocks of a map by threads or Dask workers, with progress."""

from __future__ import annotations

import logging
import os
import signal
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from robostiff.analysis.maps.job import MapSummary
from robostiff.errors import InputError, NoAnswerError, needs_extra

if TYPE_CHECKING:
    from distributed import Client


# Blocks handed out ahead of those at work, a worker: enough to never wait, few enough to stop soon.
_AHEAD = 2
# Of the C library (glibc): a worker keeps the memory of its arrays for the next block. Dask lets it
# give back all above 64 KiB at once, and clearing pages anew takes longer than the computation.
_ALLOCATOR = {"MALLOC_TRIM_THRESHOLD_": 2**28, "MALLOC_MMAP_THRESHOLD_": 2**25}
# How long a scheduler may take to answer.
_PATIENCE = "10s"


@dataclass(frozen=True)
class Threads:
    """Threads of this process.

    Parameters
    ----------
    count : int, optional
        As many as there are processors when left out.
    """

    count: int = 0

    def __post_init__(self) -> None:
        if not isinstance(self.count, int) or self.count < 0:
            raise InputError("count of threads", got=self.count, expected="a whole number from 1")

    @property
    def number(self) -> int:
        """How many."""
        if self.count or not hasattr(os, "sched_getaffinity"):
            return self.count or os.cpu_count() or 1
        return len(os.sched_getaffinity(0))


Found = TypeVar("Found")
Computed_co = TypeVar("Computed_co", covariant=True)


class Work(Protocol[Computed_co]):
    """What computes blocks; picklable where processes share it."""

    def compute(self, index: int) -> Computed_co:
        """What is found in a block."""
        ...


def run_in_threads(
    work: Work[Found], todo: Iterable[int], threads: Threads
) -> Iterator[tuple[int, Found]]:
    """Do blocks, and yield what is found in each when it is done."""
    rest = iter(todo)
    if threads.number == 1:
        for index in rest:
            yield index, work.compute(index)
        return
    pool = ThreadPoolExecutor(threads.number, thread_name_prefix="robostiff-map")
    running: dict[Future[Found], int] = {}
    try:
        for index in islice(rest, _AHEAD * threads.number):
            running[pool.submit(work.compute, index)] = index
        while running:
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                index = running.pop(future)
                found = future.result()
                for following in islice(rest, 1):
                    running[pool.submit(work.compute, following)] = following
                yield index, found
    finally:
        pool.shutdown(cancel_futures=True)


def run_on_dask(
    client: Client, work: Work[Found], todo: Iterable[int]
) -> Iterator[tuple[int, Found]]:
    """Let Dask workers compute blocks, and yield what is found in each when it is done.

    Only this passes through the scheduler. The work of a worker that dies is given to another.
    """
    from distributed import KilledWorker, as_completed

    run = uuid.uuid4().hex[:8]
    # A task like the others, which is done again where the worker that held it has died.
    shared = client.submit(_received, work, key=f"robostiff-map-{run}", pure=False)
    rest = iter(todo)

    def submit(index: int) -> Any:
        key = f"robostiff-block-{run}-{index}"
        return client.submit(_computed, shared, index, key=key, pure=False)

    threads: Any = client.nthreads()
    ahead = _AHEAD * max(1, sum(threads.values()))
    running = as_completed([submit(index) for index in islice(rest, ahead)], loop=client.loop)
    for future in running:
        try:
            index, found = future.result()
        except KilledWorker as error:
            raise NoAnswerError(
                f"workers died again and again over one block ({error}); the blocks done so far "
                "are safe: give the workers more memory, and resume"
            ) from None
        for following in islice(rest, 1):
            running.add(submit(following))
        yield index, found


@contextmanager
def dask_client(workers: int | None, scheduler: Any) -> Iterator[Client]:
    """A client of the scheduler given, or of a cluster of processes that lives as long as this."""
    with needs_extra("maps", "maps"):
        import dask.config
        from distributed import Client, LocalCluster
    if isinstance(scheduler, Client):
        yield scheduler
    elif scheduler is not None:
        if not isinstance(scheduler, str) or "://" not in scheduler:
            raise InputError(
                "scheduler",
                got=scheduler,
                expected="the address of a Dask scheduler or a dask.distributed.Client",
                hint='write scheduler="tcp://host:8786"',
            )
        try:
            client = Client(scheduler, timeout=_PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            raise InputError(
                "scheduler", got=scheduler, expected=f"one that answers ({error})"
            ) from None
        with client:
            yield client
    else:
        own: dict[str, Any] = {
            "n_workers": workers,
            "threads_per_worker": 1,
            "processes": True,
            "dashboard_address": "localhost:0",  # any free port: several maps may run at once
            "silence_logs": logging.CRITICAL,
        }
        key = "distributed.nanny.pre-spawn-environ"
        with (
            dask.config.set({key: {**dask.config.get(key), **_ALLOCATOR}}),
            LocalCluster(**own) as cluster,
            Client(cluster, set_as_default=False) as client,
        ):
            client.register_plugin(_left_to_end_by_us())
            yield client


def _left_to_end_by_us() -> Any:
    """Ctrl-C reaches all processes of a terminal: this one ends the others, without their noise."""
    from distributed import WorkerPlugin

    class IgnoreInterrupts(WorkerPlugin):
        name = "robostiff-ignore-interrupts"

        def setup(self, worker: Any) -> None:
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    return IgnoreInterrupts()


def _received(work: Work[Found]) -> Work[Found]:
    return work


def _computed(work: Work[Found], index: int) -> tuple[int, Found]:
    return index, work.compute(index)


@dataclass(frozen=True)
class Progress:
    """Progress of a map.

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
    """Run blocks, each computed when it is asked for, report each, and return the summary.

    `before` is what an earlier run has done, of a total of poses.
    """
    started = time.monotonic()
    summary = before
    for _, own in blocks:
        summary = MapSummary.total((summary, own))
        if progress is not None:
            seconds = time.monotonic() - started
            resumed = before.poses + summary.resumed
            progress(Progress(summary.poses, total, resumed, seconds, summary.guarded))
    return summary
