"""NumPy's OpenBLAS on one thread, for matrices that it divides although that takes longer.

It divides those of some 100 rows among all processors. Where these are busy, each step waits for
the next one that is free: a decomposition of 2 ms then takes 100.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from contextlib import nullcontext, suppress
from functools import cache, wraps
from threading import Lock
from typing import Any, ParamSpec, TypeVar

_Arguments = ParamSpec("_Arguments")
_Found = TypeVar("_Found")
# Nodes of a network beyond which its matrices are so large that several threads are quicker.
_MANY = 200


class OpenBLAS:
    """The library that NumPy uses, on one thread of the process in a ``with``; else nothing.

    Of several calls at a time the last sets the number of threads back.
    """

    def __init__(self) -> None:
        self.lock, self.calls, self.usual = Lock(), 0, 1
        self.set_number: Any = lambda _: None
        self.number: Any = lambda: 1
        file = getattr(sys.modules.get("numpy.linalg._umath_linalg"), "__file__", None)
        for name in ("scipy_openblas_{}_num_threads64_", "openblas_{}_num_threads"):
            with suppress(OSError, AttributeError):
                each = [getattr(ctypes.CDLL(file), name.format(verb)) for verb in ("set", "get")]
                self.set_number, self.number = each

    def __enter__(self) -> None:
        with self.lock:
            if not self.calls:
                self.usual = self.number()
                self.set_number(1)
            self.calls += 1

    def __exit__(self, *error: object) -> None:
        with self.lock:
            self.calls -= 1
            if not self.calls:
                self.set_number(self.usual)


openblas = cache(OpenBLAS)


def in_one_thread(find: Callable[_Arguments, _Found]) -> Callable[_Arguments, _Found]:
    """A function of a machine that holds OpenBLAS to one thread meanwhile.

    Other threads of Python find it so, too. Large networks, and other libraries, stay as they are.
    """

    @wraps(find)
    def held(*args: _Arguments.args, **named: _Arguments.kwargs) -> _Found:
        machine = args[0] if args else next(iter(named.values()), None)
        nodes: Any = getattr(machine, "nodes", None)
        is_large = isinstance(nodes, tuple) and len(nodes) > _MANY
        with nullcontext() if is_large else openblas():
            return find(*args, **named)

    return held
