"""Shipped robots that can move."""

from collections.abc import Mapping

import numpy as np

import robostiff as rs
from robostiff.analysis.maps.evaluator import MapEvaluator
from robostiff.spatial.batch import empty_batch


def loaded(name: str, parameters: Mapping[str, float] | None = None) -> rs.Robot:
    robot = rs.load(name, parameters)
    assert isinstance(robot, rs.Robot)
    return robot


def values_at(evaluator: MapEvaluator, poses: np.ndarray) -> dict[str, np.ndarray]:
    """The variables of an evaluator at poses (N, n_coordinates)."""
    out = {v.name: empty_batch((len(poses),), v.shape, v.dtype) for v in evaluator.variables}
    evaluator.evaluate(poses, out)
    return out
