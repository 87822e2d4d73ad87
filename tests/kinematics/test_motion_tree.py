"""Closure by iteration: frames against those of `place_chain`, and the end of a vain search."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

import robostiff as rs
from robostiff import robots
from robostiff.kinematics import PostureFinder, freedom_twists, place_chain
from robostiff.kinematics.closure import (
    Loops,
    assembly_mode,
    attachment_frame,
    gaps,
    loops_of_legs,
    nearest,
)
from robostiff.kinematics.frames import Loop, PlacedChain
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Actuated, Chain, Leg, revolute
from robostiff.spatial import Frame
from tests.generators.elements import element_chains, random_transform
from tests.generators.machines import tripod

HERE = Path(__file__).parent
POSES = 3


def closing_rates(gap: Loop, placed: PlacedChain) -> np.ndarray:
    """Twists by which each coordinate of a leg closes a gap (..., 6, size)."""
    freedoms = placed.freedoms
    J = np.zeros((*gap.p.shape[:-1], 6, len(freedoms)))
    J[..., gap.own] += freedom_twists([freedoms[i] for i in gap.own], gap.p)
    if gap.leading:
        J[..., gap.leading] -= freedom_twists([freedoms[i] for i in gap.leading], gap.p_wanted)
    return J


def check(legs: tuple[Leg, ...], rng: np.random.Generator) -> None:
    """Ends, rates and columns of all legs, at coordinates that close nothing."""
    pose = rng.uniform(-1.0, 1.0, (POSES, 6))
    R, p = turn_by_vector(pose[:, 3:]), pose[:, :3]
    q = [leg.chain.home + rng.uniform(-1.0, 1.0, (POSES, leg.chain.size)) for leg in legs]
    tree = loops_of_legs(legs, (), 1.0).tree
    placed = tree.placed(np.concatenate([pose, *q], axis=-1))
    J = tree.closing_twists(placed)
    end, column = 0, 6
    for leg, own in zip(legs, q, strict=True):
        chain = place_chain(leg.chain, own, leg.base.R, leg.base.p)
        ends = list(gaps(leg, chain, *attachment_frame(leg, R, p)))
        for gap in ends:
            for wanted, found in (
                (gap.R, placed.R),
                (gap.p, placed.p),
                (gap.R_wanted, placed.R_wanted),
                (gap.p_wanted, placed.p_wanted),
            ):
                np.testing.assert_allclose(found[:, end], wanted, rtol=0, atol=1e-12)
            rates = np.zeros((POSES, 6, J.shape[-1]))
            rates[..., column : column + leg.chain.size] = closing_rates(gap, chain)
            np.testing.assert_allclose(J[:, end], rates, rtol=0, atol=1e-12)
            end += 1
        column += leg.chain.size
    assert (end, column) == J.shape[1:4:2]


@pytest.mark.parametrize("name", ["h4", "capaman", "delta", "us-ups"])
def test_ends_and_rates_of_robots_with_loops(name):
    check(PostureFinder(robots.load(name)).robot.legs, np.random.default_rng(1))


def test_ends_and_rates_of_telescopes_and_of_screws():
    screws = rs.load(HERE.parent / "robots" / "ball-screws.yaml")
    for robot in (tripod("RPS"), screws):
        check(PostureFinder(robot).robot.legs, np.random.default_rng(2))


@settings(max_examples=60)
@given(element_chains())
def test_ends_and_rates_of_any_elements(case: tuple[Chain, Frame, np.random.Generator]):
    chain, base, rng = case
    elastic = Chain((*chain.elements, revolute([0, 0, 1], Actuated(1.0))))
    check((Leg("leg", base, elastic, random_transform(rng)),), rng)


def test_a_vain_search_ends_early_with_the_gaps_of_a_long_one(monkeypatch):
    finder = PostureFinder(tripod("PRS"))
    leg, home = finder.robot.legs[0], finder.solvers[0].home
    steps = np.random.default_rng(4).uniform(-0.4, 0.4, (30, 6))
    steps[:, 1] = np.where(np.abs(steps[:, 1]) < 0.05, 0.05, steps[:, 1])  # the plane of the leg
    pose, q = finder.home_pose + steps, np.tile(home, (30, 1))
    loops, asked, ask = loops_of_legs((leg,), (), finder.length), [], Loops.gaps_and_rates
    monkeypatch.setattr(Loops, "gaps_and_rates", lambda own, x: asked.append(len(x)) or ask(own, x))
    found = nearest(loops, np.hstack([pose, q]))
    early, least = sum(asked), np.abs(loops.gaps(found)).max(axis=-1)
    assert (least > 1e-3).all()
    monkeypatch.setattr(assembly_mode, "_STATIONARY", -1.0)
    found = nearest(loops, np.hstack([pose, q]))
    long = sum(asked) - early
    assert early < 0.75 * long
    wanted = np.abs(loops.gaps(found)).max(axis=-1)
    np.testing.assert_allclose(least, wanted, rtol=1e-5)
