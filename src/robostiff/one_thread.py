"""Linear algebra on one thread, for matrices that libraries divide although that takes longer.

OpenBLAS divides matrices of some 100 rows among all processors. Where these are busy, each step
waits for the next one that is free: a decomposition of 2 ms then takes 100.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from functools import cache, wraps
from threading import Lock
from typing import Any, ParamSpec, TypeVar

_Arguments = ParamSpec("_Arguments")
_Found = TypeVar("_Found")
# Nodes of a network beyond which its matrices are so large that several threads are quicker.
_MANY = 200


class OneThread:
    """The libraries of linear algebra of this process on one thread in a ``with``.

    Of several calls at a time the last sets the number of threads back.
    """

    def __init__(self) -> None:
        from threadpoolctl import ThreadpoolController

        self.lock: Any = Lock()
        self.calls: int = 0
        self.libraries: Any = ThreadpoolController().select(user_api="blas")
        self.limit: Any = None

    def __enter__(self) -> None:
        with self.lock:
            if not self.calls:
                self.limit = self.libraries.limit(limits=1)
            self.calls += 1

    def __exit__(self, *error: object) -> None:
        with self.lock:
            self.calls -= 1
            if not self.calls:
                self.limit.restore_original_limits()


@cache
def one_thread() -> OneThread:
    """What holds the libraries of this process."""
    return OneThread()


def in_one_thread(find: Callable[_Arguments, _Found]) -> Callable[_Arguments, _Found]:
    """A function of a machine with linear algebra on one thread meanwhile, but for large networks.

    Other threads of Python find it so, too.
    """

    @wraps(find)
    def run(*args: _Arguments.args, **named: _Arguments.kwargs) -> _Found:
        machine = args[0] if args else next(iter(named.values()), None)
        nodes: Any = getattr(machine, "nodes", None)
        is_large = isinstance(nodes, tuple) and len(nodes) > _MANY
        with nullcontext() if is_large else one_thread():
            return find(*args, **named)

    return run
