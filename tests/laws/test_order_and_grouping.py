"""Passive joints may be eliminated in any order and in any groups."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robostiff.elastostatics import Recursive, SaddlePoint, WrenchBasis, chain_stiffness
from tests.generators.chains import FreeChain, chains, planar_chains
from tests.generators.metric import distance

ANY_CHAIN = st.one_of(chains(joints=st.integers(2, 5)), planar_chains(joints=st.integers(1, 2)))


@given(ANY_CHAIN, st.randoms(use_true_random=False))
def test_order_of_columns_and_groups_of_the_recursion(chain: FreeChain, random):
    C, J_q = chain.matrices()
    order = list(range(J_q.shape[1]))
    random.shuffle(order)
    result, shuffled = chain_stiffness(C, J_q), chain_stiffness(C, J_q[:, order])
    assert distance(shuffled.K, result.K) <= 1e-11
    assert int(shuffled.rank) == int(result.rank)
    assert np.count_nonzero(shuffled.redundant) == np.count_nonzero(result.redundant)
    groups, start = [], 0
    while start < len(order):
        stop = start + random.randint(1, 3)
        groups.append(tuple(order[start:stop]))
        start = stop
    K0 = np.linalg.inv(C)
    K = chain_stiffness(C, J_q, form=Recursive()).K
    grouped = chain_stiffness(C, J_q, form=Recursive(groups=tuple(groups))).K
    assert distance(grouped, K, sizes_of=K0) <= 1e-9


@pytest.mark.parametrize("form", [WrenchBasis(), SaddlePoint(), Recursive()])
@given(chain=chains(joints=st.integers(1, 4), arrangements=("general",)), factor=st.floats(-9, 9))
def test_size_and_sign_of_a_column_do_not_matter(chain: FreeChain, factor: float, form):
    C, J_q = chain.matrices()
    other = J_q * (10.0**factor) * np.where(np.arange(J_q.shape[1]) % 2, 1.0, -1.0)
    K0 = np.linalg.inv(C)
    K, K_other = (chain_stiffness(C, J, form=form).K for J in (J_q, other))
    assert distance(K_other, K, sizes_of=K0) <= 1e-11
