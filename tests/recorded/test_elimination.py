"""Recorded legs against `chain_stiffness`, over random chains, in every working frame."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st

from robostiff import InputError
from robostiff.elasticity import Elasticity
from robostiff.elastostatics import Status, chain_stiffness
from robostiff.kinematics import leg_compliance, passive_jacobian
from robostiff.model import Passive, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.recorded import LegRecorder, stiffness_entries
from robostiff.spatial import Space
from tests.generators.chains import LENGTH, FreeChain, chains, planar_chains
from tests.generators.metric import distance, rounding
from tests.recorded.at_samples import COUNT, LegAtPoints, symmetric


def matrices(leg: PlacedLeg, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return leg_compliance(leg, at), passive_jacobian(leg, at)[0]


@settings(max_examples=20, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(
    st.one_of(
        *(chains(), chains(), chains(joints=st.just(0))),
        *(chains(regular=False, joints=st.integers(3, 5)),) * 2,  # with few springs
    ),
    st.integers(0, 2**16),
)
def test_as_the_wrench_basis_form(chain: FreeChain, seed: int):
    own, reference = LegAtPoints.of(chain.placed(), seed), chain.end
    answers, C_all = [], []
    for k in range(COUNT):
        C, J_q = matrices(own.at(k), reference)
        answers.append(chain_stiffness(C, J_q, length=LENGTH))
        C_all.append(C)
    bad = int(Status.ILL_CONDITIONED | Status.RIGID_DIRECTION)
    assume(all(int(a.status_codes) & bad == 0 for a in answers))
    recorded = LegRecorder(own.record, reference, Space.SPATIAL, LENGTH).leg(own.leg)
    K = stiffness_entries([recorded], 6)
    for k, answer in enumerate(answers):
        assert len(recorded.mu) == int(answer.rank)
        allowed = max(1e-9, rounding(C_all[k]))
        assert distance(symmetric(K, 6, k), answer.K) <= allowed
        assert sum(recorded.redundant) == sum(np.ravel(answer.redundant))


@settings(max_examples=12, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(planar_chains(), st.integers(0, 2**16))
def test_in_the_plane(chain: FreeChain, seed: int):
    own = LegAtPoints.of(chain.placed(), seed)
    plane = [0, 1, 5]
    C, J_q = matrices(own.at(0), chain.end)
    answer = chain_stiffness(C[plane][:, plane], J_q[plane], length=LENGTH)
    assume(int(answer.status_codes) & int(Status.ILL_CONDITIONED | Status.RIGID_DIRECTION) == 0)
    recorded = LegRecorder(own.record, chain.end, Space.PLANAR, LENGTH).leg(own.leg)
    K = symmetric(stiffness_entries([recorded], 3), 3)
    assert distance(K, answer.K) <= max(1e-9, rounding(C))


def test_springs_with_freedoms_of_their_own():
    """A link that turns freely about its axis is a link and a passive turn."""
    point, R = np.array([0.1, -0.2, 0.3]), np.eye(3)
    compliance = np.diag([1e-6, 2e-6, 3e-6, 0.0, 2e-4, 3e-4])
    free = Elasticity(compliance, np.array([[0, 0, 0, 1.0, 0, 0]]).T)
    joined = PlacedLeg("leg", (PlacedSpring("link", point, R, free),), point)
    apart = PlacedLeg(
        "leg",
        (
            PlacedSpring("link", point, R, Elasticity(compliance)),
            PlacedFreedom(np.array([1.0, 0, 0]), point, 0.0, "turn", Passive()),
        ),
        point,
    )
    reference = np.array([0.5, 0.4, 0.0])
    found = []
    for leg, frame in ((joined, None), (apart, None), (apart, 99)):  # that of another leg
        own = LegAtPoints.of(leg, 0)
        recorded = LegRecorder(own.record, reference, Space.SPATIAL, 1.0).leg(own.leg, frame)
        found.append(symmetric(stiffness_entries([recorded], 6), 6))
    assert np.abs(found[0] - found[1]).max() <= 1e-9 * np.abs(found[1]).max()
    assert np.abs(found[2] - found[1]).max() <= 1e-9 * np.abs(found[1]).max()
    assert np.abs(found[0]).max() > 0


def test_a_rigid_leg_is_refused_by_name():
    point = np.zeros(3)
    spring = PlacedSpring("s", point, np.eye(3), Elasticity(np.diag([1e-6, 0, 0, 0, 0, 0])))
    leg = PlacedLeg("stiff one", (spring,), point)
    own = LegAtPoints.of(leg, 0)
    with pytest.raises(InputError, match="leg 'stiff one'"):
        LegRecorder(own.record, np.ones(3), Space.SPATIAL, 1.0).leg(own.leg)
