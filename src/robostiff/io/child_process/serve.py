"""The child process: limits first, then the task, then its answer as JSON on standard output.

A script that imports nothing of this package, so that it starts quickly.
"""

from __future__ import annotations

import json
import os
import runpy
import sys
from typing import Any

# Events that code from a file may cause after the imports of the task.
_HARMLESS = frozenset(
    (
        *("builtins.id", "exec", "import", "object.__getattr__"),
        *("sys._getframe", "sys._getframemodulename"),
        *("glob.glob", "glob.glob/2", "pathlib.Path.glob", "pathlib.Path.rglob"),
        *("marshal.load", "marshal.loads", "os.fwalk", "os.listdir", "os.scandir", "os.walk"),
    )
)
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


def main() -> None:
    """Serve one request."""
    job = json.load(sys.stdin)
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # output of libraries is not part of the answer
    sys.dont_write_bytecode = True
    _limit(job["memory"], job["seconds"])
    try:
        task = runpy.run_path(job["task"])
        sys.addaudithook(_refuse)
        answer: dict[str, Any] = task["answer"](job["request"])
    except MemoryError:
        answer = {"refusal": f"a file that takes more than {job['memory']} bytes of memory"}
    except RecursionError:
        answer = {"refusal": "a file with circular or too deep nesting"}
    json.dump(answer, answers)
    answers.close()


def _limit(memory: int, seconds: int) -> None:
    """Set limits of the operating system, if it has them."""
    try:
        import resource
    except ImportError:  # Windows: the clock of the caller remains
        return
    for kind, value in (
        (resource.RLIMIT_AS, memory),
        (resource.RLIMIT_CPU, seconds),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(kind)[1]
        soft = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(kind, (soft, hard))


def _refuse(event: str, arguments: tuple[Any, ...]) -> None:
    """An audit hook: code may compute and read, and nothing else."""
    if event == "open":
        _, mode, flags = arguments
        if not (flags & _WRITING) and not set(mode or "r") & set("wax+"):
            return
    elif event == "compile":
        source, file = arguments
        text = source if isinstance(source, bytes) else str(source or "").encode()
        if file == "<expression>" and b"__" in text:
            raise PermissionError("two underscores in an expression")
        return
    elif event in _HARMLESS:
        return
    raise PermissionError(f"{event} in a file that may only compute and read")


if __name__ == "__main__":
    main()
