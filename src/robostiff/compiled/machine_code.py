"""Programs as machine code of several poses an operation, compiled by llvmlite."""

from __future__ import annotations

import ctypes
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from robostiff.compiled.program_text import text_of
from robostiff.record import Program

#: Numbers at poses: an array (rows, N), or rows (N,) each at a place of its own.
Rows: TypeAlias = np.ndarray | Sequence[np.ndarray]


@dataclass(frozen=True)
class Processor:
    """What code is compiled for."""

    name: str  # as LLVM calls it
    features: str
    width: int  # how many poses an operation takes


@cache
def this_processor() -> Processor | None:
    """The processor at hand, or None where no machine code is made.

    That is where llvmlite is not installed, or the processor multiplies and adds in two steps. The
    width is eight on processors that lose no speed by that. The first processors with AVX-512
    slow down when they use it; those with its later parts do not.
    """
    try:
        import llvmlite.binding as llvm
    except ImportError:
        return None
    features = llvm.get_host_cpu_features()
    if platform.machine().lower() in ("arm64", "aarch64"):
        width = 2
    elif not features.get("fma", False):
        return None
    else:
        width = 8 if features.get("avx512vbmi2", False) else 4
    return Processor(llvm.get_host_cpu_name(), features.flatten(), width)


def machine_code_is_available() -> bool:
    """Whether programs can be compiled here."""
    return this_processor() is not None


#: A compiled function: addresses of two tables, which have the addresses of the rows of inputs and
#: of results, the first pose, and the first after the last (they are apart by a multiple of the
#: width).
_Compiled = Callable[[int, int, int, int], None]


def functions_of(
    text: str, processor: Processor, kinds: Mapping[str, tuple[Any, ...]]
) -> dict[str, Any]:
    """Functions that are written in the language of LLVM, by name, with the types they take."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(
        cpu=processor.name, features=processor.features, opt=2, jit=True
    )
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
    engine.finalize_object()
    found = {}
    for name, kind in kinds.items():
        found[name] = ctypes.CFUNCTYPE(None, *kind)(engine.get_function_address(name))
        found[name].engine = engine  # owns the machine code, and lives as long as its functions
    return found


@dataclass(frozen=True)
class VectorFunction:
    """A program as machine code for one processor."""

    address: _Compiled
    width: int  # how many poses an operation takes

    @staticmethod
    def of(program: Program, processor: Processor) -> VectorFunction:
        """Compile a program."""
        pointer, count = ctypes.c_void_p, ctypes.c_int64
        kinds = {"program": (pointer, pointer, count, count)}
        functions = functions_of(text_of(program, processor.width), processor, kinds)
        return VectorFunction(functions["program"], processor.width)

    def fill(self, inputs: Rows, outputs: Rows, part: slice) -> None:
        """Fill rows of results at a part of the poses, float64, poses side by side in each row."""
        start, stop, width = part.start, part.stop, self.width
        if stop - start >= width:
            tables = _addresses(inputs), _addresses(outputs)
            a, b = (table.ctypes.data for table in tables)
            whole = stop - (stop - start) % width
            self.address(a, b, start, whole)
            if whole < stop:  # the last poses, together with some of those before
                self.address(a, b, stop - width, stop)
        elif start < stop:
            # Fewer poses than an operation takes are filled up by the last one.
            last = np.minimum(np.arange(start, start + width), stop - 1)
            found = np.empty((len(outputs), width))
            self.fill(np.array([row[last] for row in inputs]), found, slice(0, width))
            for row, values in zip(outputs, found, strict=True):
                row[start:stop] = values[: stop - start]


def _addresses(rows: Rows) -> np.ndarray:
    """Where each row begins (rows,)."""
    if isinstance(rows, np.ndarray):
        return rows.ctypes.data + rows.strides[0] * np.arange(len(rows))
    return np.array([row.__array_interface__["data"][0] for row in rows], dtype=np.int64)
