"""What holds OpenBLAS to one thread sets it back, whatever happens meanwhile."""

from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from threading import Barrier

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import circle, material
from robostiff.network import Network, Node, beam_between
from robostiff.one_thread import in_one_thread, openblas

WRENCH = [10.0, -20.0, -100.0, 1.0, 2.0, -1.0]


@pytest.fixture
def library():
    """OpenBLAS with two threads."""
    found = openblas()
    before = found.number()
    found.set_number(2)
    if found.number() != 2:
        pytest.skip("NumPy has another library, or that has one thread alone")
    yield found
    found.set_number(before)


@pytest.mark.parametrize(
    "verb",
    [
        lambda robot: rs.modes(robot, masses={"platform": 10.0}).each[0].shape,
        lambda robot: rs.equilibrium(robot, wrench=WRENCH).K,
        lambda robot: rs.critical_load(robot, wrench=WRENCH, up_to=2.0),
        lambda robot: rs.load_path(robot, None, WRENCH, [0.0, 1.0]),
    ],
)
def test_robots_are_computed_on_one_thread(library, monkeypatch, verb):
    seen = set()

    def observed(find):
        def run(*args, **named):
            seen.add(library.number())
            return find(*args, **named)

        return run

    for name in ("solve", "svd", "qr"):
        monkeypatch.setattr(np.linalg, name, observed(getattr(np.linalg, name)))
    robot = rs.load("gough-stewart-b-beams")
    seen.clear()
    verb(robot)
    assert seen == {1}
    assert library.number() == 2


def test_large_networks_keep_their_threads(library):
    steel, round_ = material("steel"), circle(0.02)

    def count(number):
        nodes = [Node(f"{i}", (0.1 * i, 0.0, 0.0)) for i in range(number)]
        beams = tuple(beam_between(*ends, steel, round_) for ends in pairwise(nodes))
        row = Network("row", tuple(nodes), ("0",), nodes[-1].name, nodes[-1].point, beams)
        return in_one_thread(lambda network: library.number())(row)

    assert (count(20), count(300)) == (1, 2)


def test_errors_set_it_back(library):
    with pytest.raises(rs.InputError):
        rs.modes(rs.load("gough-stewart-b"))
    assert library.number() == 2


def test_the_last_of_several_calls_sets_it_back(library):
    meeting = Barrier(2, timeout=60)

    @in_one_thread
    def inner(machine):
        return library.number()

    @in_one_thread
    def outer(machine):
        meeting.wait()
        inside = inner(machine), library.number()
        meeting.wait()
        return inside

    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(outer, "ab")) == [(1, 1), (1, 1)]
    assert library.number() == 2
