"""Kernels with parameters, and maps of many blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import robostiff as rs

if TYPE_CHECKING:
    from tests.campaign.posed_ways import Case

_MANY = 4500  # poses: more than a chunk
_OF_MAPS = 3e-6  # of floats of 32 bits


def kernel_with_parameters(case: Case) -> None:
    """Parameters of a shipped robot as inputs of its kernel, in another order."""
    given = dict(case.posed.parameters)
    if not case.posed.shipped or not given or not case.good().size:
        return
    names = [str(name) for name in case.rng.permutation(list(given))]
    try:
        robot = rs.load(case.posed.shipped, symbols=tuple(names))
        fast = rs.compile(robot, parameters=names, backend=rs.Backend.ARRAYS)
    except (rs.InputError, rs.NoAnswerError):  # with the reason
        return
    found = fast.evaluate(case.free_coordinates(), parameters=given)
    for row in case.good():
        if int(case.batch.rank[row]) and found.status_codes[row] == case.batch.status_codes[row]:
            off = case.off(found.values["K"][row], case.K(row))
            if not off <= 1e-8:
                case.say("kernel with parameters", "another K", f"row {row}: {off:.2e}; {given}")


def map_of_blocks(case: Case) -> None:
    """A map of so many poses that it has several blocks, in memory."""
    robot, rng = case.robot, case.rng
    if case.posed.by_joints or not robot.coordinates:
        return
    which = rng.integers(len(case.posed.rows), size=_MANY)
    poses = rs.PoseList([c.value for c in robot.coordinates], case.posed.rows[which])
    method = rs.Batched() if rng.uniform() < 0.6 else rs.Compiled()
    try:
        found = rs.stiffness_map(robot, poses, [rs.Quantity.STIFFNESS], method=method)
    except (rs.InputError, rs.NoAnswerError):  # with the reason
        return
    K, codes = found["K"].values, found["status"].values
    good = set(case.good().tolist())
    for i in rng.permutation(_MANY)[:400]:
        row = int(which[i])
        if row not in good:
            continue
        if int(codes[i]) != int(case.batch.status_codes[row]):
            case.say("map", "another status", f"pose {i}: {codes[i]}")
            return
        exact = case.K(row)
        if not np.max(np.abs(K[i] - exact)) <= _OF_MAPS * np.max(np.abs(exact)):
            case.say("map", "another K", f"pose {i} of {_MANY}, row {row}, {method}")
            return
