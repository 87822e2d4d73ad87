"""Deflection under a load, with energy shares, joint reactions and actuator loads."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.analysis.flexible_platform import platform_energies
from robostiff.analysis.leg_loads import leg_loads
from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.result_tables import deflection_html, shown_twist
from robostiff.elastostatics import BlockCompliance, Status
from robostiff.errors import NoAnswerError
from robostiff.kinematics import freedom_twist
from robostiff.markup import InNotebooks
from robostiff.model import (
    Actuated,
    PlacedBlock,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    Snapshot,
)
from robostiff.network import HeldUnderLoads, Network, loads_under
from robostiff.spatial import move_twist, move_wrench


def part_name(leg: str, part: str) -> str:
    """A part by its leg, or alone in a network, which has none."""
    return part if leg == "network" else f"{leg}/{part}"


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

    @property
    def name(self) -> str:
        """Leg and part."""
        return part_name(self.leg, self.part)


@dataclass(frozen=True)
class JointReaction:
    """The wrench that a joint carries.

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
        Deflection of its own elasticity [m or rad]; 0 for a rigid drive.
    unit : str
        Of the load: N of a slide, N m of a turn.
    """

    leg: str
    joint: str
    load: float
    travel: float
    unit: str

    @property
    def name(self) -> str:
        """Leg and joint."""
        return part_name(self.leg, self.joint)


@dataclass(frozen=True, repr=False)
class Deflection(InNotebooks):
    """Deflection of a robot under a wrench.

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
    work_of_loads : float or None
        Of forces and weights at bodies, on their displacements [J]; None where there are none.
    """

    wrench: np.ndarray
    stiffness: RobotStiffness
    status: Status
    moved: np.ndarray | None
    parts: tuple[PartShare, ...] = ()
    reactions: tuple[JointReaction, ...] = ()
    actuators: tuple[ActuatorLoad, ...] = ()
    leg_wrenches: tuple[np.ndarray, ...] = ()
    work_of_loads: float | None = None

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
        twist = ", ".join(f"{x:.4g}" for x in shown_twist(self))
        return f"<Deflection of {self.stiffness.name!r}: ({twist}) m, rad, status {self.status}>"

    def _repr_html_(self) -> str:
        return deflection_html(self)

    @property
    def has_answer(self) -> bool:
        """Whether there is a deflection."""
        return self.moved is not None

    @property
    def energy(self) -> float:
        """Elastic energy, half of the work of all loads: of F . t with the wrench alone [J]."""
        return 0.5 * (float(self.wrench @ self.twist) + (self.work_of_loads or 0.0))

    @property
    def advice(self) -> tuple[str, ...]:
        """Advice about this result, a sentence each."""
        extra = Status(self.status & ~self.stiffness.status)
        return (*self.stiffness.advice, *extra.advice)


def deflection_at(
    answer: RobotStiffness,
    wrench: np.ndarray,
    posed: Snapshot | Network | Callable[[], Snapshot | Network],
    held: HeldUnderLoads | None = None,
) -> Deflection:
    """How a robot deflects at the single pose of an answer, under a wrench about its point.

    `posed` is the robot there, or what places it there; a network may be held under forces at its
    bodies, which act too.
    """
    F = wrench
    if Status.UNREACHABLE in answer.status:
        return Deflection(F, answer, answer.status, None)
    F_origin = move_wrench(F, -answer.offset)
    if held is not None:
        if held.status:
            return Deflection(F, answer, answer.status | held.status, None)
        F_origin = F_origin + held.wrench
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
    work = None
    tolerance = answer.about_reference.tolerance
    placed = posed if isinstance(posed, Snapshot | Network) else posed()
    if isinstance(placed, Network):
        carried = loads_under(placed, F_origin, tolerance, held)
        work = None if held is None else carried.work
        parts += carried.energies
        reactions += [JointReaction(*own) for own in carried.reactions]
        actuators += [ActuatorLoad(*own) for own in carried.actuators]
    else:
        rows = list(answer.space.rows)
        for leg, blocks, own in zip(placed.legs, answer.leg_blocks, leg_wrenches, strict=True):
            F_leg = np.zeros(6)
            F_leg[rows] = own
            for element, F_element in carried_by(leg, blocks, F_leg, rows):
                _add_element(
                    leg.name, element, F_element, answer.origin, parts, reactions, actuators
                )
        parts += platform_energies(placed, leg_wrenches, answer.origin, tolerance)
    total = sum(energy for *_, energy in parts)
    shares = [
        PartShare(leg, part, energy, energy / total if total > 0 else 0.0)
        for leg, part, energy in parts
    ]
    return Deflection(
        wrench=F,
        stiffness=answer,
        status=answer.status,
        moved=move_twist(t_origin, answer.offset),
        # Shares that differ only by rounding stay in the order of the legs.
        parts=tuple(sorted(shares, key=lambda share: -round(share.share, 9))),
        reactions=tuple(reactions),
        actuators=tuple(actuators),
        leg_wrenches=tuple(leg_wrenches),
        work_of_loads=work,
    )


def carried_by(
    leg: PlacedLeg, solved: Sequence[BlockCompliance], F_leg: np.ndarray, rows: list[int]
) -> Iterator[tuple[PlacedFreedom | PlacedSpring, np.ndarray]]:
    """Elements of a leg, and the wrench (..., 6) of each: in a block, what its branch carries.

    `rows` are those of the space of the robot, among the six.
    """
    blocks = iter(solved)
    for element in leg.elements:
        if not isinstance(element, PlacedBlock):
            yield element, F_leg
            continue
        block = next(blocks)
        for i, (branch, inner) in enumerate(zip(element.branches, block.inner, strict=True)):
            share = block.shares[..., i, :, :]
            F_branch = np.zeros_like(F_leg)
            F_branch[..., rows] = np.einsum("...ij,...j->...i", share, F_leg[..., rows])
            yield from carried_by(branch, inner, F_branch, rows)


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
    travel = 0.0 if element.stiffness is None else float(load / element.stiffness)
    if element.stiffness is not None:
        parts.append((leg, element.name, 0.5 * load * travel))
    if isinstance(element.role, Actuated):
        actuators.append(ActuatorLoad(leg, element.name, load, travel, element.load_unit))
