"""The forms of K_C are equal where they hold, and refuse with a reason where they do not."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.errors import NoAnswerError
from tests.generators.chains import FreeChain, chains, joint_rank, planar_chains
from tests.generators.metric import distance

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
