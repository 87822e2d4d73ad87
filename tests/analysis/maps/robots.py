"""Shipped robots that can move."""

import numpy as np

from robostiff.analysis.maps.evaluator import MapEvaluator
from robostiff.spatial.batch import empty_batch


def values_at(evaluator: MapEvaluator, poses: np.ndarray) -> dict[str, np.ndarray]:
    """The variables of an evaluator at poses (N, n_coordinates)."""
    out = {v.name: empty_batch((len(poses),), v.shape, v.dtype) for v in evaluator.variables}
    evaluator.evaluate(poses, out)
    return out
