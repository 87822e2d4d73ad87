"""Time until the command line has answered, in processes of their own.

python benchmarks/startup.py [number of runs]
"""

import statistics
import subprocess
import sys
import time
from pathlib import Path

COMMANDS = (
    ("--version",),
    ("--help",),
    ("robots",),
    ("stiffness", "gough-stewart-b"),
    ("deflection", "hexapod", "--wrench", "100 N 0 -500 N 0 0 0"),
)


def main() -> None:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 9
    robostiff = str(Path(sys.executable).with_name("robostiff"))
    print(f"{'median of ' + str(runs) + ' runs':50s}{'ms':>8s}")
    for name, command in (
        ("python -c pass", (sys.executable, "-c", "pass")),
        *((" ".join(("robostiff", *words)), (robostiff, *words)) for words in COMMANDS),
    ):
        print(f"{name:50s}{1e3 * median_time(command, runs):8.0f}")


def median_time(command: tuple[str, ...], runs: int) -> float:
    """Seconds, after a first run that fills the disk cache."""
    times = []
    for _ in range(runs + 1):
        start = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603
        times.append(time.perf_counter() - start)
    return statistics.median(times[1:])


if __name__ == "__main__":
    main()
