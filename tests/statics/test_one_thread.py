"""Linear algebra has one thread where that is quicker, and has its threads back afterwards."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from threadpoolctl import ThreadpoolController

import robostiff as rs

WRENCH = [10.0, -20.0, -100.0, 1.0, 2.0, -1.0]


LIBRARIES = ThreadpoolController().select(user_api="blas")


def threads():
    return max(own.num_threads for own in LIBRARIES.lib_controllers)


@pytest.fixture(autouse=True)
def _two_threads():
    with LIBRARIES.limit(limits=2):
        if threads() != 2:
            pytest.skip("NumPy has no library with threads")
        yield


@pytest.fixture
def seen(monkeypatch):
    """The numbers of threads with which NumPy solves."""
    numbers = set()

    def observed(find):
        def run(*args, **named):
            numbers.add(threads())
            return find(*args, **named)

        return run

    for name in ("solve", "svd", "qr"):
        monkeypatch.setattr(np.linalg, name, observed(getattr(np.linalg, name)))
    return numbers


@pytest.mark.parametrize(
    "verb",
    [
        lambda robot: rs.modes(robot, masses={"platform": 10.0}).each[0].shape,
        lambda robot: rs.equilibrium(robot, wrench=WRENCH).K,
        lambda robot: rs.critical_load(robot, wrench=WRENCH, up_to=2.0),
        lambda robot: rs.load_path(robot, None, WRENCH, [0.0, 1.0]),
    ],
)
def test_robots_are_computed_on_one_thread(seen, verb):
    robot = rs.load("gough-stewart-b-beams")
    seen.clear()
    verb(robot)
    assert seen == {1}
    assert threads() == 2


def test_errors_give_the_threads_back():
    with pytest.raises(rs.InputError):
        rs.modes(rs.load("gough-stewart-b"))
    assert threads() == 2


def test_the_last_of_several_calls_gives_the_threads_back():
    robots = [rs.load("gough-stewart-b-beams"), rs.load("hexapod")] * 4
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda robot: rs.equilibrium(robot, wrench=WRENCH).stable, robots))
    assert all(found)
    assert threads() == 2
