"""Recorded legs with parallel blocks, against the batched form at the samples of the record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import Phase, assume, given, settings

from robostiff.analysis import stiffness
from robostiff.elastostatics import Status
from robostiff.model import PlacedBlock, PlacedLeg, Snapshot
from robostiff.record import Record
from robostiff.recorded import LegRecorder, stiffness_entries
from robostiff.spatial import Space
from tests.generators.chains import LENGTH
from tests.generators.metric import distance
from tests.generators.nested import nested_snapshots
from tests.recorded.at_samples import samples, symmetric

COUNT = 3


def points_of(leg: PlacedLeg) -> list[tuple[float, ...]]:
    return sorted({tuple(e.point.tolist()) for e in leg.parts})


def with_points(leg: PlacedLeg, place) -> PlacedLeg:
    """The leg with each point p in place of which `place(p)` stands."""
    elements = tuple(
        PlacedBlock(e.name, tuple(with_points(branch, place) for branch in e.branches))
        if isinstance(e, PlacedBlock)
        else replace(e, point=place(e.point))
        for e in leg.elements
    )
    return PlacedLeg(leg.name, elements, leg.end)


def check(snapshot: Snapshot) -> None:
    """Points of the leg are inputs near their own; equal points share theirs."""
    (leg,) = snapshot.legs
    rng = np.random.default_rng(2)
    points = points_of(leg)
    rows = list(snapshot.space.rows)
    axes = range(3 if snapshot.space is Space.SPATIAL else 2)
    shifts = {
        f"p{n}{i}": p[i] + 0.03 * rng.uniform(-1, 1, COUNT)
        for n, p in enumerate(points)
        for i in axes
    }
    record = Record(shifts)
    number = {p: n for n, p in enumerate(points)}

    def recorded(point: np.ndarray) -> np.ndarray:
        n = number[tuple(point.tolist())]
        return np.array(
            [record.input(f"p{n}{i}") if i in axes else point[i] for i in range(3)], dtype=object
        )

    own = with_points(leg, recorded)
    answers = [
        stiffness(
            replace(snapshot, legs=(with_points(leg, lambda p, k=k: samples(recorded(p), k)),))
        )
        for k in range(COUNT)
    ]
    bad = Status.ILL_CONDITIONED | Status.RIGID_DIRECTION
    assume(not any(answer.status & bad for answer in answers))
    found = LegRecorder(record, snapshot.reference_point, snapshot.space, LENGTH).leg(own)
    K = stiffness_entries([found], len(rows))
    for k, answer in enumerate(answers):
        assert len(found.mu) >= int(answer.rank)  # ways around a loop may hold nothing
        assert distance(symmetric(K, len(rows), k), answer.K) <= 1e-8


few = settings(max_examples=6, deadline=None, phases=(Phase.explicit, Phase.generate))


@few
@given(nested_snapshots(legs=1, depth=1))
def test_a_block_in_a_leg(snapshot):
    check(snapshot)


@few
@given(nested_snapshots(legs=1, depth=2, rigid=True, space=Space.PLANAR))
def test_blocks_in_blocks_in_the_plane(snapshot):
    check(snapshot)
