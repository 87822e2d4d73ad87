"""Random robots through every way.

Robot i of a run is made from (seed, i) alone.
"""
# pyright: reportArgumentType=false

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from tests.campaign import placed, posed, posed_ways, ways
from tests.campaign.answers import Complaint

#: How often each kind is drawn; what costs much is drawn less.
SHARES = {
    **dict.fromkeys(placed.KINDS, 32),
    **dict.fromkeys(("nested", "nested planar"), 24),
    **dict.fromkeys(posed.KINDS, 12),
    "file": 24,
    **dict.fromkeys(("several legs", "hand-made"), 4),
    **dict.fromkeys(("driven arm", "shipped"), 2),
    **dict.fromkeys(("coupled legs", "hybrid"), 0.5),
}


def kind_of(seed: int, number: int) -> tuple[str, np.random.Generator]:
    """Kind of robot `number` of a run, and what it is drawn with."""
    rng = np.random.default_rng([seed, number])
    names, weights = list(SHARES), np.array(list(SHARES.values()), dtype=float)
    return names[rng.choice(len(names), p=weights / weights.sum())], rng


def judged_robot(seed: int, number: int) -> list[Complaint]:
    """What is wrong with robot `number` of a run, by all the ways that it takes."""
    kind, rng = kind_of(seed, number)
    own = [seed, number, 1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if kind in placed.KINDS:
            complaints = ways.judged(placed.random_snapshot(rng, kind), own)[0].complaints
        else:
            robot = posed.random_posed(rng, kind)
            complaints = [] if robot is None else posed_ways.judged_posed(robot, own)
    return [replace(own, detail=f"{kind}: {own.detail}") for own in complaints]
