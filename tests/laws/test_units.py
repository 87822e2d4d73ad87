"""Ranks and statuses do not change with the unit of length or of force."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from tests.generators.chains import FreeChain, chains, planar_chains
from tests.generators.metric import distance, rounding

ANY_CHAIN = st.one_of(chains(), planar_chains(), chains(regular=False))


def in_millimetres(C: np.ndarray, chain: FreeChain, per_metre: float) -> tuple[np.ndarray, ...]:
    """C and J_q of the same chain with lengths in another unit, and the factors of a twist."""
    t = 3 if len(C) == 6 else 2
    s = np.array([per_metre] * t + [1.0] * (len(C) - t))
    J_q = chain.joint_columns(chain.end)
    # a slide is given per unit of length, a turn per radian
    slides = np.array([joint.pitch is None for joint in chain.joints], dtype=bool)
    J_other = J_q * s[:, None] / np.where(slides, per_metre, 1.0)
    return C * np.outer(s, s) / per_metre, J_other, s


@pytest.mark.parametrize("form", [rs.WrenchBasis(), rs.Recursive(), rs.Block(), rs.SaddlePoint()])
@given(chain=ANY_CHAIN, per_metre=st.sampled_from([1e3, 1e-3, 1 / 0.0254]))
def test_metres_to_millimetres_changes_nothing_but_units(chain: FreeChain, form, per_metre: float):
    C, J_q = chain.matrices()
    C_other, J_other, s = in_millimetres(C, chain, per_metre)
    result = rs.chain_stiffness(C, J_q, form=form)
    other = rs.chain_stiffness(C_other, J_other, form=form)
    if result.length != 1.0:  # metres: nothing in C or J_q gives a length, so none matters
        assert np.isclose(other.length, per_metre * result.length, rtol=1e-12)
    assert int(other.rank) == int(result.rank)
    assert other.status == result.status
    assert np.array_equal(other.redundant, result.redundant)
    if result.answered and rs.Status.ILL_CONDITIONED not in result.status:
        back = other.K * np.outer(s, s) / per_metre
        J_theta, _ = chain.spring_columns(chain.end)
        regular = np.linalg.matrix_rank(J_theta, tol=1e-8) == len(C)
        # the entries of C are rounded anew, and the forms feel that through its condition number
        sizes, allowed = (np.linalg.inv(C), rounding(C)) if regular else (result.K, 1e-10)
        assert distance(back, result.K, sizes_of=sizes) <= max(allowed, 1e-12)


@given(chains(), st.floats(-3, 3))
def test_the_length_asked_for_decides_no_rank(chain: FreeChain, exponent: float):
    C, J_q = chain.matrices()
    result = rs.chain_stiffness(C, J_q)
    other = rs.chain_stiffness(C, J_q, length=float(result.length) * 10**exponent)
    assert int(other.rank) == int(result.rank)
    assert distance(other.K, result.K, sizes_of=np.linalg.inv(C)) <= 1e-9
