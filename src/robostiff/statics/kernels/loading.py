"""A robot under load as a record: Newton steps from the unloaded posture, and checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.elastostatics import Status
from robostiff.kinematics import PostureFinder
from robostiff.model import Robot
from robostiff.record import Program
from robostiff.recorded.closure import RecordedSteps
from robostiff.recorded.robot import RobotOnEntries
from robostiff.statics.chains.held_springs import joined_legs
from robostiff.statics.kernels.buckling import buckling_of
from robostiff.statics.kernels.leg import MovedBody, RecordedLoadedLeg, recorded_leg
from robostiff.statics.kernels.loaded_robot import HANDED, LoadedRobot
from robostiff.statics.kernels.springs import recorded_body_springs, with_anchors, without_anchors
from robostiff.statics.kernels.strut import RecordedStrut
from robostiff.statics.kernels.weights import (
    StandingLoads,
    framed,
    loads_on_legs,
    loads_on_platform,
    with_recorded_masses,
)
from robostiff.statics.loading.from_snapshot import walks_of
from robostiff.statics.loading.given_loads import acting_gravity
from robostiff.statics.loading.loaded_posture import LoadedPosture


@dataclass(frozen=True, kw_only=True)
class RecordedLoading(RecordedSteps):
    """Newton steps from the unloaded posture to equilibrium.

    Its inputs are coordinates of the posture, parameters, then the wrench; the first step leads to
    the linear answer.

    Attributes
    ----------
    arrival : Program
        To K (symmetric part, upper triangle), the shift and quaternion of the platform, where it
        has them the arms of dead forces on it (see `LoadedAnswer`), the square of the step that
        would be next, and a number that is positive where all checks hold.
    checks : tuple of str
        Checks of the unloaded posture, whose rows come before the last two.
    has_arms : bool
    status, rank : Status, int
        Without load, at a general pose.
    """

    checks: tuple[str, ...]
    has_arms: bool
    most_steps: int = 10
    status: Status = Status.OK
    rank: int = 6

    @property
    def state(self) -> dict[str, float]:
        """What the first step begins with."""
        return self.start | HANDED


def record_loading(
    robot: Robot,
    finder: PostureFinder,
    loaded_postures: Sequence[LoadedPosture],
    force: float,
    standing: StandingLoads,
    *,
    by_pose: bool,
) -> RecordedLoading:
    """Record the equilibrium of a robot, whose symbols are inputs.

    `finder` and `loaded_postures` have it in numbers, the latter at several postures. Under `force`
    [N] the platform moves by about a thousandth of the robot's length. The other inputs are pose
    coordinates (`by_pose`), or the coordinates of all legs.
    """
    gravity = acting_gravity(robot.numeric, standing.gravity, standing.loads)
    springs = finder.robot.springs
    here = RobotOnEntries.of(
        robot,
        finder,
        by_pose=by_pose,
        changed=lambda leg: with_anchors(framed(leg) if np.any(gravity) else leg, springs),
    )
    here, frames = without_anchors(here)
    if np.any(gravity):
        here = with_recorded_masses(here)
    record, unloaded = here.record, here.recorded
    random, count = np.random.default_rng(7), record.count
    # Some samples are without load: what vanishes there is no pivot.
    shares = np.resize(np.array([0.0, 1.0, 0.5]), count)

    def small(size: float) -> np.ndarray:
        return shares * size * random.uniform(-1, 1, count)

    rows = zip(robot.space.wrench_order, robot.space.rows, strict=True)
    sizes = {name: force * (1.0 if row < 3 else finder.length) for name, row in rows}
    wrench = [record.add_input(name, small(size)) for name, size in sizes.items()]
    inputs = record.inputs
    dead, forces = loads_on_platform(here, standing, gravity)
    snapshot = loaded_postures[0].snapshot
    walks = [] if snapshot is None else walks_of(snapshot, standing.beams)
    on_legs = [own.leg for own in here.placed]
    loads = loads_on_legs(walks, on_legs, forces, gravity)
    placed = () if snapshot is None else snapshot.springs
    held = recorded_body_springs(springs, placed, here, frames, walks)
    each = zip(walks, on_legs, unloaded.legs, loads, strict=True)
    legs = [
        recorded_leg(*own, standing.preload or {}, unloaded, [s for s in held if k in s.legs])
        for k, own in enumerate(each)
    ]
    struts = {k: leg for k, leg in enumerate(legs) if isinstance(leg, RecordedStrut)}
    others = {k: leg for k, leg in enumerate(legs) if isinstance(leg, RecordedLoadedLeg)}
    groups = joined_legs([*({k} for k in others), *(own.legs for own in held if own.legs)])
    loaded = LoadedRobot(
        unloaded,
        [RecordedLoadedLeg.joined({k: others[k] for k in own}) for own in groups],
        struts,
        buckling_of([own.problem for own in loaded_postures], [*struts], force),
        MovedBody("platform", here.reference),
        robot.space,
        finder.length,
        force,
        wrench,
        dead,
        held,
        stands=bool(dead or held or standing.loads or standing.preload or np.any(gravity)),
    )
    start = loaded.start
    lengths = dict.fromkeys(loaded.platform.coordinates[:3], 1e-3 * finder.length)
    for name, size in (lengths | dict.fromkeys(loaded.platform.coordinates[3:], 1e-3)).items():
        record.add_input(name, small(size) if start[name] == 0.0 else start[name])
    for leg in loaded.legs:
        for name, sample in leg.samples(shares, force, random).items():
            record.add_input(name, sample)
    for name in HANDED:
        record.add_input(name, 1.0)
    values = {name: record.input(name) for name in record.inputs}
    at = loaded.equations(values)
    outputs, checks = loaded.arrival(values, at)
    return RecordedLoading(
        inputs=inputs,
        start=start,
        step=Program.of(record, loaded.step(values, at, at.factored.solved(at.right))),
        arrival=Program.of(record, outputs),
        first_steps=4 if struts else 1,
        first=Program.of(record, loaded.first(values)),
        checks=tuple(checks),
        has_arms=bool(loaded.dead),
        status=unloaded.status,
        rank=unloaded.factors.rank,
    )
