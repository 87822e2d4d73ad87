"""Loads, laws and results know a part as leg/part: no two parts have one such name."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.model import Branch, ParallelBlock

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
