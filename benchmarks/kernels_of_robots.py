"""The second table of `kernels.py`: operations and times of the kernels of other robots."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from batched_stiffness import K_ACTUATOR, with_elastic_actuators
from scipy.spatial.transform import RigidTransform, Rotation
from timed_rows import Row, kernel_run, timed

import robostiff as rs
from robostiff.analysis.compiled_stiffness import compile_stiffness
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.compiled import StiffnessMatrix, kernel_of
from robostiff.kinematics import JointCoordinates, PostureFinder
from robostiff.model import Chain, Coordinate, Passive, Robot, universal
from robostiff.recorded import record_at_joints, record_robot

SHIPPED = ("hexapod", "3-puu", "3-rrr", "3-rpr-beams", "tripteron", "six-joint-arm")
ALLOWED = 1e-9


def with_universal_ends(robot: Robot) -> Robot:
    """A hexapod whose legs have universal joints at both ends: over-constrained.

    The joint at the platform undoes the turns of the one at the base, so the platform is only
    shifted; each leg also holds it against turning, by a couple across the axes of its joints.
    """
    legs = []
    for leg in robot.legs:
        base_joint, telescope, _ = leg.chain.elements
        chain = Chain((base_joint, telescope, universal([-1, 0, 0], [0, 1, 0], Passive())))
        turn = Rotation.from_matrix(leg.base.R)
        attachment = RigidTransform.from_components(leg.attachment.p, turn)
        legs.append(replace(leg, chain=chain, attachment=attachment))
    translations = (Coordinate.X, Coordinate.Y, Coordinate.Z)
    return replace(robot, legs=tuple(legs), coordinates=translations)


def over_constrained() -> Robot:
    robot: Any = rs.load("gough-stewart-b-beams")
    return with_universal_ends(with_elastic_actuators(robot, K_ACTUATOR))


ROBOTS: dict[str, Callable[[], Any]] = {
    **{name: (lambda name=name: rs.load(name)) for name in SHIPPED},
    "hexapod, legs U-P-U": over_constrained,
}


def robots_table(count: int, turns: int) -> None:
    print(f"\n{'robot':24}{'inputs':>7}{'operations':>11}{'record s':>9}{'compile s':>10}", end="")
    print(f"{'us, K':>9}{'and rank':>10}{'K':>10}")
    for name, made in ROBOTS.items():
        robot = made()
        finder = PostureFinder(robot)
        start = time.perf_counter()
        closed = robot.home is not None and all(s.closed_form for s in finder.solvers)
        recorded = (record_robot if closed else record_at_joints)(robot, finder)
        record_time = time.perf_counter() - start
        base = recorded.record
        samples = np.array([base.input(x).sample for x in base.inputs])
        inputs = np.ascontiguousarray(np.tile(samples, -(-count // samples.shape[1])))
        kernels = [
            kernel_of(recorded, [StiffnessMatrix()], has_flags=has_flags)
            for has_flags in (False, True)
        ]
        start = time.perf_counter()
        kernels[0].evaluate(samples)
        compile_time = time.perf_counter() - start
        rows = [Row("", inputs.shape[1], kernel_run(kernel, inputs)) for kernel in kernels]
        timed(rows, turns)
        K, rank = (row.microseconds for row in rows)
        print(f"{name:24}{len(base.inputs):7}{kernels[0].operations:11}", end="")
        print(f"{record_time:9.2f}{compile_time:10.2f}{K:9.4f}{rank:10.4f}", end="")
        apart = largest_difference(robot, finder)
        print(f"{apart:10.0e}" if apart <= ALLOWED else "     WRONG", flush=True)


def largest_difference(robot: Robot, finder: PostureFinder, count: int = 200) -> float:
    """Of K, as a part of sqrt(K_ii K_jj), from the direct form where the kernel answers."""
    rng = np.random.default_rng(0)
    if robot.home is None:
        home = robot.legs[0].chain.home
        pose: Any = JointCoordinates(home + rng.uniform(-0.1, 0.1, (count, home.size)))
    else:
        names = list(Coordinate)
        home = finder.home_pose[[names.index(c) for c in robot.coordinates]]
        pose = home + rng.uniform(-0.05, 0.05, (count, home.size))
    answer = compile_stiffness(robot).evaluate(pose, again=False)
    result = direct_stiffness(robot, pose)
    own = ~answer.guarded & result.answered
    if not own.any():
        return np.inf
    K = result.details().matrix[own]
    size = np.sqrt(np.einsum("nii->ni", K))
    size = np.maximum(size, 1e-6 * size.max(axis=-1, keepdims=True))  # what rounding leaves of 0
    allowed = size[:, :, None] * size[:, None, :]
    return float(np.max(np.abs(answer.values["K"][own] - K) / allowed))
