"""Kernels with parameters, maps of many blocks, and formulas of all symbols with some put in."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import robostiff as rs
from robostiff.errors import RobostiffError
from tests.campaign.formulas import coordinates_of

if TYPE_CHECKING:
    from tests.campaign.posed_ways import Case

_MANY = 4500  # poses: more than a chunk
_OF_MAPS = 3e-6  # of floats of 32 bits
_LONG = ("h4", "gantry-tau", "capaman")  # formulas of minutes


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


def formula_with_values(case: Case) -> None:
    """A formula of all symbols of a robot, some of which get values before the others."""
    posed, rng = case.posed, case.rng
    if not case.good().size or posed.shipped in _LONG or posed.by_joints:
        return
    given = dict(posed.parameters)
    try:
        robot = rs.load(posed.shipped, symbols=tuple(given)) if given else case.robot
        derivation: Any = rs.derive(robot, pose=rs.AtSymbols(), form=rs.Steps())
    except RobostiffError:
        return  # refused with words
    rows = [int(row) for row in case.good()]
    row = rows[rng.integers(len(rows))]
    known = coordinates_of(case, row, derivation)
    known = {str(s): {**known, **given}[str(s)] for s in derivation.symbols}
    first = [name for name in known if rng.uniform() < 0.5]
    if int(case.batch.rank[row]) == 0:
        return
    try:
        rest = derivation.subs({name: known[name] for name in first})
        K = rest.lambdify(*(str(s) for s in rest.symbols))(*(known[str(s)] for s in rest.symbols))
    except rs.InputError as error:
        case.say("formula with values", "refused", str(error)[:200])
        return
    off = case.off(np.asarray(K, dtype=float), case.K(row))
    if not off <= 1e-8:
        case.say("formula with values", "another K", f"row {row}: {off:.2e}; {first} of {known}")
