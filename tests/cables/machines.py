"""Cable robots for tests, shipped and random, and parts of answers that must be there."""

from __future__ import annotations

import numpy as np

import robostiff as rs
from robostiff.analysis import CableResponse, CableStiffness, SlackEvent


def answered(response: CableResponse) -> CableStiffness:
    """What holds under the load."""
    assert response.after is not None
    return response.after


def slack_event(response: CableResponse) -> SlackEvent:
    """Where the first cable becomes slack."""
    assert response.first_slack is not None
    return response.first_slack


def random_robot(
    seed: int, cables: int = 8, *, weight: bool = True, winch: bool = True
) -> rs.CableRobot:
    """A cable robot around a platform of a tenth of its size, numbers without pattern."""
    rng = np.random.default_rng(seed)
    exits = rng.uniform(-2, 2, (cables, 3))
    exits *= (rng.uniform(2, 3, cables) / np.linalg.norm(exits, axis=-1))[:, None]
    return rs.CableRobot(
        "random",
        tuple(
            rs.Cable(
                f"cable{i}",
                exits[i],
                rng.uniform(-0.3, 0.3, 3),
                EA=rng.uniform(0.5e5, 2e5),
                guide_length=rng.uniform(0, 1),
                winch_stiffness=rng.uniform(1e5, 1e6) if winch else None,
                least_tension=rng.uniform(10, 50),
                greatest_tension=rng.uniform(500, 900),
            )
            for i in range(cables)
        ),
        home=rs.Frame.identity(),
        weight=rs.Weight([0, 0, -100.0], rng.uniform(-0.2, 0.2, 3)) if weight else None,
        reference_point=rng.uniform(-0.2, 0.2, 3),
    )
