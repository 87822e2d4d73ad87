"""Deflection under a load, and who bends: energy shares, joint reactions, actuator loads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.careful_form import careful_stiffness
from robostiff.analysis.flexible_platform import platform_energies
from robostiff.analysis.leg_loads import leg_loads
from robostiff.analysis.leg_matrices import SolvedBlock, leg_matrices
from robostiff.analysis.one_pose import require_one_pose
from robostiff.analysis.result import RobotStiffness, about_point
from robostiff.analysis.result_tables import deflection_html
from robostiff.elastostatics import Status, Tolerance
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Near, Pose, find_posture, freedom_twist
from robostiff.model import (
    Actuated,
    PlacedBlock,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    Robot,
    Snapshot,
)
from robostiff.model.cable import CableRobot
from robostiff.network import Network, loads_under
from robostiff.spatial import Space, as_floats, move_twist, move_wrench

_DEFAULT_TOLERANCE = Tolerance()


@dataclass(frozen=True)
class PartShare:
    """Elastic energy of one part under the load.

    Attributes
    ----------
    leg, part : str
    energy : float
        [J].
    share : float
        Of the whole energy, 0 to 1; 0 without any.
    """

    leg: str
    part: str
    energy: float
    share: float


@dataclass(frozen=True)
class JointReaction:
    """What a joint carries.

    Attributes
    ----------
    leg, joint : str
    wrench : (6,) array
        Force [N] and moment [N m] about the joint's own point that the platform side exerts on the
        base side, world axes.
    point : (3,) array
        The joint's point [m].
    """

    leg: str
    joint: str
    wrench: np.ndarray
    point: np.ndarray


@dataclass(frozen=True)
class ActuatorLoad:
    """The load on an actuator along its own coordinate.

    Attributes
    ----------
    leg, joint : str
    load : float
        Force [N] or moment [N m] that the load applies in the direction of the coordinate; the
        drive holds the opposite.
    travel : float
        How far its own elasticity gives way [m or rad]; 0 for a rigid drive.
    """

    leg: str
    joint: str
    load: float
    travel: float


@dataclass(frozen=True, repr=False)
class Deflection:
    """How a robot gives way under a wrench.

    Attributes
    ----------
    wrench : (n,) array
        The load about the reference point, world axes [N, N m].
    stiffness : RobotStiffness
        What it was computed from.
    status : Status
        That of the stiffness, or ``UNBALANCED`` when the load would drive a free motion.
    moved : (n,) array or None
        See `twist`.
    parts : tuple of PartShare
        Every elastic part, largest energy first.
    reactions : tuple of JointReaction
    actuators : tuple of ActuatorLoad
    leg_wrenches : tuple of (n,) arrays
        What each leg carries about ``stiffness.origin``, world axes [N, N m]; none for a network.
    """

    wrench: np.ndarray
    stiffness: RobotStiffness
    status: Status
    moved: np.ndarray | None
    parts: tuple[PartShare, ...] = ()
    reactions: tuple[JointReaction, ...] = ()
    actuators: tuple[ActuatorLoad, ...] = ()
    leg_wrenches: tuple[np.ndarray, ...] = ()

    @property
    def twist(self) -> np.ndarray:
        """Displacement of the reference point and rotation of the platform (n,) [m, rad].

        Where free motions remain, the least displacement, to which any of them may be added.

        Raises
        ------
        NoAnswerError
            When there is none; the message says why.
        """
        if self.moved is None:
            raise NoAnswerError(
                f"no deflection of {self.stiffness.name!r} ({self.status}): "
                + "; ".join(self.advice)
            )
        return self.moved

    def __repr__(self) -> str:
        if not self.has_answer:
            return f"<Deflection of {self.stiffness.name!r}, status {self.status}>"
        twist = ", ".join(f"{x:.4g}" for x in self.twist)
        return f"<Deflection of {self.stiffness.name!r}: ({twist}) m, rad, status {self.status}>"

    def _repr_html_(self) -> str:
        return deflection_html(self)

    @property
    def has_answer(self) -> bool:
        """Whether there is a deflection."""
        return self.moved is not None

    @property
    def energy(self) -> float:
        """Elastic energy, half of F . t [J]."""
        return 0.5 * float(self.wrench @ self.twist)

    @property
    def advice(self) -> tuple[str, ...]:
        """What to know about this answer, a sentence each."""
        extra = Status(self.status & ~self.stiffness.status)
        return (*self.stiffness.advice, *extra.advice)


def deflection(
    robot: Robot | Snapshot | Network,
    pose: Pose = None,
    wrench: ArrayLike = (),
    *,
    at: ArrayLike | None = None,
    near: Near = None,
    tolerance: Tolerance = _DEFAULT_TOLERANCE,
) -> Deflection:
    """Deflection of the platform under a wrench, and how the parts of the robot share in it.

    Parameters
    ----------
    robot : Robot, Snapshot or Network
        The parts of a network are told by name; joints of it whose reaction is not determined,
        because rigid parts brace one another, are left out.
    pose : RigidTransform, array, JointCoordinates or None
        One pose, as for `stiffness`.
    wrench : (6,) array, or (3,) for a planar robot
        Force [N] and moment [N m] of the environment on the platform, about `at`, world axes.
    at : (3,) array, optional
        Point of the platform in the world [m]; the robot's reference point when left out.
    near : joint coordinates, optional
        Those that choose the posture, as for `stiffness`.
    tolerance : Tolerance

    Returns
    -------
    Deflection

    Raises
    ------
    InputError
        When the wrench or the pose does not fit, or several poses are given.

    Examples
    --------
    >>> import robostiff as rs
    >>> bent = rs.deflection(rs.load("gough-stewart-b"), wrench=[0, 0, -1000, 0, 0, 0])
    >>> round(1e6 * float(bent.twist[2]), 3), round(bent.parts[0].share, 3)
    (-2.161, 0.167)
    """
    if isinstance(robot, CableRobot):
        raise InputError(
            "robot of a deflection",
            got=f"cable robot {robot.name!r}",
            expected="a Robot or a Snapshot: cables may become slack, and need not stay near",
            hint="write cable_response(robot, pose, load=...)",
        )
    answer = about_point(careful_stiffness(robot, pose, near=near, tolerance=tolerance), at)
    hint = "for many poses multiply the wrench by compliance(robot, poses)"
    require_one_pose("a deflection", answer.batch_shape, hint)
    F = _checked_wrench(wrench, answer.space)
    if Status.UNREACHABLE in answer.status:
        return Deflection(F, answer, answer.status, None)
    to_origin = answer.origin - answer.reference_point
    to_origin = to_origin if answer.space is Space.SPATIAL else to_origin[:2]
    F_origin = move_wrench(F, to_origin)
    loads = leg_loads(answer, F_origin)
    if loads is None:
        few = Status.ILL_CONDITIONED if answer.status.has_stiffness else Status.OK
        return Deflection(F, answer, answer.status | few, None)
    if not loads.balanced:
        return Deflection(F, answer, answer.status | Status.UNBALANCED, None)
    t_origin, leg_wrenches = loads.twist, loads.wrenches
    parts: list[tuple[str, str, float]] = []
    reactions: list[JointReaction] = []
    actuators: list[ActuatorLoad] = []
    if isinstance(robot, Network):
        carried = loads_under(robot, F_origin, tolerance)
        parts += carried.energies
        reactions += [JointReaction(*told) for told in carried.reactions]
        actuators += [ActuatorLoad(*told) for told in carried.actuators]
    else:
        posed = _posed(robot, pose, near)
        for leg, own in zip(posed.legs, leg_wrenches, strict=True):
            F_leg = np.zeros(6)
            F_leg[list(answer.space.rows)] = own
            for element, F_element in _carried(leg, F_leg, answer):
                _add_element(
                    leg.name, element, F_element, answer.origin, parts, reactions, actuators
                )
        parts += platform_energies(posed, leg_wrenches, answer.origin, tolerance)
    total = sum(energy for *_, energy in parts)
    shares = [
        PartShare(leg, part, energy, energy / total if total > 0 else 0.0)
        for leg, part, energy in parts
    ]
    return Deflection(
        wrench=F,
        stiffness=answer,
        status=answer.status,
        moved=move_twist(t_origin, -to_origin),
        # Equal shares, told apart by rounding alone, stay in the order of the legs.
        parts=tuple(sorted(shares, key=lambda share: -round(share.share, 9))),
        reactions=tuple(reactions),
        actuators=tuple(actuators),
        leg_wrenches=tuple(leg_wrenches),
    )


def _posed(robot: Robot | Snapshot, pose: Pose, near: Near) -> Snapshot:
    if isinstance(robot, Snapshot):
        return robot
    return find_posture(robot, pose, near=near).snapshot.one(0)


def _carried(
    leg: PlacedLeg, F_leg: np.ndarray, answer: RobotStiffness
) -> Iterator[tuple[PlacedFreedom | PlacedSpring, np.ndarray]]:
    """Every joint and elastic part of a leg, with the wrench that it carries about the origin."""
    solved = ()
    if leg.blocks:
        known = answer.about_reference
        own = leg_matrices(leg, answer.origin, answer.space, known.length, known.tolerance)
        solved = own.blocks
    yield from _carried_by(leg, solved, F_leg, list(answer.space.rows))


def _carried_by(
    leg: PlacedLeg, solved: Sequence[SolvedBlock], F_leg: np.ndarray, rows: list[int]
) -> Iterator[tuple[PlacedFreedom | PlacedSpring, np.ndarray]]:
    blocks = iter(solved)
    for element in leg.elements:
        if not isinstance(element, PlacedBlock):
            yield element, F_leg
            continue
        block = next(blocks)
        parts = zip(element.branches, block.branches, block.whole.shares, strict=True)
        for branch, matrices, share in parts:
            F_branch = np.zeros(6)
            F_branch[rows] = share @ F_leg[rows]
            yield from _carried_by(branch, matrices.blocks, F_branch, rows)


def _add_element(
    leg: str,
    element: PlacedFreedom | PlacedSpring,
    F_leg: np.ndarray,
    origin: np.ndarray,
    parts: list[tuple[str, str, float]],
    reactions: list[JointReaction],
    actuators: list[ActuatorLoad],
) -> None:
    """Energy, reaction and actuator load of one element under the wrench that its leg carries."""
    F_here = move_wrench(F_leg, element.point - origin)
    if isinstance(element, PlacedSpring):
        own = np.concatenate([element.rotation.T @ F_here[:3], element.rotation.T @ F_here[3:]])
        energy = 0.5 * float(own @ element.elasticity.compliance @ own)
        parts.append((leg, element.name, energy))
        return
    reactions.append(JointReaction(leg, element.name, F_here, element.point))
    load = float(freedom_twist(element, origin) @ F_leg)
    travel = 0.0 if element.stiffness is None else load / element.stiffness
    if element.stiffness is not None:
        parts.append((leg, element.name, 0.5 * load * travel))
    if isinstance(element.role, Actuated):
        actuators.append(ActuatorLoad(leg, element.name, load, travel))


def _checked_wrench(wrench: ArrayLike, space: Space) -> np.ndarray:
    expected = f"{space.size} numbers: {' '.join(space.wrench_order)} [N, N m]"
    F = as_floats("wrench", wrench, expected, space.wrench_units)
    if F.shape != (space.size,):
        hint = "write deflection(robot, pose, wrench) or wrench=[...]: the pose comes first"
        raise InputError("wrench", got=wrench, expected=expected, hint=hint if not F.size else None)
    return F
