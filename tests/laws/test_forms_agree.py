"""The forms of K_C are equal where they hold, and refuse with a reason where they do not.

That K is right, of one rank, and the same in other units and frames is in tests/campaign.
"""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.errors import NoAnswerError
from tests.cases.metric import distance
from tests.generators.chains import FreeChain, chains, joint_rank, planar_chains

# What each form needs: independent joints, and a compliance that can be inverted.
FORMS = [(rs.SaddlePoint(), True, False), (rs.Block(), True, True), (rs.Recursive(), False, True)]


@pytest.mark.parametrize(("form", "needs_independent", "needs_regular"), FORMS)
@given(chain=st.one_of(chains(), planar_chains(), chains(regular=False)))
def test_equal_where_they_hold_and_refuse_where_not(
    chain: FreeChain, form, needs_independent: bool, needs_regular: bool
):
    C, J_q = chain.matrices()
    default = rs.chain_stiffness(C, J_q)
    result = rs.chain_stiffness(C, J_q, form=form)
    J_theta, _ = chain.spring_columns(chain.end)
    independent = joint_rank(J_q) == J_q.shape[1]
    regular = np.linalg.matrix_rank(J_theta, tol=1e-8) == len(C)
    holds = (
        (independent or not needs_independent)
        and (regular or not needs_regular)
        and bool(default.answered)
    )
    assert bool(result.answered) == holds
    assert int(result.rank) == int(default.rank)
    if holds:
        # the forms that invert C lose digits with its condition number, so they are measured by K0
        sizes = np.linalg.inv(C) if needs_regular else default.K
        if rs.Status.ILL_CONDITIONED not in result.status:
            assert distance(result.K, default.K, sizes_of=sizes) <= 1e-9
    else:
        with pytest.raises(NoAnswerError):
            _ = result.K
    if not regular and needs_regular:
        assert rs.Status.FORM_DOES_NOT_HOLD in result.status
        assert "rank(J_theta)" in result.reason
    if not independent and needs_independent:
        assert rs.Status.FORM_DOES_NOT_HOLD in result.status
        assert "redundant" in result.reason


@given(chains(arrangements=("aligned",)))
def test_index_rules_on_joints_along_the_axes(chain: FreeChain):
    C, J_q = chain.matrices()
    result = rs.chain_stiffness(C, J_q, form=rs.IndexRules())
    default = rs.chain_stiffness(C, J_q)
    if rs.Status.ILL_CONDITIONED not in result.status:
        assert distance(result.K, default.K, sizes_of=np.linalg.inv(C)) <= 1e-9


@given(planar_chains())
def test_index_rules_in_the_plane(chain: FreeChain):
    C, J_q = chain.matrices()
    result = rs.chain_stiffness(C, J_q, form=rs.IndexRules())
    slides = [joint for joint in chain.joints if joint.pitch is None]
    if slides:  # all oblique
        # a slide that adds no freedom to those before is passed over, whatever its direction
        if rs.Status.FORM_DOES_NOT_HOLD not in result.status:
            assert len(chain.joints) > joint_rank(J_q)
    else:
        default = rs.chain_stiffness(C, J_q)
        if rs.Status.ILL_CONDITIONED not in result.status:
            assert distance(result.K, default.K, sizes_of=np.linalg.inv(C)) <= 1e-9


@given(chains(joints=st.integers(1, 4), arrangements=("general",)))
def test_index_rules_refuse_oblique_joints(chain: FreeChain):
    C, J_q = chain.matrices()
    result = rs.chain_stiffness(C, J_q, form=rs.IndexRules())
    assert rs.Status.FORM_DOES_NOT_HOLD in result.status
    assert "oblique" in result.reason


@pytest.mark.parametrize("form", [rs.WrenchBasis(), rs.SaddlePoint(), rs.Recursive()])
@given(
    chain=st.one_of(chains(joints=st.integers(2, 4), arrangements=("general",)),
                    planar_chains(joints=st.integers(1, 2))),
    random=st.randoms(use_true_random=False), factor=st.floats(-9, 9), exponent=st.floats(-3, 3),
)  # fmt: skip
def test_order_groups_and_sizes_of_columns_and_the_length_do_not_matter(
    chain: FreeChain, random, factor: float, exponent: float, form
):
    C, J_q = chain.matrices()
    n, groups, start = J_q.shape[1], [], 0
    order = random.sample(range(n), n)
    while start < n:
        groups.append(tuple(order[start : start + random.randint(1, 3)]))
        start += len(groups[-1])
    if isinstance(form, rs.Recursive):
        form = rs.Recursive(groups=tuple(groups))
    result = rs.chain_stiffness(C, J_q)
    if isinstance(form, rs.SaddlePoint) and np.any(result.redundant):
        return  # it does not hold
    other = J_q[:, order] * (10.0**factor) * np.where(np.arange(n) % 2, 1.0, -1.0)
    length: dict[str, Any] = {"length": float(result.length) * 10**exponent}
    for given_columns, more in ((J_q[:, order], {}), (other, {}), (J_q, length)):
        found = rs.chain_stiffness(C, given_columns, form=form, **more)
        assert int(found.rank) == int(result.rank)
        assert np.count_nonzero(found.redundant) == np.count_nonzero(result.redundant)
        assert distance(found.K, result.K, sizes_of=np.linalg.inv(C)) <= 1e-9
