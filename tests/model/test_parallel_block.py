"""Blocks inside chains: coordinates, the main path, names of parts, and what is refused."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.model import Branch, ParallelBlock, parallelogram
from robostiff.spatial import Frame


def rigid(x: float, name: str) -> rs.Rigid:
    return rs.Rigid(Frame(np.eye(3), np.array([x, 0.0, 0.0])), name)


def pin(name: str, home: float = 0.0):
    return rs.revolute([0, 0, 1], rs.Passive(), home=[home], name=name)


def nested() -> rs.Chain:
    """A slide, and a block of two branches, the first of which holds a parallelogram."""
    inner = parallelogram(
        rs.Chain((pin("a", 0.1), rigid(0.2, "bar"), pin("b", -0.1))),
        np.array([0, 0.1, 0]),
        name="pair",
    )
    first = Branch("left", Frame.identity(), rs.Chain((inner, pin("c", 0.3))), Frame.identity())
    second = Branch("right", Frame.identity(), rs.Chain((pin("d", 0.4),)), Frame.identity())
    drive = rs.prismatic([1, 0, 0], rs.Actuated(1e6), name="drive")
    return rs.Chain((drive, ParallelBlock((first, second), "block"), pin("e", 0.5)))


def test_coordinates_follow_branch_by_branch():
    chain = nested()
    assert [element.name for element, _ in chain.moving] == ["drive", *"ababcde"]
    assert [place.start for _, place in chain.moving] == list(range(8))
    assert chain.home.tolist() == [0, 0.1, -0.1, 0.1, -0.1, 0.3, 0.4, 0.5]
    assert chain.size == len(chain.freedoms) == len(chain.roles) == 8
    inside = [f"block/left/pair/bar{i}/{pin}" for i in (1, 2) for pin in "ab"]
    names = ("drive", *inside, "block/left/c", "block/right/d", "e")
    assert chain.coordinate_names == names


def test_the_main_path_goes_through_first_branches():
    chain = nested()
    assert chain.main_places.tolist() == [0, 1, 2, 5, 7]
    assert [element.name for element, _ in chain.main_path.moving] == ["drive", *"abce"]
    assert not chain.main_path.has_blocks
    assert chain.main_path.home.tolist() == chain.home[chain.main_places].tolist()


def test_compliance_may_hide_in_any_branch():
    assert nested().has_compliance
    stiff = parallelogram(rs.Chain((pin("a"), rigid(1, "bar"), pin("b"))), np.array([0, 1.0, 0]))
    assert not rs.Chain((stiff,)).has_compliance
    bar = rs.beam_link([1, 0, 0], rs.material("steel"), rs.circle(0.02))
    assert isinstance(bar, rs.Link)
    assert rs.Chain(
        (parallelogram(rs.Chain((pin("a"), bar)), np.array([0, 1.0, 0])),)
    ).has_compliance


HERE = rs.Frame(np.eye(3), np.zeros(3))


def rod(name: str) -> rs.Link:
    return rs.beam_link([0, 0, 0.5], rs.material("steel"), rs.circle(0.02), name=name)


def machine(other: str) -> rs.Robot:
    """A leg with a block of two rods, and a leg that is called as the block is."""
    branches = tuple(Branch(name, HERE, rs.Chain((rod("rod"),)), HERE) for name in ("one", "two"))
    legs = (
        rs.Leg("leg", HERE, rs.Chain((ParallelBlock(branches, name="block"),)), HERE),
        rs.Leg("leg/block", HERE, rs.Chain((rod(other),)), HERE),
    )
    return rs.Robot("machine", legs, rs.Frame(np.eye(3), np.array([0, 0, 0.5])))


def test_legs_and_blocks_with_a_slash_in_their_names():
    assert len(machine("rod").legs) == 2
    with pytest.raises(rs.InputError, match=r"leg/block/one/rod.*each name once"):
        machine("one/rod")
