"""Recorded legs with parallel blocks, against the batched form at the samples of the record."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import Phase, assume, given, settings

from robostiff.analysis import stiffness
from robostiff.elastostatics import Status
from robostiff.model import Snapshot
from robostiff.recorded import LegRecorder, stiffness_entries
from robostiff.spatial import Space
from tests.generators.chains import LENGTH
from tests.generators.metric import distance
from tests.generators.nested import nested_snapshots
from tests.recorded.at_samples import COUNT, LegAtPoints, symmetric


def check(snapshot: Snapshot) -> None:
    (leg,), size = snapshot.legs, snapshot.space.size
    own = LegAtPoints.of(leg, 2, snapshot.space)
    answers = [stiffness(replace(snapshot, legs=(own.at(k),))) for k in range(COUNT)]
    bad = Status.ILL_CONDITIONED | Status.RIGID_DIRECTION
    assume(not any(answer.status & bad for answer in answers))
    recorder = LegRecorder(own.record, snapshot.reference_point, snapshot.space, LENGTH)
    found = recorder.leg(own.leg)
    K = stiffness_entries([found], size)
    for k, answer in enumerate(answers):
        assert len(found.mu) >= int(answer.rank)  # ways around a loop may hold nothing
        assert distance(symmetric(K, size, k), answer.K) <= 1e-8


few = settings(max_examples=6, deadline=None, phases=(Phase.explicit, Phase.generate))


@few
@given(nested_snapshots(legs=1, depth=1))
def test_a_block_in_a_leg(snapshot):
    check(snapshot)


@few
@given(nested_snapshots(legs=1, depth=2, rigid=True, space=Space.PLANAR))
def test_blocks_in_blocks_in_the_plane(snapshot):
    check(snapshot)
