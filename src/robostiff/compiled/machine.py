"""A program compiled to machine code that works on several poses at once (heyoka, LLVM)."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.compiled.arrays import ArrayCode
from robostiff.record import OPERATORS, Operation, Program

_threads = threading.Lock()


@dataclass(frozen=True)
class MachineCode:
    """Runs a program on rows of poses as SIMD machine code; compiled at the first use.

    Attributes
    ----------
    program : Program
    """

    program: Program

    @property
    def operations(self) -> int:
        """Number of operations a pose takes."""
        return self.program.operations

    @property
    def rows(self) -> int:
        """Number of results."""
        return len(self.program.outputs)

    def evaluate(self, inputs: np.ndarray, outputs: np.ndarray, threads: int = 1) -> None:
        """Fill `outputs` (results, N) from `inputs` (inputs, N), float64, rows contiguous."""
        if threads <= 1:
            self._function(inputs=inputs, outputs=outputs, batch_parallel=False)
            return
        with machine_threads(threads):
            self._function(inputs=inputs, outputs=outputs, batch_parallel=True)

    def __getstate__(self) -> dict[str, Any]:
        # Machine code is compiled again where the program is unpickled.
        return {"program": self.program}

    def __setstate__(self, state: dict[str, Any]) -> None:
        object.__setattr__(self, "program", state["program"])

    @cached_property
    def _function(self) -> Any:
        import heyoka as hy

        if not self.program.inputs:  # every result is a number, and nothing is left to compile
            numbers = ArrayCode(self.program)
            return lambda inputs, outputs, batch_parallel: numbers.evaluate(inputs, outputs)
        variables = hy.make_vars(*self.program.inputs)
        # One variable comes without a list around it.
        variables = variables if isinstance(variables, list) else [variables]
        values = dict(zip(self.program.inputs, variables, strict=True))
        table = {
            **OPERATORS,
            Operation.SQUARE_ROOT: hy.sqrt,
            Operation.SINE: hy.sin,
            Operation.COSINE: hy.cos,
            Operation.ARC_COSINE: hy.acos,
            Operation.ARC_TANGENT: hy.atan2,
            Operation.HYPERBOLIC_TANGENT: hy.tanh,
            Operation.LEAST: lambda a, b: hy.select(hy.lt(a, b), a, b),
            Operation.GREATER: hy.gt,
        }
        outputs = [
            x if isinstance(x, hy.expression) else hy.expression(float(x))
            for x in self.program.evaluated(values, table)
        ]
        return hy.cfunc(outputs, vars=variables, fast_math=True, **_width())


def _width() -> dict[str, Any]:
    """How many poses an operation takes: eight on processors that lose no speed by that.

    LLVM takes four by default, as the first processors with AVX-512 slow down when they use it.
    Those with its later parts do not: eight poses take two thirds to nine tenths of the time.
    """
    try:
        processor = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return {}
    return {"force_avx512": True, "batch_size": 8} if " avx512_vbmi2 " in processor else {}


@contextmanager
def machine_threads(count: int) -> Iterator[None]:
    """Let the machine code of this process use the given number of threads in a context."""
    import heyoka as hy

    with _threads:
        before = hy.get_nthreads()
        if before != count:
            hy.set_nthreads(count)
        try:
            yield
        finally:
            if before != count:
                hy.set_nthreads(before)


def machine_code_is_available() -> bool:
    """Whether the compiler is installed here."""
    from importlib.util import find_spec

    return find_spec("heyoka") is not None
