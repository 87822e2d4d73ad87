"""What of a linkage its platform feels."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robostiff import InputError
from robostiff.linkage import Connection, Linkage, essential
from robostiff.model import Passive, spherical
from robostiff.spatial import Frame

_HERE = Frame.identity()


def _ball(name, a, b):
    return Connection(name, a, b, _HERE, spherical(Passive(), name=name), _HERE)


def _weld(name, a, b, x=0.0):
    return Connection(name, a, b, Frame(np.eye(3), np.array([x, 0, 0])), None, _HERE)


def _linkage(connections, base="base", platform="platform"):
    return Linkage("l", tuple(connections), base, platform, np.zeros(3))


def _names(linkage):
    return {c.name for c in linkage.connections}


def _on_simple_ways(edges, base, platform):
    """By trying all ways: names of the edges on those that pass no body twice."""
    found = set()

    def go(body, passed, way):
        if body == platform:
            found.update(way)
            return
        for name, a, b in edges:
            if body in (a, b) and name not in way:
                other = b if body == a else a
                if other not in passed:
                    go(other, passed | {other}, (*way, name))

    go(base, {base}, ())
    return found


@settings(max_examples=100)
@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=11))
def test_kept_is_what_lies_on_ways_that_pass_no_body_twice(pairs):
    edges = [(f"e{i}", f"b{a}", f"b{b}") for i, (a, b) in enumerate(pairs) if a != b]
    bodies = {body for _, a, b in edges for body in (a, b)}
    if not {"b0", "b1"} <= bodies:
        return
    wanted = _on_simple_ways(edges, "b0", "b1")
    linkage = _linkage(itertools.starmap(_ball, edges), "b0", "b1")
    if wanted:
        assert _names(essential(linkage)) == wanted
    else:
        with pytest.raises(InputError, match="nothing between it and the base"):
            essential(linkage)


def test_welded_bodies_are_one():
    linkage = _linkage(
        [
            _weld("w1", "base", "table", 1.0),
            _ball("j", "table", "arm"),
            _weld("w2", "arm", "hand", 2.0),
            _weld("w3", "hand", "platform", 3.0),
        ]
    )
    (kept,) = essential(linkage).connections
    assert (kept.a, kept.b) == ("base", "platform")
    assert kept.before.p.tolist() == [1, 0, 0]
    assert kept.after.p.tolist() == [5, 0, 0]


def test_long_chains_are_no_problem():
    names = ["base", *(f"b{i}" for i in range(3000)), "platform"]
    chain = [_ball(f"j{i}", a, b) for i, (a, b) in enumerate(itertools.pairwise(names))]
    assert len(essential(_linkage([*chain, _ball("side", "b7", "hook")])).connections) == 3001
