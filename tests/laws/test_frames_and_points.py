"""K_C is the same spring whatever axes and reference point it is given in, eq. (11)-(13)."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from robostiff.elastostatics import chain_stiffness
from robostiff.spatial import (
    move_compliance,
    move_stiffness,
    move_twist,
    move_wrench,
    rotate_stiffness,
    skew,
)
from tests.generators.chains import FreeChain, chains, planar_chains, random_rotation
from tests.generators.metric import distance

SEEDS = st.integers(0, 2**32 - 1)


@given(chains(), SEEDS)
def test_turning_everything_turns_the_matrix(chain: FreeChain, seed: int):
    R = random_rotation(np.random.default_rng(seed))
    K = chain_stiffness(*chain.matrices()).K
    turned = chain_stiffness(*chain.turned(R).matrices())
    expected = rotate_stiffness(K, R)
    assert distance(turned.K, expected) <= 1e-10


@given(st.one_of(chains(), planar_chains()), SEEDS)
def test_moving_the_reference_point(chain: FreeChain, seed: int):
    v = np.random.default_rng(seed).uniform(-2, 2, 3)
    v[2] = 0.0 if chain.planar else v[2]
    here = chain_stiffness(*chain.matrices())
    there = chain_stiffness(*chain.matrices(chain.end + v))
    K = move_stiffness(here.K, v[:2] if chain.planar else v)
    K0 = np.linalg.inv(chain.compliance(chain.end + v))
    # digits are lost on the way by the lever arms: measured by K0 as well
    assert distance(there.K, K, sizes_of=np.maximum(np.abs(K), 1e-3 * np.abs(K0))) <= 1e-10
    assert int(there.rank) == int(here.rank)
    assert there.status == here.status
    assert np.array_equal(there.redundant, here.redundant)


@given(chains(), SEEDS)
def test_compliance_moves_as_its_springs_do(chain: FreeChain, seed: int):
    v = np.random.default_rng(seed).uniform(-2, 2, 3)
    here, there = chain.compliance(chain.end), chain.compliance(chain.end + v)
    assert distance(move_compliance(here, v), there) <= 1e-12


@given(SEEDS)
def test_work_does_not_depend_on_the_point(seed: int):
    rng = np.random.default_rng(seed)
    t, F, v = rng.normal(size=6), rng.normal(size=6), rng.normal(size=3)
    assert np.isclose(move_wrench(F, v) @ move_twist(t, v), F @ t, rtol=0, atol=1e-13 * 10)


@given(SEEDS)
def test_moving_there_and_back(seed: int):
    rng = np.random.default_rng(seed)
    t, v = rng.normal(size=(3, 2, 6)), rng.normal(size=(3, 1, 3))
    assert np.allclose(move_twist(move_twist(t, v), -v), t, rtol=0, atol=1e-14 * 50)
    a, b = rng.normal(size=(2, 3))
    assert np.allclose(skew(a) @ b, np.cross(a, b), rtol=0, atol=1e-15 * 10)
