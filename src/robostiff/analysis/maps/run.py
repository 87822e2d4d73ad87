"""Running the blocks of a map by threads or Dask workers, with progress."""

from __future__ import annotations

import logging
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

from robostiff.analysis.maps.job import MapSummary
from robostiff.compiled.kernel import processors
from robostiff.errors import InputError, NoAnswerError, needs_extra
from robostiff.frozen import frozen
from robostiff.spatial import check_whole

if TYPE_CHECKING:
    from distributed import Client


# Blocks handed out ahead of those at work, a worker: enough to never wait, few enough to stop soon.
_AHEAD = 2
# Of the C library (glibc): a worker keeps the memory of its arrays for the next block. Dask lets it
# give back all above 64 KiB at once, and clearing pages anew takes longer than the computation.
_ALLOCATOR = {"MALLOC_TRIM_THRESHOLD_": 2**28, "MALLOC_MMAP_THRESHOLD_": 2**25}
# How long a scheduler may take to answer.
_PATIENCE = "10s"


@frozen
class Threads:
    """Threads of this process.

    Parameters
    ----------
    count : int, optional
        As many as there are processors when left out.
    """

    count: int | None = None

    def __post_init__(self) -> None:
        if self.count is not None:
            check_whole("count of threads", self.count)

    @property
    def number(self) -> int:
        """How many."""
        return processors() if self.count is None else self.count


Found = TypeVar("Found")
#: Calls a function at the numbers of blocks, and yields what it gives as it is there.
Run = Callable[[Callable[[int], Found], Iterable[int]], Iterator[tuple[int, Found]]]


@contextmanager
def workforce(workers: int | None, scheduler: Any) -> Iterator[Run[Any]]:
    """What computes blocks: threads of this process, processes, or a cluster.

    Only what is found passes through a scheduler; another worker follows one that dies.

    Raises InputError where there is no such scheduler.
    """
    if workers is None and (scheduler is None or isinstance(scheduler, Threads)):
        count = (scheduler or Threads()).number
        if count == 1:
            yield lambda compute, todo: ((index, compute(index)) for index in todo)
            return
        pool = ThreadPoolExecutor(count, thread_name_prefix="robostiff-map")
        try:
            yield lambda compute, todo: _blocks(pool, count, compute, todo)
        finally:
            pool.shutdown(cancel_futures=True)
        return
    with _dask_client(workers, scheduler) as client:
        pool = client.get_executor()

        def run(compute: Callable[[int], Found], todo: Iterable[int]) -> Any:
            threads: Any = client.nthreads()
            # A task like the others, which is done again where the worker that held it has died.
            shared = client.submit(_received, compute, pure=False)
            yield from _blocks(pool, sum(threads.values()), shared, todo)

        try:
            yield run
        finally:
            pool.shutdown(wait=False)


def _blocks(
    pool: Executor, workers: int, compute: Any, todo: Iterable[int]
) -> Iterator[tuple[int, Any]]:
    rest = iter(todo)
    running = {pool.submit(_computed, compute, k) for k in islice(rest, _AHEAD * max(1, workers))}
    while running:
        done, running = wait(running, return_when=FIRST_COMPLETED)
        for future in done:
            try:
                result = future.result()
            except Exception as error:
                if type(error).__name__ != "KilledWorker":  # of Dask, perhaps not installed
                    raise
                raise NoAnswerError(
                    f"workers died again and again over one block ({error}); the blocks done so "
                    "far are safe: give the workers more memory, and resume"
                ) from None
            running |= {pool.submit(_computed, compute, k) for k in islice(rest, 1)}
            yield result


def _ignore_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _received(compute: Found) -> Found:
    return compute


def _computed(compute: Callable[[int], Found], index: int) -> tuple[int, Found]:
    return index, compute(index)


@contextmanager
def _dask_client(workers: int | None, scheduler: Any) -> Iterator[Client]:
    """A client of the scheduler given, or of a cluster of processes that lives as long as this."""
    if workers is not None and scheduler is not None:
        raise InputError("workers and scheduler", expected="one of them")
    if workers is not None:
        check_whole("workers", workers)
    with needs_extra("maps", "maps"):
        import dask.config
        from distributed import Client, LocalCluster
    if isinstance(scheduler, Client):
        yield scheduler
        return
    if workers is None:
        expected, hint = "the address of a Dask scheduler or a dask.distributed.Client", None
        try:
            if not isinstance(scheduler, str) or "://" not in scheduler:
                hint = 'write scheduler="tcp://host:8786"'
                raise ValueError
            client = Client(scheduler, timeout=_PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            expected = expected if hint else f"one that answers ({error})"
            raise InputError("scheduler", got=scheduler, expected=expected, hint=hint) from None
        with client:
            yield client
        return
    key = "distributed.nanny.pre-spawn-environ"
    with (
        dask.config.set({key: {**dask.config.get(key), **_ALLOCATOR}}),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address="localhost:0",  # any free port: several maps may run at once
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        # Ctrl-C reaches all processes of a terminal: this one ends the others, without their noise.
        client.run(_ignore_interrupts)
        yield client


@frozen
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
        """Poses a second."""
        return (self.done - self.resumed) / self.seconds if self.seconds > 0 else 0.0


def run_with_progress(
    blocks: Iterable[tuple[int, MapSummary]],
    before: MapSummary,
    total: int,
    progress: Callable[[Progress], None] | None,
) -> MapSummary:
    """Run blocks, each computed when it is asked for, report each, and return the summary.

    `before` is what an earlier run has done, of a total of poses.
    """
    started, summary = time.monotonic(), before
    for _, block in blocks:
        summary += block
        if progress is not None:
            seconds, resumed = time.monotonic() - started, before.poses + summary.resumed
            progress(Progress(summary.poses, total, resumed, seconds, summary.guarded))
    return summary
