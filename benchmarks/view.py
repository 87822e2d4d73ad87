"""Milliseconds from a slider to the picture data of a view, under a load.

python benchmarks/view.py [robot ...]

Of all shipped robots by default: stiffness, deflection, picture and tables at a new position of the
first slider, up to the messages for the browser. Processor time of one thread, the fastest of 20.
"""

import os
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy is loaded

import robostiff as rs
from robostiff.robots import shipped_cable_robots, shipped_linkages, shipped_robots
from robostiff_view import LivePage, machine_of

_MOVES = 20
_LOADS = {6: [300.0, 100.0, -500.0, 10.0, 20.0, 30.0], 3: [300.0, 100.0, 10.0]}


class TimedPage(LivePage):
    """A view that notes the processor time [s] of each picture."""

    def update(self):
        start = time.thread_time()
        answer = super().update()
        times.append(time.thread_time() - start)
        return answer


times: list[float] = []


def main(names: list[str]) -> None:
    for name in names or [*shipped_robots(), *shipped_cable_robots(), *shipped_linkages()]:
        print(f"{name:28s}{1e3 * fastest_move(name):8.1f} ms", flush=True)


def fastest_move(name: str) -> float:
    """Seconds of processor."""
    load = rs.load_linkage if name in shipped_linkages() else rs.load
    machine = machine_of(load(name))
    page = TimedPage(machine, wrench=_LOADS[machine.space.size])
    slider = machine.sliders[0]
    times.clear()
    for i in range(_MOVES):
        page.move(slider.name, slider.start + (1 + i % 7) * slider.step)
        while len(times) <= i:
            time.sleep(0.001)
    page.close()
    return min(times)


if __name__ == "__main__":
    main(sys.argv[1:])
