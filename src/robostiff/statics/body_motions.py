"""Where the bodies of a robot are at a state: each as a motion from the unloaded posture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from robostiff.statics.problem import EquilibriumProblem, State


@dataclass(frozen=True)
class BodyPlace:
    """A body that has moved: a point X of the unloaded posture is now at ``R X + t``."""

    R: np.ndarray
    t: np.ndarray


@dataclass(frozen=True)
class BodyPlaces:
    """The bodies of a robot at a state.

    Attributes
    ----------
    behind : mapping of str to BodyPlace
        By ``leg/part``: the body behind that joint or elastic part. Rigid joints are not listed:
        the body behind them is that before.
    platform : BodyPlace
    """

    behind: Mapping[str, BodyPlace]
    platform: BodyPlace

    def since(self, other: BodyPlaces, times: float = 1.0) -> BodyPlaces:
        """How far all bodies have moved since another state, so many times, beside no motion."""
        return BodyPlaces(
            {name: _since(own, other.behind[name], times) for name, own in self.behind.items()},
            _since(self.platform, other.platform, times),
        )


def body_places(problem: EquilibriumProblem, state: State) -> BodyPlaces:
    """The bodies of a robot at a state, by the parts before them."""
    found = {}
    for group, own in zip(problem.groups, state.legs, strict=True):
        for c, (chain, moved) in enumerate(zip(group.chains, group.moved(own), strict=True)):
            for element, place in zip(chain.elements, moved.placements[1:], strict=True):
                for row, _, leg in group.rows_of(c):
                    name = f"{leg}/{element.names[row]}"  # the last element of a beam counts
                    found[name] = BodyPlace(place.R[row], place.t[row])
    return BodyPlaces(found, BodyPlace(state.R, state.p - state.R @ problem.point))


def _since(own: BodyPlace, other: BodyPlace, times: float) -> BodyPlace:
    return BodyPlace(np.eye(3) + times * (own.R - other.R), times * (own.t - other.t))
