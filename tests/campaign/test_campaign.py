"""A part of the campaign, and what it stands on."""

import numpy as np
import pytest

import robostiff as rs
from tests.campaign import placed, ways
from tests.campaign.reference import reference
from tests.campaign.robots import run_part
from tests.cases.metric import distance
from tests.cases.reference_case import NAMES, case

SEED = 2026
ROBOTS = 300


@pytest.mark.parametrize("part", range(4))
def test_random_robots_through_every_way(part):
    tally = run_part(SEED, range(part, ROBOTS, 4), None)
    assert not tally.failures, tally.details


@pytest.mark.parametrize("name", NAMES)
def test_reference_is_that_of_two_other_ways_in_sixty_digits(name):
    given = case(name)
    found = reference(given.snapshot)
    assert found.K is not None
    assert found.rank == given.oracle["rank"]
    assert distance(found.K, given.K, given.size) < 1e-14


def test_a_wrong_spring_is_found():
    """The judge hears a difference of a part in 10^8."""
    snapshot = placed.random_snapshot(np.random.default_rng(1), "thin")
    truth = reference(snapshot)
    assert truth.K is not None
    judge = ways.Judge(truth, 1.0, False)
    K = truth.K.copy()
    K[0, 0] += 1e-8 * K[0, 0]
    judge.hear(ways.Answer("wrong", K, rs.Status(0), truth.rank), None)
    assert judge.complaints
