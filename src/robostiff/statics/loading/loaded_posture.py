"""Robots at postures with their loads, ready to be solved."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial, singledispatch
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis import CableStiffness, cable_stiffness, stiffness
from robostiff.analysis.result import require_one_pose
from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import field, frozen, replace
from robostiff.kept import kept, kept_for_last
from robostiff.kinematics import (
    ActuatorCoordinates,
    Near,
    Posture,
    posture_finder,
    with_body_springs,
    with_masses,
)
from robostiff.kinematics.masses_and_springs import bodies_of
from robostiff.kinematics.pose import PoseRequest, check_is_not_posed
from robostiff.kinematics.turn import turn_by_vector
from robostiff.linkage import Linkage, network_at
from robostiff.model import Robot, Snapshot, StiffnessLaw
from robostiff.model.batched import one_of
from robostiff.model.cable import CableRobot
from robostiff.model.subject import Subject
from robostiff.network import Network
from robostiff.spatial import Space, as_float, as_floats, check_order
from robostiff.statics.chains.beam_bowing import ElementsOfParts
from robostiff.statics.chains.elements import FiniteSpring, wrench_at
from robostiff.statics.equations.problem import EquilibriumProblem
from robostiff.statics.equations.vibration import CarriedMasses
from robostiff.statics.loading.assembly import assembly_of
from robostiff.statics.loading.given_loads import (
    Acting,
    Frame,
    Masses,
    acting_gravity,
    check_own_laws,
    given_forces,
    given_masses,
    on_platform,
)
from robostiff.statics.loading.legs import loaded_legs

_NO_MASSES = CarriedMasses()
# What is said of a pose before the load, and holds under it.
_LASTING = Status.UNBALANCED | Status.UNREACHABLE | Status.INFEASIBLE | Status.FORM_DOES_NOT_HOLD
# Of the loads: what is missing of them that is no rounding.
_MISSED = 1e-9
_NO_POSTURE = Status.UNREACHABLE | Status.INFEASIBLE | Status.FORM_DOES_NOT_HOLD


@frozen
class LoadedPosture:
    """A robot at one posture with its loads, ready to be solved."""

    name: str
    problem: EquilibriumProblem = field(compare=False)  # answers are compared by what was found
    space: Space
    #: tuple of (3, 3) and (3,) arrays: axes and origin of the platform frame at the unloaded
    #: posture [m]
    frame: tuple[np.ndarray, np.ndarray]
    status: Status  #: what is to be said of the posture
    posed: Snapshot | Network | CableRobot  #: the robot at that posture; of cables the robot itself
    #: that vibrate; none where an equilibrium alone is computed
    masses: CarriedMasses = field(default=_NO_MASSES, compare=False)
    #: the loads, and how they divide beams
    acting: Acting = field(default_factory=Acting, compare=False)

    @property
    def has_posture(self) -> bool:
        """Whether there is an unloaded posture, where legs are not singular by rounding."""
        return not (self.status & _NO_POSTURE or self.problem.at_rest.lacks_digits)


def one_loaded_posture(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Any,
    wrench: ArrayLike | None,
    near: Near,
    acting: Acting,
    grows: str = "",
) -> tuple[LoadedPosture, np.ndarray, Callable[[Acting], LoadedPosture]]:
    """A robot at one posture, one wrench (r,), and the former under other loads.

    The wrench is not zero where it grows, as an example says.
    """
    postures = postures_of(robot, pose, near)
    given = wrenches_of("wrench", wrench, postures.robot.space)
    require_one_pose("a robot under load", postures.batch)
    if given.ndim > 1:
        raise InputError("wrench", got=wrench, expected="one wrench")
    if grows and not np.any(given):
        raise InputError(
            f"wrench on {postures.robot.name!r}",
            got=given.tolist(),
            expected="a load that grows",
            hint=f"write {grows}",
        )
    return postures.with_loads(0, acting), given, partial(postures.loaded_at, 0)


@frozen
class Postures:
    """The unloaded postures of a robot; a snapshot, or a network, has the one that it is in."""

    robot: Any  #: Robot, Snapshot, Network or CableRobot
    request: PoseRequest | None = None  #: poses of a robot of legs
    near: Near = None
    batch: tuple[int, ...] = ()  #: shape of its batch, () for one
    #: of a cable robot without the loads: its tensions balance its weight
    cables: CableStiffness | None = None

    @cached_property
    def posture(self) -> Posture | None:
        """Of a robot of legs, found when it is needed."""
        request = self.request
        return None if request is None else posture_finder(self.robot).at(request, self.near)

    @property
    def first(self) -> Postures:
        """The first of many of a robot of legs, alone."""
        request = cast("PoseRequest", self.request).part(slice(0, 1))
        return replace(self, request=request, batch=request.batch)

    def with_loads(self, i: int, acting: Acting, masses: Masses | None = None) -> LoadedPosture:
        """The robot at posture i with its loads, and what vibrates where masses are given.

        Of one posture that of the last call is kept, with what has been found out about it.
        """
        if self.batch:
            return self.loaded_at(i, acting, masses)
        return kept_for_last(Postures.loaded_at, self, 0, acting, masses)

    def loaded_at(self, i: Any, acting: Acting, masses: Masses | None = None) -> LoadedPosture:
        """The same; of several postures, whose numbers are i, all at once, without its status."""
        pull = acting_gravity(self.robot, acting.gravity, acting.loads)
        posture, status, k = self.posture, Status.OK, i if self.batch else 0
        if self.cables is not None:
            posed: Any = self.cables[i] if self.batch else self.cables
            pose, status = posed.pose, posed.status & _LASTING
        elif posture is None:
            posed = self.robot
            pose = np.concatenate([np.asarray(posed.reference_point, dtype=float), np.zeros(3)])
        else:
            posed = self._placed(masses is not None or bool(np.any(pull))).at(k)
            pose, status = posture.pose[k], self.status(k) if np.ndim(k) == 0 else status
        frame = turn_by_vector(pose[..., 3:]), pose[..., :3]
        assembly = assembly_of(posed)
        laws = getattr(self.robot, "laws", {})
        if laws:
            check_own_laws(laws, posed)
        point = reference = np.asarray(posed.reference_point, dtype=float)
        if acting.at is not None:
            point = as_floats("at", acting.at, "three numbers [m]: one point", "m", (3,))
        frames = {**assembly.frames, "platform": frame}

        def frame_of(name: str) -> Frame | None:
            """Axes and origin of a body by its name; None where they are not known."""
            if name in frames or posture is None:
                return frames.get(name)
            bodies = bodies_of(posture)
            body = bodies.get(name) or bodies.get(name.partition("[")[0].partition(".beam")[0])
            return None if body is None else (one_of(body.R, 2, k), one_of(body.p, 1, k))

        usual = {"platform": reference} | {name: at for name, (_, at) in assembly.names.items()}
        given = given_forces(acting.loads, pull, posed.space, frame_of)
        forces = {
            name: [x if x.point is not None else replace(x, point=usual.get(name)) for x in several]
            for name, several in given.items()
        }
        found = loaded_legs(
            assembly,
            ElementsOfParts(posed.space, acting.beams, acting.division),
            point,
            posed.space.rows,
            forces,
            {
                name: as_float(f"preload of {name!r}", value, "one number [N or N m]")
                for name, value in (acting.preload or {}).items()
            },
            pull,
            given_masses(masses or {}, usual, frame_of),
            {} if acting.laws is None else {**laws, **acting.laws},
        )
        length: Any = posed.characteristic_length
        if not np.all(length > 0) and any(
            isinstance(e, FiniteSpring) for chain in found.legs.chains for e in chain.elements
        ):  # all in one point: a length from the elastic parts
            alone = replace(legs, springs=()) if (legs := as_snapshot(posed)) else posed
            length = np.where(length > 0, length, stiffness(alone).length)
        problem = EquilibriumProblem(
            found.legs,
            posed.space.rows,
            point,
            cast("float", np.where(length > 0, length, 1.0)[()]),
            on_platform(found.on_platform, point),
            found.nodes,
            on_platform(assembly.steady, point) if assembly.steady else None,
            assembly.moment,
        )
        # what was given has to act with its moments: forces, and the masses of the robot, by points
        wanted = [(load.point, load.force) for several in forces.values() for load in several]
        if np.any(pull) and assembly.masses:
            wanted += [(m.centre, m.value * pull) for m in posed.moving_masses(problem.nodes)]
        wanted += [(load.point, -load.force) for c in found.legs.chains for load in c.loads]
        acts = (wrench_at(point, np.asarray(at), np.asarray(f)) for at, f in wanted)
        W = np.array([-problem.dead.acting(np.eye(3))[0], *acts])
        W[:, 3:] /= problem.length if wanted else 1.0
        if np.linalg.norm(W.sum(axis=0)) > _MISSED * np.sum(np.linalg.norm(W, axis=1)):
            raise NoAnswerError(
                f"no answer of {posed.name!r}: its loads are not those that are given"
            )
        if np.ndim(k) == 0 and not status & _NO_POSTURE and problem.at_rest.lacks_digits:
            status |= Status.ILL_CONDITIONED
        machine = posed if self.cables is None else self.robot
        about = posed.name, problem, posed.space, frame, status, machine
        return LoadedPosture(*about, found.masses, acting)

    def as_robots(
        self, rows: Sequence[int], acting: Acting, masses: Masses
    ) -> tuple[EquilibriumProblem, CarriedMasses] | None:
        """Postures without load as robots side by side; None where that is not so simple.

        They differ in places and in compliances alone.
        """
        robot, posture = self.robot, self.posture if self.batch else None
        if posture is None or not np.all(posture.reached[rows]) or acting.loads:
            return None
        roles = [role for leg in robot.legs for role in leg.chain.roles]
        varying = [isinstance(getattr(role, "stiffness", None), StiffnessLaw) for role in roles]
        pull = acting_gravity(robot, acting.gravity, acting.loads)
        if robot.laws or robot.springs or np.any(pull) or any(varying):
            return None
        loaded = self.loaded_at(np.array(rows), acting, masses)
        legs = loaded.problem.legs.of_robots(len(rows))
        at, length = legs.platform_point, float(np.ravel(loaded.problem.length)[0])
        problem = replace(loaded.problem, legs=legs, point=at, length=length)
        return None if problem.bears_loads else (problem, loaded.masses)

    @kept
    def _placed(self, masses: bool) -> Snapshot:
        """All postures of a robot of legs, its masses in place or not."""
        posture = cast("Posture", self.posture)
        snapshot = with_body_springs(posture) if posture.robot.springs else posture.snapshot
        return replace(with_masses(posture), springs=snapshot.springs) if masses else snapshot

    def status(self, k: int) -> Status:
        """What is to be said of posture k of a robot of legs."""
        posture, status = cast("Posture", self.posture), Status.OK
        if not posture.reached[k]:
            status |= Status.UNREACHABLE
        elif not posture.within_limits[k]:
            status |= Status.BEYOND_LIMITS
        return status | Status.ILL_CONDITIONED if posture.undetermined[k] else status


def postures_of(robot: Any, pose: Any, near: Near) -> Postures:
    """The unloaded postures of a robot at poses, or of a snapshot, network or linkage.

    Those of the last call are kept where they are few, with what has been found out about them.
    """
    if not isinstance(robot, Subject):
        return _postures_of(robot, pose, near)
    return kept_for_last(_postures_of, robot, pose, near)


@singledispatch
def _postures_of(robot: Any, pose: Any, near: Near) -> Postures:
    raise InputError(
        "robot of an equilibrium",
        got=robot,
        expected="a Robot, a Snapshot, a Network, a Linkage or a CableRobot",
    )


@_postures_of.register(Robot)
def _(robot: Robot, pose: Any, near: Near) -> Postures:
    request = posture_finder(robot).request(pose)
    return Postures(robot, request, near, request.batch)


@_postures_of.register(Linkage)
def _(robot: Linkage, pose: Any, near: Near) -> Postures:
    values = pose.values if isinstance(pose, ActuatorCoordinates) else pose
    return postures_of(network_at(robot, values), None, near)


@_postures_of.register(Network)
@_postures_of.register(Snapshot)
def _(robot: Network | Snapshot, pose: Any, near: Near) -> Postures:
    check_is_not_posed(robot, near if pose is None else pose)
    if np.ndim(robot.reference_point) > 1:
        raise InputError(
            f"equilibrium of snapshot {robot.name!r}",
            got=Words("a batch of poses"),
            expected="one pose: snapshot.one(i)",
        )
    return Postures(robot)


@_postures_of.register(CableRobot)
def _(robot: CableRobot, pose: Any, near: Near) -> Postures:
    if near is not None:
        raise InputError(
            f"near of {robot.name!r}", got=near, expected="none: cables have one posture"
        )
    before = cable_stiffness(robot, pose)
    if len(before.batch_shape) > 1:
        raise InputError(
            f"poses of {robot.name!r}", got=before.batch_shape, expected="poses along one axis"
        )
    return Postures(robot, batch=before.batch_shape, cables=before)


def as_snapshot(posed: Any) -> Snapshot | None:
    """A robot of legs at a posture; None of a network, and of cables."""
    return posed if isinstance(posed, Snapshot) else None


def beside(batch: tuple[int, ...], given: np.ndarray) -> np.ndarray:
    """Wrenches, or displacements, (N, r) beside a batch of poses; (r,) of one and one pose.

    Raises
    ------
    InputError
        When poses are not along one axis, with one of these or as many.
    """
    shape = given.shape[:-1]
    if len(batch) > 1 or (batch and shape not in {(), (1,), batch}):
        raise InputError(
            "batch under load",
            got=Words(f"poses {batch}, wrenches {shape}"),
            expected="poses along one axis, with one wrench or as many",
        )
    return np.broadcast_to(given, (*(batch or shape), given.shape[-1]))


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
    check_order(what, value, order)
    array = as_floats(what, value, expected, units)
    if array.ndim == 0 or array.shape[-1] != space.size or array.ndim > 2:
        raise InputError(what, got=value, expected=f"{expected}, or a row for each answer")
    return array
