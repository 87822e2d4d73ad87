"""A part of the campaign, and what it stands on."""
# pyright: reportOptionalMemberAccess=false

import itertools
import sys
from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.network import energy_stiffness, network_of_snapshot
from tests.campaign import loads, placed, ways
from tests.campaign.__main__ import PARTS, main
from tests.campaign.reference import reference
from tests.campaign.robots import judged_robot, kind_of
from tests.cases.metric import distance
from tests.cases.reference_case import NAMES, case

SEED = 2026
#: Robots frozen at a pose take 0.1 s of processor, posed ones 1 to 2 s.
FROZEN, POSED = 100, 4
#: How many of them run with `make test`.
FEW_FROZEN, FEW_POSED = 24, 2


@pytest.mark.parametrize(
    ("frozen", "part"),
    [
        pytest.param(True, slice(FEW_FROZEN), id="few at a pose"),
        pytest.param(True, slice(FEW_FROZEN, FROZEN), id="more", marks=pytest.mark.slow),
        pytest.param(False, slice(FEW_POSED), id="few with poses"),
        pytest.param(False, slice(FEW_POSED, POSED), id="more poses", marks=pytest.mark.slow),
    ],
)
def test_random_robots_through_every_way(frozen, part):
    numbers = (n for n in itertools.count() if (kind_of(SEED, n)[0] in placed.KINDS) is frozen)
    for number in itertools.islice(numbers, part.start, part.stop):
        assert not judged_robot(SEED, number)


@pytest.mark.parametrize("name", NAMES)
def test_reference_networks_and_energies_are_those_of_two_other_ways_in_sixty_digits(name):
    given = case(name)
    network, rank = network_of_snapshot(given.snapshot), given.oracle["rank"]
    found, solved = reference(given.snapshot), rs.stiffness(network)
    assert found.K is not None
    assert found.rank == int(solved.rank) == rank
    assert distance(found.K, given.K, given.size) < 1e-14
    assert distance(solved.K, given.K, given.size) < 1e-12
    assert distance(energy_stiffness(network), given.K, given.size) < 1e-10
    alone = rs.stiffness(given.snapshot)
    assert set(solved.redundant_joints) == set(alone.redundant_joints)
    assert rs.verify(given.snapshot).agree


@pytest.mark.parametrize(
    ("kind", "spread"),
    [("thin", False), ("thin", True), ("drives", False), ("drives", True), ("mixed", False)],
)
def test_thin_beams_rigid_links_and_springs_of_any_size_keep_their_digits(kind, spread):
    """K and the compliance have twelve; legs carry a load together, and parts hold its energy."""
    held = 0
    for seed in range(16):
        rng = np.random.default_rng([SEED, seed])
        snapshot = placed.KINDS[kind](rng)
        if spread:
            snapshot = placed.PECULIARITIES["spread"](rng, snapshot)
        end = snapshot.reference_point
        snapshot = replace(snapshot, legs=tuple(replace(leg, end=end) for leg in snapshot.legs))
        found, exact = rs.stiffness(snapshot), reference(snapshot)
        if found.status & rs.Status.ILL_CONDITIONED:
            continue
        assert (rs.Status.RIGID_DIRECTION in found.status) == (exact.K is None)
        if exact.K is not None:
            assert distance(found.K, exact.K) < 1e-12
        assert (int(found.rank) == 6) == (exact.C is not None)
        if exact.C is not None:
            held += 1
            C, F = rs.compliance(snapshot), rng.normal(size=6) * 100
            assert distance(C, exact.C) < 1e-12
            bent = rs.deflection(snapshot, wrench=F)
            assert np.allclose(np.sum(bent.leg_wrenches, axis=0), F, rtol=0, atol=1e-7)
            assert np.abs(bent.twist - C @ F).max() <= 1e-12 * np.abs(bent.twist).max()
            energy = sum(part.energy for part in bent.parts)
            assert bent.energy == pytest.approx(energy, rel=1e-9, abs=1e-25)
    assert held > 4


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


@pytest.mark.parametrize(
    ("kind", "numbers"),
    [
        ("robots", range(2)),
        pytest.param("robots", range(2, 24), marks=pytest.mark.slow),
        ("networks", range(8)),
        ("cables", range(12, 16)),
    ],
)
@pytest.mark.filterwarnings("ignore::robostiff.PlausibilityWarning")
def test_machines_under_loads(kind, numbers):
    for number in numbers:
        assert not loads.SHARES[kind][1](np.random.default_rng([SEED, number])), number


def test_what_rigid_bars_carry_beside_redundant_joints():
    """The base gets what acts on the platform, to all digits."""
    assert not loads.loaded_linkage(np.random.default_rng([77, 188]))


def test_all_parts_run_one_after_the_other(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["campaign", "--count", "1", "--processes", "1"])
    assert main() == 0
    printed = capsys.readouterr().out
    assert [line for line in printed.splitlines() if line.startswith("==")] == [
        f"== {part}, seed 1" for part in PARTS
    ]
