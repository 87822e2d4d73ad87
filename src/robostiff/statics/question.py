"""What is asked of a robot under load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.result import require_one_pose
from robostiff.errors import InputError
from robostiff.kinematics import Near, Posture, find_posture, with_body_springs, with_masses
from robostiff.kinematics.turn import turn_by_vector
from robostiff.linkage import Linkage
from robostiff.linkage.network_at import network_at
from robostiff.model import Robot, Snapshot
from robostiff.network import Network
from robostiff.spatial import Space, as_float, as_floats
from robostiff.statics.beam_bowing import Beams
from robostiff.statics.from_network import group_of
from robostiff.statics.from_snapshot import legs_of
from robostiff.statics.given_loads import (
    Gravity,
    Loads,
    acting_gravity,
    arms_and_forces,
    given_forces,
    platform_weights,
)
from robostiff.statics.joint_laws import Laws, check_own_laws, with_laws
from robostiff.statics.problem import EquilibriumProblem
from robostiff.statics.status import EquilibriumStatus


@dataclass(frozen=True)
class Question:
    """A robot at one posture with its loads, ready to be solved.

    Attributes
    ----------
    name : str
    problem : EquilibriumProblem
    space : Space
    frame : tuple of (3, 3) and (3,) arrays
        Axes and origin of the platform frame at the unloaded posture [m].
    status : EquilibriumStatus
        What is to be said of the posture.
    snapshot : Snapshot or None
        At that posture; None of a network.
    laws : Laws
        That the robot has.
    """

    name: str
    problem: EquilibriumProblem
    space: Space
    frame: tuple[np.ndarray, np.ndarray]
    status: EquilibriumStatus
    snapshot: Snapshot | None
    laws: Laws = field(default_factory=dict)

    def under(self, laws: Laws | None) -> Question:
        """The same, joints following the laws of the robot, or given ones in their place."""
        all_laws = {**self.laws, **(laws or {})}
        if not all_laws:
            return self
        groups = with_laws(self.problem.groups, all_laws)
        return replace(self, problem=replace(self.problem, groups=groups))


def one_question(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Any,
    wrench: ArrayLike | None,
    at: ArrayLike | None,
    loads: Loads | None,
    preload: Mapping[str, Any] | None,
    beams: Beams,
    near: Near,
    gravity: Gravity = None,
    *,
    masses: bool = False,
) -> tuple[Question, np.ndarray]:
    """A robot at one posture, and one wrench (r,); its `masses` are there also without gravity."""
    postures = postures_of(robot, pose, near)
    given = wrenches_of("wrench", wrench, postures.robot.space)
    require_one_pose("a robot under load", postures.batch)
    if given.ndim > 1:
        raise InputError("wrench", got=wrench, expected="one wrench")
    return postures.question(0, at, loads, preload, beams, gravity, masses=masses), given


@dataclass(frozen=True)
class Postures:
    """The unloaded postures of a robot."""

    robot: Robot | Snapshot
    posture: Posture | None
    batch: tuple[int, ...]

    def question(
        self,
        i: int,
        at: ArrayLike | None,
        loads: Loads | None,
        preload: Mapping[str, Any] | None,
        beams: Beams,
        gravity: Gravity = None,
        *,
        masses: bool = False,
    ) -> Question:
        """What is asked at posture i."""
        pull = acting_gravity(self.robot, gravity)
        if self.posture is None:
            snapshot, status = self.robot, EquilibriumStatus.OK
            if not isinstance(snapshot, Snapshot):
                raise TypeError("a snapshot has no posture")
            frame = (np.eye(3), np.asarray(snapshot.reference_point, dtype=float))
        else:
            k = i if self.batch else 0
            own = self.posture
            placed = with_masses(own) if masses or np.any(pull) else own.snapshot
            snapshot = replace(placed, springs=with_body_springs(own).springs).one(k)
            status = EquilibriumStatus.OK
            if not own.reached[k]:
                status |= EquilibriumStatus.UNREACHABLE
            elif not own.within_limits[k]:
                status |= EquilibriumStatus.BEYOND_LIMITS
            if own.undetermined[k]:
                status |= EquilibriumStatus.ILL_CONDITIONED
            frame = (turn_by_vector(own.pose[k, 3:]), own.pose[k, :3])
        point = _point_at(at, snapshot.reference_point)
        forces = given_forces(loads, pull, snapshot.space, frame)
        on_platform = [*forces.pop("platform", ()), *platform_weights(self.robot, pull, frame)]
        groups = legs_of(snapshot, point, beams, forces, _pushes(preload), pull)
        length = float(snapshot.characteristic_length)
        problem = EquilibriumProblem(
            groups,
            snapshot.space.rows,
            point,
            length if length > 0 else 1.0,
            *arms_and_forces(on_platform, point),
        )
        own_laws = self.robot.laws if isinstance(self.robot, Robot) else {}
        if own_laws:
            check_own_laws(own_laws, snapshot)
        return Question(snapshot.name, problem, snapshot.space, frame, status, snapshot, own_laws)


@dataclass(frozen=True)
class PosedNetwork:
    """A network, or a linkage at joint coordinates, as it is without load."""

    robot: Network
    batch: tuple[int, ...] = ()

    def question(
        self,
        i: int,
        at: ArrayLike | None,
        loads: Loads | None,
        preload: Mapping[str, Any] | None,
        beams: Beams,
        gravity: Gravity = None,
        *,
        masses: bool = False,
    ) -> Question:
        """What is asked of it; masses it has none."""
        network = self.robot
        point = _point_at(at, network.reference_point)
        frame = (np.eye(3), np.asarray(network.reference_point, dtype=float))
        pull = acting_gravity(network, gravity)
        forces = given_forces(loads, pull, network.space, frame)
        on_platform = [
            *forces.pop("platform", ()),
            *(forces.pop(network.platform, ()) if network.platform != "platform" else ()),
        ]
        group = group_of(network, point, beams, forces, _pushes(preload))
        length = network.characteristic_length
        problem = EquilibriumProblem(
            (group,),
            network.space.rows,
            point,
            length if length > 0 else 1.0,
            *arms_and_forces(on_platform, point),
        )
        status = EquilibriumStatus.OK
        return Question(network.name, problem, network.space, frame, status, None)


def postures_of(robot: Any, pose: Any, near: Near) -> Postures | PosedNetwork:
    """The unloaded postures of a robot at poses, or of a snapshot."""
    if isinstance(robot, Linkage):
        robot, pose = network_at(robot, pose), None
    if isinstance(robot, Network) and pose is None and near is None:
        return PosedNetwork(robot)
    if isinstance(robot, Robot):
        posture = find_posture(robot, pose, near=near)
        return Postures(robot, posture, posture.batch)
    if isinstance(robot, Snapshot | Network) and (pose is not None or near is not None):
        raise InputError(
            f"pose of snapshot {robot.name!r}",
            got=pose if pose is not None else near,
            expected="none: a snapshot is frozen at its own pose",
        )
    if not isinstance(robot, Snapshot):
        raise InputError(
            "robot of an equilibrium",
            got=robot,
            expected="a Robot, a Snapshot, a Network or a Linkage",
            hint="cable_response answers for cables",
        )
    if robot.reference_point.ndim > 1:
        raise InputError(
            f"equilibrium of snapshot {robot.name!r}",
            got="a batch of poses",
            expected="one pose: snapshot.one(i)",
        )
    return Postures(robot, None, ())


def _point_at(at: ArrayLike | None, reference: np.ndarray) -> np.ndarray:
    """The point of the platform about which wrenches are (3,) [m]."""
    if at is None:
        return np.asarray(reference, dtype=float)
    point = as_floats("at", at, "three numbers [m]", "m")
    if point.shape != (3,):
        raise InputError("at", got=at, expected="three numbers [m]: one point")
    return point


def _pushes(preload: Mapping[str, Any] | None) -> dict[str, float]:
    return {
        name: as_float(f"preload of {name!r}", value, "one number [N or N m]")
        for name, value in (preload or {}).items()
    }


def wrenches_of(what: str, value: ArrayLike | None, space: Space) -> np.ndarray:
    """Wrenches, or displacements, (r,) or (N, r); zero when left out."""
    if value is None:
        return np.zeros(space.size)
    order, units = (
        (space.wrench_order, space.wrench_units)
        if what == "wrench"
        else (space.twist_order, space.twist_units)
    )
    expected = f"{space.size} numbers: {' '.join(order)} [{', '.join(dict.fromkeys(units))}]"
    array = as_floats(what, value, expected, units)
    if array.ndim == 0 or array.shape[-1] != space.size or array.ndim > 2:
        raise InputError(what, got=value, expected=f"{expected}, or a row for each answer")
    return array
