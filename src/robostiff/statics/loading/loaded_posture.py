"""What is asked of a robot under load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.result import require_one_pose
from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Near, Posture, find_posture, with_body_springs, with_masses
from robostiff.kinematics.masses_and_springs import bodies_of
from robostiff.kinematics.pose import check_is_not_posed
from robostiff.kinematics.turn import turn_by_vector
from robostiff.linkage import Linkage
from robostiff.model import PlacedPlatform, Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.model.mass import one_of
from robostiff.network import Network
from robostiff.spatial import Space, as_float, as_floats
from robostiff.statics.chains.beam_bowing import Beams
from robostiff.statics.chains.carried_masses import CarriedMasses
from robostiff.statics.chains.chain import wrench_at
from robostiff.statics.equations.problem import EquilibriumProblem
from robostiff.statics.loading.flexible_platform import node_names, on_platform_nodes
from robostiff.statics.loading.from_network import group_of
from robostiff.statics.loading.from_snapshot import legs_of, masses_on_legs
from robostiff.statics.loading.given_loads import (
    DeadForce,
    Frame,
    Gravity,
    Laws,
    Loads,
    Masses,
    acting_gravity,
    check_own_laws,
    given_forces,
    given_masses,
    load_vector,
    on_platform,
    weights_of,
    with_laws,
)

if TYPE_CHECKING:
    from robostiff.statics.loading.from_cables import CablePostures

_NO_MASSES = CarriedMasses()
# Of the loads: what is missing of them that is no rounding.
_MISSED = 1e-9
_NO_POSTURE = Status.UNREACHABLE | Status.INFEASIBLE | Status.FORM_DOES_NOT_HOLD


@dataclass(frozen=True)
class LoadedPosture:
    """A robot at one posture with its loads, ready to be solved.

    Attributes
    ----------
    name : str
    problem : EquilibriumProblem
    space : Space
    frame : tuple of (3, 3) and (3,) arrays
        Axes and origin of the platform frame at the unloaded posture [m].
    status : Status
        What is to be said of the posture.
    posed : Snapshot, Network or CableRobot
        The robot at that posture; of cables the robot itself.
    laws : Laws
        That the robot has.
    masses : CarriedMasses
        That vibrate; none unless they were asked for.
    """

    name: str
    problem: EquilibriumProblem
    space: Space
    frame: tuple[np.ndarray, np.ndarray]
    status: Status
    posed: Snapshot | Network | CableRobot
    laws: Laws = field(default_factory=dict)
    masses: CarriedMasses = _NO_MASSES

    @property
    def snapshot(self) -> Snapshot | None:
        """The robot at that posture; None of a network, and of cables."""
        return self.posed if isinstance(self.posed, Snapshot) else None

    @property
    def has_posture(self) -> bool:
        """Whether there is an unloaded posture."""
        return not self.status & _NO_POSTURE

    def under(self, laws: Laws | None) -> LoadedPosture:
        """The same, joints following the laws of the robot, or given ones in their place."""
        all_laws = {**self.laws, **(laws or {})}
        if not all_laws:
            return self
        groups = with_laws(self.problem.groups, all_laws)
        return replace(self, problem=replace(self.problem, groups=groups))


def one_loaded_posture(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Any,
    wrench: ArrayLike | None,
    at: ArrayLike | None,
    loads: Loads | None,
    preload: Mapping[str, Any] | None,
    beams: Beams,
    near: Near,
    gravity: Gravity = None,
    grows: str = "",
) -> tuple[LoadedPosture, np.ndarray]:
    """A robot at one posture, and one wrench (r,); not zero where it grows, as an example says."""
    postures = postures_of(robot, pose, near)
    given = one_wrench(postures, wrench)
    if grows and not np.any(given):
        raise InputError(
            f"wrench on {postures.robot.name!r}",
            got=given.tolist(),
            expected="a load that grows",
            hint=f"write {grows}",
        )
    return postures.loaded(0, at, loads, preload, beams, gravity), given


def one_wrench(postures: Postures | CablePostures, wrench: ArrayLike | None) -> np.ndarray:
    """The one wrench (r,) at the one posture of a robot."""
    given = wrenches_of("wrench", wrench, postures.robot.space)
    require_one_pose("a robot under load", postures.batch)
    if given.ndim > 1:
        raise InputError("wrench", got=wrench, expected="one wrench")
    return given


@dataclass(frozen=True)
class Postures:
    """The unloaded postures of a robot; a snapshot, or a network, has the one that it is in.

    Attributes
    ----------
    robot : Robot, Snapshot or Network
    posture : Posture or None
        Of a robot.
    batch : tuple of int
        Shape of its batch, () for one.
    """

    robot: Robot | Snapshot | Network
    posture: Posture | None = None
    batch: tuple[int, ...] = ()

    def loaded(
        self,
        i: int,
        at: ArrayLike | None,
        loads: Loads | None,
        preload: Mapping[str, Any] | None,
        beams: Beams,
        gravity: Gravity = None,
        *,
        masses: Masses | None = None,
    ) -> LoadedPosture:
        """The robot at posture i with its loads, and what vibrates where masses are given."""
        pull = acting_gravity(self.robot, gravity, loads)
        posed, frame, status = self._posed(i, masses is not None or bool(np.any(pull)))
        point = point_at(at, posed.reference_point)
        frame_of = partial(self._frame_of, i if self.batch else 0, posed, frame)
        forces = given_forces(loads, pull, posed.space, frame_of)
        given = _given_places(forces, point, posed)
        acting = list(forces.pop("platform", ()))
        pushes = {
            name: as_float(f"preload of {name!r}", value, "one number [N or N m]")
            for name, value in (preload or {}).items()
        }
        places = {"platform": point, **places_of(posed)} if masses else {}
        moving = given_masses(masses or {}, places, frame_of)
        on_it = moving.pop("platform", [])
        if isinstance(posed, Network):
            tool = places_of(posed)[posed.platform]
            for own in forces.pop(posed.platform, ()):
                acting.append(replace(own, point=tool) if own.point is None else own)
            group, more, carried = group_of(posed, point, beams, forces, pushes, pull, moving)
            groups = (group,)
        else:
            nodes = node_names(posed.platform)
            at_nodes = {node: forces.pop(name, ()) for name, node in nodes.items()}
            of_nodes = {node: moving.pop(name, []) for name, node in nodes.items()}
            groups = legs_of(posed, point, beams, forces, pushes, pull)
            more, carried = weights_of(posed.masses, pull), CarriedMasses((), posed.masses)
            if posed.platform is not None:
                group, on_tool, carried = on_platform_nodes(
                    groups[0], posed.platform, at_nodes, of_nodes, pull
                )
                groups, more = (group,), [*more, *on_tool]
                carried = replace(carried, on_platform=(*carried.on_platform, *posed.masses))
            if masses is not None:
                on_legs = masses_on_legs(posed, beams, moving)
                carried = replace(carried, on_legs=(*carried.on_legs, *on_legs))
        carried = replace(carried, on_platform=(*carried.on_platform, *on_it))
        problem = EquilibriumProblem(
            groups,
            posed.space.rows,
            point,
            float(posed.characteristic_length) or 1.0,
            on_platform([*acting, *more], point),
        )
        _check_all_act(problem, given, posed, pull)
        laws = self.robot.laws if isinstance(self.robot, Robot) else {}
        if laws and isinstance(posed, Snapshot):
            check_own_laws(laws, posed)
        return LoadedPosture(posed.name, problem, posed.space, frame, status, posed, laws, carried)

    def _frame_of(self, k: int, posed: Snapshot | Network, frame: Frame, name: str) -> Frame | None:
        """Axes and origin of a body at posture k, by its name; None where they are not known."""
        if name == "platform":
            return frame
        if isinstance(posed, Network):
            return next(((np.eye(3), n.point) for n in posed.nodes if n.name == name), None)
        nodes = node_names(posed.platform)
        if posed.platform is not None and name in nodes:
            at = posed.platform.platform.point_of(nodes[name])
            return posed.platform.rotation, posed.platform.in_world(at)
        if self.posture is None:
            return None
        bodies = bodies_of(self.posture)
        own = bodies.get(name) or bodies.get(name.partition("[")[0].partition(".beam")[0])
        return None if own is None else (one_of(own.R, 2, k), one_of(own.p, 1, k))

    def _posed(
        self, i: int, masses: bool
    ) -> tuple[Snapshot | Network, tuple[np.ndarray, np.ndarray], Status]:
        """The robot in its posture i, the frame of its platform, and what is to be said of it."""
        own = self.posture
        if own is None or isinstance(self.robot, Network):
            if isinstance(self.robot, Robot):
                raise TypeError("a robot has a posture")
            point = np.asarray(self.robot.reference_point, dtype=float)
            return self.robot, (np.eye(3), point), Status.OK
        k = i if self.batch else 0
        placed = with_masses(own) if masses else own.snapshot
        if own.robot.springs:
            placed = replace(placed, springs=with_body_springs(own).springs)
        snapshot = placed.one(k)
        status = Status.OK
        if not own.reached[k]:
            status |= Status.UNREACHABLE
        elif not own.within_limits[k]:
            status |= Status.BEYOND_LIMITS
        if own.undetermined[k]:
            status |= Status.ILL_CONDITIONED
        return snapshot, (turn_by_vector(own.pose[k, 3:]), own.pose[k, :3]), status


def _given_places(
    forces: Mapping[str, Sequence[DeadForce]],
    platform_point: np.ndarray,
    posed: Snapshot | Network,
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points in the world (3,) and forces (3,) as they are given [m, N]."""
    found = []
    for name, several in forces.items():
        for own in several:
            if own.point is not None:
                at = load_vector("point", name, own.point)
            elif name == "platform":
                at = platform_point
            else:
                at = places_of(posed).get(name, np.zeros(3))  # that there is none is told later
            found.append((at, load_vector("force", name, own.force)))
    return found


def _check_all_act(
    problem: EquilibriumProblem,
    given: list[tuple[np.ndarray, np.ndarray]],
    posed: Snapshot | Network,
    pull: np.ndarray,
) -> None:
    """Raise unless all forces and weights of what moves act, with their moments.

    The forces are as they are given, by their points, and the masses as the robot has them.
    """
    moving = {name for group in problem.groups for name in (*group.nodes, *group.within)}
    wanted = list(given)
    if np.any(pull):
        wanted += [(m.centre, m.value * pull) for m in posed.moving_masses(moving)]
    dead = problem.dead
    acting = [(problem.point + own, f) for own, f in zip(dead.arms, dead.forces, strict=True)]
    for load in (load for g in problem.groups for c in g.chains for load in c.loads):
        acting += zip(load.point, load.force, strict=True)
    if not wanted and not acting:
        return
    points, forces = (np.array(own, dtype=float) for own in zip(*wanted, *acting, strict=True))
    each = wrench_at(problem.point, points, forces) / np.repeat([1.0, problem.length], 3)
    each[len(wanted) :] *= -1
    if np.linalg.norm(each.sum(axis=0)) > _MISSED * np.sum(np.linalg.norm(each, axis=1)):
        raise NoAnswerError(f"no answer of {posed.name!r}: its loads are not those that are given")


def postures_of(robot: Any, pose: Any, near: Near) -> Postures | CablePostures:
    """The unloaded postures of a robot at poses, or of a snapshot, network or linkage."""
    if isinstance(robot, CableRobot):
        from robostiff.statics.loading.from_cables import CablePostures

        return CablePostures.of(robot, pose, near)
    if isinstance(robot, Linkage):
        robot, pose = robot.network_at(pose), None
    if isinstance(robot, Network) and pose is None and near is None:
        return Postures(robot)
    if isinstance(robot, Robot):
        posture = find_posture(robot, pose, near=near)
        return Postures(robot, posture, posture.batch)
    if isinstance(robot, Snapshot | Network):
        check_is_not_posed(robot, near if pose is None else pose)
    if not isinstance(robot, Snapshot):
        raise InputError(
            "robot of an equilibrium",
            got=robot,
            expected="a Robot, a Snapshot, a Network, a Linkage or a CableRobot",
        )
    if robot.reference_point.ndim > 1:
        raise InputError(
            f"equilibrium of snapshot {robot.name!r}",
            got="a batch of poses",
            expected="one pose: snapshot.one(i)",
        )
    return Postures(robot)


def places_of(posed: Snapshot | Network | CableRobot) -> dict[str, np.ndarray]:
    """Where the parts of the legs, or the nodes, are, by name."""
    if isinstance(posed, Network):
        return {node.name: np.asarray(node.point, dtype=float) for node in posed.nodes}
    if isinstance(posed, CableRobot):
        return {}
    found = {}
    for name, node in node_names(posed.platform).items():
        at = cast("PlacedPlatform", posed.platform)
        found[name] = at.in_world(at.platform.point_of(node))
    for leg in posed.legs:
        for block in leg.all_blocks:
            found[f"{leg.name}/{block.name}"] = np.asarray(block.branches[0].end, dtype=float)
        for part in leg.parts:
            joint = getattr(part, "joint", part.name)  # of a coupling the one that follows
            for name in (part.name, part.name.partition("[")[0], joint):
                # a joint of several freedoms stands where its first does
                found.setdefault(f"{leg.name}/{name}", np.asarray(part.point, dtype=float))
    return found


def point_at(at: ArrayLike | None, reference: np.ndarray) -> np.ndarray:
    """The point of the platform about which wrenches are (3,) [m]."""
    if at is None:
        return np.asarray(reference, dtype=float)
    return as_floats("at", at, "three numbers [m]: one point", "m", (3,))


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
