"""Child processes that Ctrl-C stops, whoever runs the tests."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def interrupts_heard() -> Iterator[None]:
    """Programs that are started here take SIGINT, which shells let background jobs ignore.

    What is ignored stays ignored in a new program; what has a handler goes back to its default.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
