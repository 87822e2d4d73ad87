"""The system over leg wrenches in 50 digits: slender beams, springs of any size, rigid links."""
# pyright: reportArgumentType=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportOptionalMemberAccess=false

from dataclasses import replace

import numpy as np
import pytest

from robostiff import compliance, deflection, stiffness
from robostiff.elasticity import Elasticity
from robostiff.elastostatics import Status
from robostiff.model import PlacedElement, Snapshot
from tests.campaign.reference import reference
from tests.generators.leg_wrenches import drive, passive_joint, random_beam, robot_of
from tests.generators.metric import distance

RIGHT = 1e-12
SEEDS = range(6)


def mixed(own: list[PlacedElement], rng: np.random.Generator) -> list[PlacedElement]:
    return [own[i] for i in rng.permutation(len(own))]


def slender(seed: int, slenderness: float) -> Snapshot:
    rng = np.random.default_rng(seed)
    legs = []
    for _ in range(rng.integers(1, 7)):
        beams = [random_beam(rng, slenderness) for _ in range(rng.integers(1, 3))]
        legs.append(mixed(beams + [passive_joint(rng) for _ in range(rng.integers(0, 6))], rng))
    return robot_of(legs, rng)


def of_different_springs(seed: int, decades: int) -> Snapshot:
    """Springs side by side and in series, that differ by 10^decades."""
    rng = np.random.default_rng(seed)
    legs = []
    for _ in range(rng.integers(1, 7)):
        beam, factor = random_beam(rng, 0.05), 10 ** rng.uniform(-decades / 2, decades / 2)
        beam = replace(beam, elasticity=Elasticity(beam.elasticity.compliance * factor))
        drives = [drive(rng, 10 ** rng.uniform(6 - decades, 6)) for _ in range(rng.integers(0, 4))]
        joints = [passive_joint(rng) for _ in range(rng.integers(0, 6))]
        legs.append(mixed([beam, *drives, *joints], rng))
    return robot_of(legs, rng)


def rigid_links(seed: int) -> Snapshot:
    """Drives alone are elastic: three legs that hold the platform, or a few more."""
    rng = np.random.default_rng(seed)
    legs = []
    for _ in range(rng.integers(2, 6)):
        drives = [drive(rng, 10 ** rng.uniform(4, 6)) for _ in range(rng.integers(1, 4))]
        legs.append(mixed(drives + [passive_joint(rng) for _ in range(rng.integers(2, 5))], rng))
    return robot_of(legs, rng)


def check(snapshot: Snapshot) -> None:
    result, exact = stiffness(snapshot), reference(snapshot)
    assert (Status.RIGID_DIRECTION in result.status) == (exact.K is None)
    if exact.K is not None:
        assert distance(result.K, exact.K) < RIGHT
    assert (int(result.rank) == 6) == (exact.C is not None)
    if exact.C is not None:
        assert distance(compliance(snapshot), exact.C) < RIGHT


@pytest.mark.parametrize("slenderness", [1e-3, 1e-4, 3e-5, 1e-5])
@pytest.mark.parametrize("seed", SEEDS)
def test_slender_beams_keep_their_digits(seed, slenderness):
    check(slender(seed, slenderness))


@pytest.mark.parametrize("decades", [6, 9, 12, 15])
@pytest.mark.parametrize("seed", SEEDS)
def test_stiff_springs_beside_soft_ones_keep_their_digits(seed, decades):
    check(of_different_springs(seed, decades))


@pytest.mark.parametrize("seed", range(20))
def test_rigid_links_have_the_compliance_of_their_drives(seed):
    check(rigid_links(seed))


@pytest.mark.parametrize("seed", range(20))
def test_what_the_legs_carry_of_a_load_balances_it_and_holds_its_energy(seed):
    snapshot = rigid_links(seed) if seed % 2 else slender(seed, 1e-4)
    if int(stiffness(snapshot).rank) < 6:
        return
    F = np.random.default_rng(seed).normal(size=6) * 100
    bent = deflection(snapshot, wrench=F)
    assert np.abs(np.sum(bent.leg_wrenches, axis=0) - F).max() < 1e-9 * np.abs(F).max()
    assert np.abs(bent.twist - compliance(snapshot) @ F).max() <= 1e-12 * np.abs(bent.twist).max()
    assert bent.energy == pytest.approx(sum(part.energy for part in bent.parts), rel=1e-9)
