"""Deflection under loads, at one pose or many: energy shares, joint reactions, actuator loads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.analysis.result import Stiffness
from robostiff.analysis.snapshot_stiffness import branches_of, name_of_part
from robostiff.elastostatics import BlockCompliance, ConjugateWrenches, Status, scaling
from robostiff.elastostatics.status import StatusOfPoses
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import frozen
from robostiff.markup import InNotebooks
from robostiff.model import Actuated, PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.network import NodeForce, network_under_loads
from robostiff.spatial import Space, move_twist, move_wrench

_BALANCED = 1e-9  # part of a load that may do work on a free motion
# Of a load and the wrenches of all legs: what they lack for equilibrium that is no rounding.
_MISSED = 1e-6


def part_name(leg: str, part: str) -> str:
    """A part by its leg, or alone in a network, which has none."""
    return part if leg == "network" else f"{leg}/{part}"


@frozen
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


@frozen
class JointReaction:
    """The wrench that a joint carries.

    Attributes
    ----------
    leg, joint : str
    wrench : (6,) array
        Force [N] and moment [N m] about the joint's own point that the platform side exerts on the
        base side, of a network its second body on its first; world axes.
    point : (3,) array
        The joint's point [m].
    """

    leg: str
    joint: str
    wrench: np.ndarray
    point: np.ndarray


@frozen
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


@frozen
class LoadedElements:
    """What loads do to the elements of a robot at one pose; attributes as those of `Deflection`."""

    status: Status
    twist: np.ndarray | None = None
    parts: tuple[PartShare, ...] = ()
    reactions: tuple[JointReaction, ...] = ()
    actuators: tuple[ActuatorLoad, ...] = ()
    leg_wrenches: tuple[np.ndarray, ...] = ()
    work_of_loads: float | None = None
    forces: tuple[NodeForce, ...] = ()


@frozen(repr=False)
class Deflection(StatusOfPoses, InNotebooks):
    """Deflection of a robot under a wrench at one pose, or at each of many.

    Of many, `twist`, `energy` and `leg_wrenches` are arrays that begin with the axes of the batch,
    masked where a pose has no answer; ``[i]`` is one of them, which has all else.

    Attributes
    ----------
    wrench : (..., n) array
        The load about the reference point, world axes [N, N m].
    stiffness : Stiffness
        What it was computed from.
    of_loads : LoadedElements or None
        Of one pose with loads at bodies besides; else it follows when first used.
    """

    wrench: np.ndarray
    stiffness: Stiffness
    of_loads: LoadedElements | None = None

    @cached_property
    def elements(self) -> LoadedElements:
        """What the loads do at one pose.

        Raises
        ------
        InputError
            Of many.
        """
        if self.stiffness.batch_shape:
            subject, count = f"deflection of {self.stiffness.name!r}", self.stiffness.rows.size
            raise InputError(subject, got=Words(f"{count} poses"), expected="one: [i]")
        return self.of_loads or loaded_elements(self.stiffness, self.wrench)

    @cached_property
    def _solution(self) -> tuple[np.ndarray, np.ndarray]:
        """Status (...) and twists about the reference point (..., n)."""
        C, known = self.stiffness.inverted
        codes = np.array(self.stiffness.status_codes)
        if known.all() and self.of_loads is None:
            return codes, np.einsum("...ij,...j->...i", C, self.wrench)
        if not self.stiffness.batch_shape:
            twist = self.elements.twist
            twist = np.full(self.wrench.shape, np.nan) if twist is None else twist
            return np.array(int(self.elements.status), dtype=np.uint16), twist
        twist = np.full(self.wrench.shape, np.nan)
        if known.any():
            twist[known] = np.einsum("...ij,...j->...i", C[known], self.wrench[known])
        rest, n = self.stiffness.not_inverted, self.wrench.shape[-1]
        loads = _loads(rest, self.wrench[~known].reshape(*rest.batch_shape, n))
        codes[~known] = loads.status_codes.ravel()
        twist[~known] = move_twist(loads.twist, rest.offset).reshape(-1, n)
        return codes, twist

    @property
    def status_codes(self) -> np.ndarray:
        """Status of every pose (...): of its stiffness, or ``UNBALANCED``.

        The latter where a load would drive a free motion.
        """
        return self._solution[0]

    @property
    def answered(self) -> np.ndarray:
        """Which poses have a deflection (...)."""
        return ~np.isnan(self._solution[1][..., 0])

    @property
    def has_answer(self) -> bool:
        """Whether there is a deflection; of many, one of each."""
        return bool(np.all(self.answered))

    @property
    def twist(self) -> Any:
        """Displacement of the reference point and rotation of the platform (..., n) [m, rad].

        Where free motions remain, the least displacement, to which any of them may be added.

        Raises
        ------
        NoAnswerError
            When there is none at a single pose; the message says why.
        """
        if self.batch_shape:
            return self._where_known(self._solution[1])
        if not self.has_answer:
            raise NoAnswerError(
                f"no deflection of {self.stiffness.name!r} ({self.status}): "
                + "; ".join(self.advice)
            )
        return self._solution[1]

    @property
    def energy(self) -> Any:
        """Elastic energy, half the work of all loads: F . t / 2 with the wrench alone (...) [J]."""
        work = np.sum(self.wrench * self.twist, axis=-1)
        return work / 2 if self.batch_shape else 0.5 * (float(work) + (self.work_of_loads or 0.0))

    @property
    def parts(self) -> tuple[PartShare, ...]:
        """Every elastic part, largest energy first."""
        return self.elements.parts

    @property
    def reactions(self) -> tuple[JointReaction, ...]:
        """What every joint carries."""
        return self.elements.reactions

    @property
    def actuators(self) -> tuple[ActuatorLoad, ...]:
        """What every drive carries."""
        return self.elements.actuators

    @property
    def leg_wrenches(self) -> tuple[np.ndarray, ...]:
        """What each leg carries about ``stiffness.origin``, world axes (..., n) [N, N m].

        None for a network.
        """
        if self.batch_shape:
            wrenches = _loads(self.stiffness, self.wrench).wrenches
            return tuple(map(self._where_known, wrenches))
        return self.elements.leg_wrenches

    @property
    def work_of_loads(self) -> float | None:
        """Of forces and weights at bodies, on their displacements [J]; None without any."""
        return self.elements.work_of_loads

    @property
    def forces(self) -> tuple[NodeForce, ...]:
        """Forces and weights at bodies, of a network."""
        return self.elements.forces

    @property
    def advice(self) -> tuple[str, ...]:
        """Advice about this result, a sentence each."""
        extra = Status(self.status & ~self.stiffness.status)
        return (*self.stiffness.advice, *extra.advice)

    def _where_known(self, values: np.ndarray) -> np.ma.MaskedArray:
        mask = np.broadcast_to(~self.answered[..., None], values.shape)
        return np.ma.MaskedArray(values, mask)

    def __repr__(self) -> str:
        whole = f"Deflection of {self.stiffness.name!r}"
        if self.batch_shape:
            poses, known = self.answered.size, int(np.count_nonzero(self.answered))
            return f"<{whole}, {poses} poses, {known} answered>"
        if not self.has_answer:
            return f"<{whole}, status {self.status}>"
        length = float(self.stiffness.length)
        moved = self.stiffness.space.without_rounding(self.twist, length)
        twist = ", ".join(f"{x:.4g}" for x in moved)
        return f"<{whole}: ({twist}) m, rad, status {self.status}>"

    def __len__(self) -> int:
        return len(self.wrench) if self.batch_shape else 1

    def __getitem__(self, index: Any) -> Deflection:
        """The deflection at one pose, or at some poses."""
        return Deflection(self.wrench[index], self.stiffness[index])


def loaded_elements(
    answer: Stiffness, wrench: np.ndarray, forces: tuple[NodeForce, ...] = ()
) -> LoadedElements:
    """What a wrench about its point does to a robot at the single pose of an answer.

    Forces at the bodies of a network act, too.
    """
    if Status.UNREACHABLE in answer.status:
        return LoadedElements(answer.status)
    if not where_loads_are_known(answer):
        few = Status.ILL_CONDITIONED if answer.status.has_stiffness else Status.OK
        return LoadedElements(answer.status | few)
    placed: Any = answer.placed()
    if not answer.question.has_legs:
        at_own = placed.reference_point - answer.reference_point
        v = at_own[: placed.space.translations]
        tolerance = answer.details().tolerance
        found = network_under_loads(placed, move_wrench(wrench, v), forces, tolerance)
        if found.status:
            return LoadedElements(answer.status | found.status)
        inside = found.loads()
        return LoadedElements(
            answer.status,
            found.twist(placed.platform, answer.reference_point),
            parts=by_share(inside.energies),
            reactions=tuple(JointReaction(*own) for own in inside.reactions),
            actuators=tuple(ActuatorLoad(*own) for own in inside.actuators),
            work_of_loads=found.work_of(forces) if forces else None,
            forces=forces,
        )
    loads = leg_loads(answer, move_wrench(wrench, -answer.offset))
    if loads.status_codes:
        return LoadedElements(answer.status | Status(int(loads.status_codes)))
    details = answer.details()
    energies: list[tuple[str, str, float]] = []
    reactions: list[JointReaction] = []
    actuators: list[ActuatorLoad] = []
    (branches, _), known = branches_of(placed), details.leg_blocks
    for i, (leg, own) in enumerate(zip(branches, loads.wrenches, strict=True)):
        inside, F_leg = known[i] if i < len(known) else (), answer.space.spatial(own)
        for element, F in carried_by(leg, inside, F_leg, answer.space):
            F_here = move_wrench(F, element.point - answer.origin)
            if isinstance(element, PlacedSpring):
                R = element.rotation.T
                F_own = np.concatenate([R @ F_here[:3], R @ F_here[3:]])
                energy = 0.5 * float(F_own @ element.elasticity.compliance @ F_own)
                energies.append((*name_of_part(leg, element.name), energy))
                continue
            reactions.append(JointReaction(leg.name, element.name, F_here, element.point))
            load, k = float(element.twist(answer.origin) @ F), element.stiffness
            travel = 0.0 if k is None else float(load / k)
            if k is not None:
                energies.append((leg.name, element.name, 0.5 * load * travel))
            if isinstance(element.role, Actuated):
                own_drive = leg.name, element.name, load, travel, element.load_unit
                actuators.append(ActuatorLoad(*own_drive))
    return LoadedElements(
        answer.status,
        move_twist(loads.twist, answer.offset),
        parts=by_share(energies),
        reactions=tuple(reactions),
        actuators=tuple(actuators),
        leg_wrenches=loads.wrenches[: len(details.legs)],
    )


def by_share(each: Iterable[tuple[str, str, float]]) -> tuple[PartShare, ...]:
    """Energies of leg and part [J], the largest first."""
    energies = list(each)
    total = sum(energy for *_, energy in energies)
    shares = [PartShare(*own, own[-1] / total if total > 0 else 0.0) for own in energies]
    # Shares that differ only by rounding stay in the order of the legs.
    return tuple(sorted(shares, key=lambda share: -round(share.share, 9)))


def carried_by(
    leg: PlacedLeg, solved: Sequence[BlockCompliance], F_leg: np.ndarray, space: Space
) -> Iterator[tuple[PlacedFreedom | PlacedSpring, np.ndarray]]:
    """Elements of a leg, and the wrench (..., 6) of each: in a block, what its branch carries."""
    blocks = iter(solved)
    for element in leg.elements:
        if not isinstance(element, PlacedBlock):
            yield element, F_leg
            continue
        block = next(blocks)
        for i, (branch, inner) in enumerate(zip(element.branches, block.inner, strict=True)):
            share, F = block.shares[..., i, :, :], F_leg[..., list(space.rows)]
            F_branch = space.spatial(np.einsum("...ij,...j->...i", share, F))
            yield from carried_by(branch, inner, F_branch, space)


@frozen
class LegLoads:
    """Loads of the legs of a robot, about the origin of its result, in world axes."""

    twist: np.ndarray  # (..., n): the least displacement, where free motions remain [m, rad]
    # (...) of uint16: UNBALANCED where the load does work on free motions, ILL_CONDITIONED where
    # the wrenches of the legs are not that of the load; nothing else holds there
    status_codes: np.ndarray
    # tuple of (..., n): on each leg, then each part of a flexible platform; none for a network
    wrenches: tuple[np.ndarray, ...]


def leg_loads(answer: Stiffness, wrench: np.ndarray) -> LegLoads:
    """Loads of the legs under a wrench (..., n) about the origin of a result, all within reach.

    They share it with the least energy, the primary result of linear statics: that needs a
    stiffness matrix neither of a leg nor of the robot, and holds where a direction is rigid.
    """
    whole = answer.details()
    every = whole.wrenches
    s = scaling(whole.length, whole.space)
    F = (wrench / s)[..., None]
    found = whole.load_sharing
    sizes = found.shares @ F, found.rigid_shares @ F
    (among,) = ConjugateWrenches.carried([every], *sizes)
    if whole.shares is None:
        known = [leg.carried for leg in whole.legs if leg.carried is not None]
        wrenches = ConjugateWrenches.carried(known, *sizes)
    else:
        of_each = np.einsum("...bij,...j->...bi", whole.shares, wrench)
        wrenches = list(np.moveaxis(of_each / s[..., None, :], -2, 0)[..., None])

    def size(own: np.ndarray) -> np.ndarray:
        return np.linalg.norm(own[..., 0], axis=-1)

    # Without free motions a part of the load is missing by rounding alone: rigid wrenches of two
    # legs that are almost one carry 1e8 of a load, and miss 1e-8 of it.
    driven = (size(F - among) > _BALANCED * size(F)) & (whole.rank < F.shape[-2])
    codes = np.where(driven, np.uint16(Status.UNBALANCED), np.uint16(0))
    if of_legs := wrenches[: len(whole.legs)]:
        most = size(F) + np.sum([size(own) for own in of_legs], axis=0)
        lost = ~driven & ~(size(F - np.sum(of_legs, axis=0)) <= _MISSED * most)
        codes = codes | np.where(lost, np.uint16(Status.ILL_CONDITIONED), np.uint16(0))
    return LegLoads(
        twist=(found.compliance @ F)[..., 0] / s,
        status_codes=codes,
        wrenches=tuple(own[..., 0] * s for own in wrenches),
    )


def where_loads_are_known(answer: Stiffness) -> np.ndarray:
    """Where `leg_loads` has an answer (...)."""
    return (answer.rank >= 0) & (answer.details().wrenches.count >= answer.rank)


def _loads(answer: Stiffness, wrench: np.ndarray) -> LegLoads:
    """As `leg_loads`, of a wrench (..., n) about the reference point; NaN where there is none."""
    F = move_wrench(wrench, -answer.offset)
    codes, twist = np.array(answer.status_codes), np.full(wrench.shape, np.nan)
    of_legs = tuple(np.full(wrench.shape, np.nan) for _ in answer.details().legs)
    known = where_loads_are_known(answer)
    if known.any():
        loads = leg_loads(answer[known], F[known])
        codes[known] |= loads.status_codes
        held = (loads.status_codes == 0)[..., None]
        twist[known] = np.where(held, loads.twist, np.nan)
        for own, wrenches in zip(of_legs, loads.wrenches, strict=False):
            own[known] = np.where(held, wrenches, np.nan)
    lost = ~known & answer.answered
    codes[lost] |= np.uint16(Status.ILL_CONDITIONED)
    return LegLoads(twist, codes, of_legs)
