"""Reading of untrusted files in a separate process, with limits on time and memory."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

from robostiff.errors import FileError, Location, Words
from robostiff.frozen import frozen

_SERVE = Path(__file__).with_name("serve.py")
# What may be asked of it; these scripts import nothing of this package.
EXPAND_XACRO, READ_HDF5 = map(_SERVE.with_name, ("expand_xacro.py", "read_hdf5.py"))


@frozen
class ProcessLimits:
    """Bounds on a child process."""

    memory: int = 2_000_000_000  # address space [bytes], where the system can limit it
    # of its processor, where the system can limit it; and eight times that by the clock, since
    # other programs may keep it waiting
    seconds: int = 4


_LIMITS = ProcessLimits()


def answer_of(
    task: Path,
    request: dict[str, Any],
    location: Location,
    subject: str,
    reader: str,
    limits: ProcessLimits = _LIMITS,
) -> dict[str, Any]:
    """The answer of the function ``answer`` of a script to a request.

    The script runs in a Python of its own. It may read files, but neither write them nor start
    programs nor open connections. Request and answer are JSON. Messages name the `location` of the
    file, what is read (``"MJCF"``) and what reads it (``"MuJoCo"``).

    Raises FileError when the task refuses the file, fails, or goes over the limits. A task refuses
    by the key ``refusal``, with ``file`` and ``line`` where it is another file that is to blame.
    """
    content = json.dumps({"task": str(task), "request": request, **vars(limits)}).encode()
    try:
        done = subprocess.run(  # noqa: S603 - our own Python and script
            [sys.executable, "-P", str(_SERVE)],
            input=content,
            capture_output=True,
            env={
                **os.environ,
                "PYTHONPATH": os.pathsep.join(path for path in sys.path if path),
                "OPENBLAS_NUM_THREADS": "1",
                "OMP_NUM_THREADS": "1",
            },
            timeout=8 * limits.seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise _over_time(location, subject, reader, limits) from None
    except OSError as error:
        got = Words(f"no process in which {reader} could read it ({error.strerror})")
        expected = "a Python that can start another one"
        raise FileError(location, subject, got=got, expected=expected) from None
    if done.returncode == -getattr(signal, "SIGXCPU", 0):
        raise _over_time(location, subject, reader, limits)
    try:
        answer = json.loads(done.stdout)
    except ValueError:
        complaint = done.stderr.decode(errors="replace").strip().splitlines()
        last = complaint[-1] if complaint else f"exit status {done.returncode}"
        got = Words(f"a file at which {reader} fails: {last}")
        expected = f"one that {reader} can read"
        raise FileError(location, subject, got=got, expected=expected) from None
    if "refusal" in answer:
        if "file" in answer:  # not the first file, but one that it includes
            location = Location(str(answer["file"]), answer.get("line"))
        words = " ".join(str(answer["refusal"]).split())
        raise FileError(location, subject, got=Words(words), expected=f"what {reader} can read")
    return answer


def _over_time(location: Location, subject: str, reader: str, limits: ProcessLimits) -> FileError:
    got = Words(f"a file for which {reader} takes more than {limits.seconds} s")
    expected = "a description of bodies and joints, which takes less than one"
    return FileError(location, subject, got=got, expected=expected)
