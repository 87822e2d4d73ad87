"""Seconds of processor until the command line has answered, in processes of their own.

python benchmarks/startup.py [number of runs]
"""

import resource
import statistics
import subprocess
import sys
from pathlib import Path

COMMANDS = (
    ("--version",),
    ("--help",),
    ("robots",),
    ("stiffness", "hexapod"),
    ("check", "hexapod"),
    ("indices", "hexapod"),
    ("deflection", "hexapod", "--wrench", "100 N 0 -500 N 0 0 0"),
)


def main() -> None:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 9
    robostiff = str(Path(sys.executable).with_name("robostiff"))
    print(f"{'median of ' + str(runs) + ' runs':50s}{'ms':>8s}")
    for name, command in (
        ("python -c pass", (sys.executable, "-c", "pass")),
        ("python -c 'import numpy'", (sys.executable, "-c", "import numpy")),
        *((" ".join(("robostiff", *words)), (robostiff, *words)) for words in COMMANDS),
    ):
        print(f"{name:50s}{1e3 * median_time(command, runs):8.0f}")


def median_time(command: tuple[str, ...], runs: int) -> float:
    """Seconds of processor, after a first run that fills the disk cache and writes bytecode."""
    times = []
    for _ in range(runs + 1):
        before = _used()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603
        times.append(_used() - before)
    return statistics.median(times[1:])


def _used() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
